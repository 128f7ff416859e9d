/// The scene's terrain as geometry takes it, and where blocks of a release area start on it.
#pragma once
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "contact/detection/detect.hpp"
#include "geometry/terrain.hpp"
#include "scene/scene.hpp"

namespace talus::sim {

/// The terrain, without the rock mass that is cut out of it. Nothing if the scene has no terrain. Throws
/// InputError. `report`: gets "progress: ..." of what takes longer.
std::optional<geometry::Terrain> load_ground(const scene::Scene& scene,
                                             const std::function<void(const std::string&)>& report = {});

/// Places found so far, so that later blocks keep clear of earlier ones: centroid and radius.
using Occupied = std::vector<std::pair<Vec3, double>>;

/// Centroid and orientation of each copy of a body (about its centroid) in a release area. The same seed
/// gives the same places. Throws InputError if the area lies off the ground or is too small for the copies.
/// `crs`: of the scene's files (geometry::agree_on_crs).
std::vector<std::pair<Vec3, Mat3>> release_places(const scene::Release& release, const Polyhedron& body,
                                                  const scene::Scene& scene, const geometry::Terrain* terrain,
                                                  std::string& crs, Occupied& occupied);

/// Centroid of a body, turned by `rotation`, at the one place that a release names. Throws InputError if
/// there is no ground below all of its plan.
Vec3 place_above(const scene::Release& release, const Polyhedron& body, const Mat3& rotation,
                 const scene::Scene& scene, const geometry::Terrain* terrain);

/// Height of the ground at the place of a point, the upper one of terrain and planes [m]; NaN without any.
/// The terrain counts up to the first underside of an overhang above the point: under an overhang the ground
/// is the floor there, elsewhere the topmost face.
double ground_height(const contact::SurfaceIndex* terrain, const std::vector<Plane>& planes, const Vec3& at);
/// The same of the uppermost ground at a place in plan.
double uppermost_ground(const contact::SurfaceIndex* terrain, const std::vector<Plane>& planes, double x,
                        double y);

/// Whether terrain or a plane fills the place [m].
using InGround = std::function<bool(const Vec3&)>;
InGround ground_of(const TriangleSurface* terrain, const std::vector<Plane>& planes);

/// Blocks whose centroid has no ground below: over NODATA (an error), or beside the terrain (null: there is
/// none) or in a gap of it in a scene without planes (a warning); and blocks that start a kilometre or more
/// above the ground of terrain and planes, whose height is `under` (a warning).
std::vector<Problem> ground_problems(const std::string& block, const Vec3& centroid,
                                     const geometry::Terrain* terrain, const Eigen::AlignedBox2d& limits,
                                     bool has_planes, double under);

}  // namespace talus::sim
