/// What the specification says about supports, loads and probes, found on the mesh.
#pragma once
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/materials/material_mc2010.hpp"

namespace talus::fem {

struct Supports {
  std::vector<std::array<bool, 3>> held;  // per node
  std::vector<int> nodes;                 // any direction held
  Vec3 centroid = Vec3::Zero();           // of the supported nodes, world axes [m]
  bool none = true;                       // no node is
};

/// Nodal pattern of one prescribed traction: force at factor 1.
struct PatchLoad {
  std::vector<int> node;
  std::vector<Vec3> force;  // [N]
  double area = 0;          // [m^2]
  std::vector<std::pair<double, double>> history;
  double factor(double t) const;
};

struct ProbePoint {
  std::array<int, 8> node;
  std::array<double, 8> weight;
};

/// By the Model Code, of what the specification gives. Throws InputError as material::mc2010().
material::Concrete concrete_of(const StructureSpec& spec);

/// Throw InputError if a support or load meets nothing. A probe outside follows the nearest material point.
Supports find_supports(const StructureSpec& spec, const HexMesh& mesh);
/// `whole`: extent of the mesh of which this is a part; a load may then meet none of these faces, and
/// check_area() is due of all parts together.
std::vector<PatchLoad> find_loads(const StructureSpec& spec, const HexMesh& mesh,
                                  const std::vector<SkinQuad>& skin, const Box3* whole = nullptr);
void check_area(const StructureSpec& spec, const StructureSpec::Load& load, double area);
Box3 bounds(const std::vector<Vec3>& points);
std::vector<ProbePoint> find_probes(const StructureSpec& spec, const HexMesh& mesh);

}  // namespace talus::fem
