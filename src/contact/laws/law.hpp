/// What two materials do when they touch: Mohr-Coulomb with cohesion and tension cut-off, springs or hard
/// contact, restitution. One entry per pair of materials, resolved (no wildcards) and validated before it
/// gets here.
#pragma once
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace talus {

struct ContactLaw {
  double friction = 0;  // tan(phi)                                   [1]
  double cohesion = 0;  // c, times the tributary area                [Pa]
  double tension = 0;   // tension cut-off, times the tributary area  [Pa]
  enum class Stiffness { hard, per_contact, per_area };
  Stiffness stiffness = Stiffness::hard;
  double normal_stiffness =
      0;  // k_n [N/m] per contact point, or [Pa/m] per area; Kind::hertz: 4/3 E* sqrt(R) [N/m^1.5] per point
  double shear_stiffness = 0;  // k_s, same meaning; 0 with springs: k_n / 2.5 is filled in by the scene
  std::optional<double> restitution;  // normal, Newton's, given by the user
  double restitution_half_speed = 0;  // normal speed at which it has fallen to half, 0: it does not [m/s]
  std::optional<double> restitution_tangential;
  double rolling_resistance = 0;   // lever arm over the equivalent radius [1]
  double drilling_resistance = 0;  // moment about the normal over normal force and equivalent radius [1]
  double damping_ratio = 0;        // of the contact spring [1]
  enum class Kind { linear, hertz, crushing, table };
  Kind kind = Kind::linear;
  double hertz_radius = 0;       // [m], Kind::hertz
  double crushing_pressure = 0;  // [Pa], Kind::crushing
  double yield_gradient = 0;     // by which that pressure grows with the depth crushed [Pa/m], Kind::crushing
  double yield_thickness = 0;    // of what crushes, 0: without end [m], Kind::crushing
  double ploughing_pressure =
      0;                         // resistance along the surface over the area in the way [Pa], Kind::crushing
  double ploughing_density = 0;  // the same over half of the square of the speed [kg/m^3], Kind::crushing
  double friction_most = 0;      // coefficient that friction grows to with the way slid, 0: it does not [1]
  double friction_way = 1;       // way over which it grows [m]
  double friction_recovery = 0;  // rate at which the way is forgotten out of contact [1/s]
  double vegetation_height = 0;  // above the ground, below which a block's centroid is braked [m]
  double vegetation_drag = 0;    // force over speed [kg/s]
  std::vector<std::pair<double, double>> table;  // (indentation m, force N), Kind::table
  bool chosen = false;                           // stiffness was chosen by us, from the materials

  bool operator==(const ContactLaw&) const = default;

  /// Its force follows a curve of its own, which takes the place of `normal_stiffness`. What is not curved is
  /// springs of a stiffness, at a face by its area.
  bool curved() const { return kind == Kind::hertz || kind == Kind::table; }
  /// It keeps a part of its indentation for good, so that its force depends on what was reached before.
  bool crushes() const { return kind == Kind::crushing; }
  /// n of a force that grows as x^n, up to where it crushes; 0: another curve [1].
  double exponent() const { return kind == Kind::table ? 0.0 : kind == Kind::hertz ? 1.5 : 1.0; }
  /// It presses by a spring; else the contact is hard.
  bool sprung() const { return stiffness != Stiffness::hard || curved(); }
  /// Newton's restitution of a contact that comes on with a normal speed v [m/s]: restitution / (1 + (v /
  /// half_speed)^2) [pfeiffer1989]; 0 where none is given. Of the energy of the approach, m v^2 / 2, the part
  /// 1 - e(v)^2 is dissipated, never less than 1 - restitution^2.
  double restitution_at(double speed) const {
    const double ratio = restitution_half_speed > 0 ? speed / restitution_half_speed : 0.0;
    return restitution.value_or(0) / (1 + ratio * ratio);
  }
  /// It has a ground law of its own: one that yields, ploughs, or changes with the way slid.
  bool yields() const {
    return crushes() &&
           (yield_gradient > 0 || yield_thickness > 0 || ploughing_pressure > 0 || ploughing_density > 0);
  }
  bool changes_with_way() const { return friction_most > 0; }
  /// Coefficient of friction after a way slid [m].
  double friction_after(double way) const {
    return changes_with_way()
               ? friction + (friction_most - friction) * 2 / std::numbers::pi * std::atan(way / friction_way)
               : friction;
  }
};

/// Symmetric table of laws by material index.
struct ContactLaws {
  int materials = 0;
  std::vector<ContactLaw> law;  // materials x materials, row major
  const ContactLaw& operator()(int a, int b) const {
    return law[static_cast<std::size_t>(a * materials + b)];
  }
};

}  // namespace talus
