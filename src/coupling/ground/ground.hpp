/// Nodes of structures against what is fixed: planes, the terrain, blocks without degrees of freedom. What
/// falls, flies or comes off lands on it.
///
///   gap g = n . (x - a), a the nearest point of the ground; a row of the contact problem as between two
///   structures, without the terms of a partner (rows/assembly.hpp)
///
/// What is built into the ground, g < 0 at the place as built, is founded there and does not meet it:
/// supports hold it. Nor do nodes that are held altogether.
#pragma once
#include <string>
#include <vector>

#include "coupling/environment.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

/// All of a scene, in the order of planes, terrain, blocks.
std::vector<Ground> grounds_of(const Environment& env, const dda::Model& model, const dda::State& state);

/// That of a partner of a SurfacePair.
const Ground& ground_of(const Environment& env, const Partner& partner);

/// Index into the scene's materials, of a triangle where it has several.
int ground_material(const Environment& env, const Ground& ground, int face);

/// As messages name it: "plane 1", "the terrain", "the fixed block B".
std::string name_of(const dda::Model& model, const Ground& ground);

/// How deep x lies in it, 0 outside [m]; in a mesh not below its faces by more than `most`.
double depth_in(const Environment& env, const Ground& ground, const Vec3& x, double most);

/// Whether a box may reach it.
bool reaches(const Environment& env, const Ground& ground, const Box3& box);

/// Vertices of a structure's surface, of what its index follows, that may be within `reach` of it, ascending.
void nodes_near(const Environment& env, const Ground& ground, const contact::SurfaceIndex& nodes,
                double reach, std::vector<int>& vertices);

/// As contact::node_surface(), for node `node` at x. False if it is founded, held, or farther off than
/// `margin`.
bool node_ground(const Environment& env, const Ground& ground, const Structure& structure, int node,
                 const Vec3& x, const Vec3& outward, double margin, contact::ContactPoint& out);

/// Whether a node of the structure may touch it within a stretch in which its skin moves by `reach` [m].
bool may_come_to(const Environment& env, const Ground& ground, const Structure& structure, double reach);

}  // namespace talus::coupling
