/// Scenes and references that several cases share.
#pragma once
#include <numbers>
#include <string>
#include <vector>

#include "core/types.hpp"
#include "verify/suite.hpp"

namespace talus::verify {

inline constexpr double deg = std::numbers::pi / 180, g = 9.81,
                        pi = std::numbers::pi;  // [rad/degree], gravity of every scene here [m/s^2]
inline constexpr const char* stone =
    "young = \"30 GPa\"\npoisson = 0.25";  // stiff rock, as keys of a material

/// Tetrahedron on planes 130/40 and 220/60 (dip direction/dip).
struct WedgeScene {
  Vec3 normal_a, normal_b, line;  // upward normals; line of intersection, downwards
  WedgeScene();
  std::vector<Vec3> corners() const;  // two on the line, one more on each plane
  std::string text(const Method& m, double phi, double duration, double speed = 0) const;
};

/// Displacement of a block against a table with acceleration a sin(w t) after `end`, both at rest at first;
/// friction mu g.
double shaken_block_slip(double amplitude, double omega, double friction, double end);

/// Spin in body axes of block 0.
Vec3 body_spin(const sim::HistoryRow& r);
/// Angle of block 0, turned about y [rad], from its quaternion.
double turn_about_y(const sim::HistoryRow& r);

/// Corners of a regular prism along y that lies on a face, its centroid above x = 0.
std::vector<Vec3> prism(int n, double radius, double length, double& inradius);

/// Arch of n flat-sided voussoirs, mean radius 1, springing on z = 0.
std::string arch_text(const Method& m, int n, double thickness, double mu, double duration);

}  // namespace talus::verify
