/// Normal force of a sprung contact over its indentation x (x <= 0: no force).
///
///   linear    F = k x (below 0 as well: a row cuts it, p >= 0)
///             F = f(x) = k V(x) at a corner, whose area grows as it sinks
///   hertz     F = k s^(3/2),  k = 4/3 E* sqrt(R),  s = x + c F                              [hertz1882]
///   crushing  F = f(x) - f(max(y, x - p A/k)),  f(x) = k x, at a corner k V(x)
///             with a pressure that grows, and an end:
///             F = f(x) - max(f(y), (1 - r) (f(x - p/k_A) - f(x - p/k_A - H/(1 - r)))),  r = G/(k_A + G)
///   table     F = k t(x), t linear between the points, the last slope beyond them
///   bed       the sum over the columns below a block (contact/laws/bed.hpp), linear or crushing
///
///   k     stiffness of the contact point                        [N/m], hertz [N/m^1.5], table 1 [1]
///   V     mean depth of a corner's cell, int_0^x A(x)/A         [m]
///   R     radius of a sphere on a half-space                    [m]
///   c     compliance of the cell touched, which Hertz's law holds already; 0 at a fixed surface [m/N]
///   y     crushed for good                                      [m]
///   p, A  pressure that crushes, area, of a corner its cell's     [Pa], [m^2]
///   k_A   stiffness per area, k / A                             [Pa/m]
///   G, H  growth of the pressure by depth, thickness crushed    [Pa/m], [m]
///
/// Of a face crushing is min(k (x - y), p A). A corner is made of columns of the area that x has come
/// through, A(x), each elastic up to p: it crushes p times the volume that it sinks into. Columns with G and
/// H follow k_A (s - y) = p + G y, y <= H; f(x) = 0 for x < 0.
///
/// A step of a curved law from x0 to x1 takes the mean force (W(x1) - W(x0)) / (x1 - x0), the discrete
/// gradient of the work W(x) = int_0^x F: its work is then exactly the change of W, whether the contact opens
/// or closes within the step or not.
#pragma once
#include <algorithm>
#include <limits>
#include <memory>

#include "contact/laws/bed.hpp"
#include "contact/laws/corner_area.hpp"
#include "contact/laws/law.hpp"

namespace talus::contact {

struct NormalLaw {
  const ContactLaw* law = nullptr;
  double stiffness = 0;                                     // k: [N/m], hertz [N/m^1.5], table [1]
  std::shared_ptr<const CornerArea> corner;                 // linear, crushing: of a corner's cell
  double limit = 0;                                         // crushing: p A [N]
  double crushed = 0;                                       // crushing: y [m]
  double relief = 0;                                        // hertz: c [m/N]
  double start = -std::numeric_limits<double>::infinity();  // crushing, of a leapfrog's step: x at its start,
                                                            // where `crushed` is that of the way there [m]
  std::shared_ptr<const Bed>
      bed;  // at a structure's skin: springs per area, and what crushes; x is its greatest depth

  /// A leapfrog's step begins at x; what the skin and turning add to the way that the last step was told is
  /// no crushing of this one.
  void begin_step(double x) {
    if (bed || !law->crushes()) return;
    start = x;
    crushed = std::max(crushed, x - yield());
  }
  double force(double x) const;   // [N]
  double slope(double x) const;   // dF/dx, from the right at a kink [N/m]
  double work(double x) const;    // [J]; while crushing it holds what is crushed as well
  double stored(double x) const;  // part of it that comes back [J]
  double crushing(double x) const { return work(x) - stored(x); }  // [J]
  /// On the way from x0 to the present place, that led a leapfrog there: work up to x0, and the part of it
  /// that crushed, 0 at the present place. What yields now yielded there already [J].
  double before(double x0) const;
  double crushing_before(double x0) const;
  double crushed_after(double x) const;  // y once x was reached [m]
  /// Part of its area that presses at x.
  double part(double x) const { return corner ? corner->part(x) : x > 0 ? 1.0 : 0.0; }
  double pressed_area(double x) const { return limit / law->crushing_pressure * part(x); }  // crushing [m^2]
  double depth_of(double energy) const;  // linear: x at which it stores that; crushing: no less than x at
                                         // which it has taken that, nothing crushed before [m]
  /// Greatest slope on the way to the depth that an approach of that energy, after what was done up to
  /// `least`, and a weight lead to, no less than `least` [N/m].
  double stiffest(double energy, double weight, double least) const;
  /// Mean force over a step from x0 to x1, and its derivative by x1.
  double mean_force(double x0, double x1, double& derivative) const;
  /// The same with no force below 0 for the linear law too, and x0 on the way that led to the present place:
  /// the work of a contact that opens or closes within the step is its own.
  double secant(double x0, double x1, double& derivative) const;

 private:
  double whole(double x) const;  // hertz: s [m]
  double elastic(double x) const {
    return stiffness * (corner ? corner->volume(x) : std::max(0.0, x));
  }                                                                     // f [N]
  double elastic_slope(double x) const { return stiffness * part(x); }  // [N/m]
  double elastic_energy(double x) const {
    return stiffness * (corner ? corner->square(x) : x > 0 ? 0.5 * x * x : 0.0);
  }  // [J]
  double hardening() const {
    return law->yield_gradient > 0 && law->stiffness == ContactLaw::Stiffness::per_area
               ? law->yield_gradient / (law->normal_stiffness + law->yield_gradient)
               : 0.0;
  }  // r
  double bottom() const {
    return law->yield_thickness > 0 ? yield() + law->yield_thickness / (1 - hardening())
                                    : std::numeric_limits<double>::infinity();
  }  // x at which the first column is crushed through [m]
  bool plain() const {
    return !(law->yield_gradient > 0 || law->yield_thickness > 0);
  }                                      // its columns keep their pressure
  double lost(double x) const;           // f(y) on the way that crushes without a stop: F = f - lost [N]
  double lost_slope(double x) const;     // [N/m]
  double lost_work(double x) const;      // its integral [J]
  double inverse(double force) const;    // x at which f is so much [m]
  double reached(double crushed) const;  // x on that way at which so much is crushed [m]
  double yield() const { return limit / stiffness; }  // crushing: p A/k [m]
  bool yields() const {
    return law->crushes() && start - crushed >= yield() * (1 - 1e-3);
  }  // what the skin gives way meanwhile left apart
};

}  // namespace talus::contact
