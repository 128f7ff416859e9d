/// What two materials do when they touch: Mohr-Coulomb with cohesion and tension cut-off, springs or hard contact,
/// restitution. One entry per pair of materials, resolved (no wildcards) and validated before it gets here.
#pragma once
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace talus {

struct ContactLaw {
  double friction = 0;    // tan(phi)                                   [1]
  double cohesion = 0;    // c, times the tributary area                [Pa]
  double tension = 0;     // tension cut-off, times the tributary area  [Pa]
  enum class Stiffness { hard, per_contact, per_area };
  Stiffness stiffness = Stiffness::hard;
  double normal_stiffness = 0;  // k_n [N/m] per contact point, or [Pa/m] per area; Kind::hertz: 4/3 E* sqrt(R) [N/m^1.5] per point
  double shear_stiffness = 0;   // k_s, same meaning; 0 with springs: k_n / 2.5 is filled in by the scene
  std::optional<double> restitution;             // normal, Newton's, given by the user
  std::optional<double> restitution_tangential;
  double rolling_resistance = 0;  // lever arm over the equivalent radius [1]
  double drilling_resistance = 0; // moment about the normal over normal force and equivalent radius [1]
  double damping_ratio = 0;       // of the contact spring [1]
  enum class Kind { linear, hertz, crushing, table };
  Kind kind = Kind::linear;
  double hertz_radius = 0;        // [m], Kind::hertz
  double hertz_modulus = 0;       // E* of the two materials [Pa], Kind::hertz
  double crushing_pressure = 0;   // [Pa], Kind::crushing
  std::vector<std::pair<double, double>> table;  // (indentation m, force N), Kind::table
  bool chosen = false;            // stiffness was chosen by us, from the materials
};

/// Symmetric table of laws by material index.
struct ContactLaws {
  int materials = 0;
  std::vector<ContactLaw> law;   // materials x materials, row major
  const ContactLaw& operator()(int a, int b) const { return law[static_cast<std::size_t>(a * materials + b)]; }
};

}  // namespace talus
