/// Design formulas for the impact of a falling block, as cross-checks of a computed contact force. They need
/// no run and no model.
///
///   Hertz        F = (4/3 E* sqrt R)^(2/5) (5/2 W)^(3/5)               peak, elastic half-space, closed form
///   Labiouse     F = 1.765 M_E^(2/5) R^(1/5) W^(3/5)                   peak, cushion        [labiouse1996]
///   Japan        F = 2.108 (m g)^(2/3) lambda^(2/5) H^(3/5) alpha      peak, cushion              [jra2000]
///                in kN and m
///   Switzerland  F = 2.8 e^(-1/2) R^(7/10) M_E^(2/5) tan(phi) W^(3/5)  equivalent static        [astra2008]
///   EN 1991-1-7  F = v sqrt(k m)                                       peak, hard impact  [en1991-1-7, C.1]
///   EN 1992-1-1  V_Rd = v_Rd,c u_1 d, at most v_Rd,max u_0 d           resistance to punching
///                                                                                          [en1992-1-1, 6.4]
///                u_1 at 2d, as far as it lies within the member; none of a member narrower than 5d that it
///                does not fit into (5.3.1: no slab)
///
/// symbol   meaning                                                    unit
/// m, v     mass and velocity of the block                             kg, m/s
/// W, H     kinetic energy m v^2 / 2 and height of fall v^2 / (2 g)    J, m
/// R        radius, half the diameter of the block                     m
/// M_E      modulus of subgrade reaction of the cushion by plate test  Pa
/// e        thickness of the cushion                                   m
///
/// Every result says whether it is a peak, an equivalent static force or a resistance, and how far it has
/// been checked.
#pragma once
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/units.hpp"

namespace talus::formulas {

struct InputValue {
  std::string name;  ///< as in --set
  std::string symbol;
  Dimension dimension;
  double value = 0;  ///< SI
  std::string meaning;
  std::string origin;        ///< "given", "default", or how it was derived
  double low = 0, high = 0;  ///< allowed range
};

/// The value with its unit as a reader wants it: "30 GPa", "35 deg", and a bare number where there is none.
std::string text(const InputValue& value);

enum class Kind { peak, mean, equivalent_static, resistance };
const char* text(Kind kind);

struct Result {
  std::string id;  ///< hertz, labiouse, japan, switzerland, en1991-hard, en1992-punching
  std::string title;
  std::string symbol, unit;
  double value = 0;  ///< SI; for a force N. NaN: not applicable, `note` says why
  Kind kind = Kind::peak;
  std::string equation;
  std::string source;
  std::string status;              ///< "verified: closed form" or "as commonly cited, unverified"
  std::string note;                ///< what it assumes, and where it was not meant for
  std::vector<InputValue> inputs;  ///< those it used
};

/// What the formulas know about the block, the cushion and the structure. Made of mass and velocity, the rest
/// has defaults.
class Inputs {
 public:
  /// diameter 0: that of a sphere of 2600 kg/m^3. Throws InputError.
  Inputs(double mass, double velocity, double diameter = 0);
  /// `text` with or without unit ("0.5 m", "35 deg"). Throws InputError: unknown name (the nearest is named),
  /// unit or range.
  void set(const std::string& name, const std::string& text);
  /// `origin`: where the value comes from.
  void set(const std::string& name, double value, const std::string& origin = "given");
  double get(const std::string& name) const;
  const std::vector<InputValue>& all() const { return values_; }

 private:
  InputValue& find(const std::string& name);
  void check(const InputValue& v) const;
  std::vector<InputValue> values_;
};

/// All formulas, in a fixed order; those for a cushion only where there is one.
std::vector<Result> evaluate(const Inputs& inputs, bool cushion = true);

/// A table for the terminal, 100 columns.
std::string table(const Inputs& inputs, const std::vector<Result>& results);

}  // namespace talus::formulas
