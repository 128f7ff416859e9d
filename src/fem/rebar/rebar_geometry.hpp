/// Reinforcement as polylines: from a CSV file or by rule. The file format stands in docs/guide/rebar.md.
///
/// symbol     meaning                                                     unit     shape
/// points     vertices of the bar's axis, world axes                      m        n x 3, n >= 2
/// diameter   nominal                                                     m        1
#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "core/types.hpp"
#include "fem/materials/material_steel.hpp"

namespace talus::rebar {

struct Bar {
  std::string name;
  double diameter = 0;
  std::vector<Vec3> points;
  material::Steel::Parameters steel;
  std::string file;  // where it was given, for messages; empty for rules
  int line = 0;
  bool start_held = false, end_held = false;  // goes on into what holds the structure there: no slip
  double area() const { return 0.25 * M_PI * diameter * diameter; }
  double perimeter() const { return M_PI * diameter; }
  double length() const;
};

/// Reads bars; throws InputError with every problem of the file (line and column of each).
std::vector<Bar> read_bars(const std::string& path);
/// The same from text; `name` stands for the file in messages.
std::vector<Bar> parse_bars(const std::string& text, const std::string& name);

/// A prismatic member: its section lies in the plane of `axis_x`, `axis_y` about `base`, and runs `length`
/// along axis_x x axis_y.
struct Member {
  enum class Section { rectangular, round };
  Section section = Section::rectangular;
  double width = 0, depth = 0;  ///< along axis_x and axis_y; round: width is the diameter [m]
  double length = 0;            ///< [m]
  Vec3 base = Vec3::Zero();     ///< centre of the section at the start
  Vec3 axis_x = Vec3::UnitX(), axis_y = Vec3::UnitY();
  bool held_start = false, held_end = false;  ///< the section there is held: longitudinal bars run to it, not
                                              ///< only to one cover before it
};

/// n longitudinal bars inside the stirrups, evenly along the perimeter (rectangular: at the corners first, n
/// >= 4; round: n >= 4).
struct LongitudinalRule {
  int bars = 0;
  double diameter = 0, cover = 0;  ///< cover: to the outside of the stirrup [m]
  double stirrup_diameter = 0;     ///< 0: none
  material::Steel::Parameters steel;
};
/// Closed stirrups every `spacing`, the first and last half a spacing from the ends.
struct StirrupRule {
  double diameter = 0, cover = 0, spacing = 0;
  material::Steel::Parameters steel;
};

/// Throw InputError if the bars do not fit; `key` stands in the message.
std::vector<Bar> longitudinal_bars(const Member& member, const LongitudinalRule& rule,
                                   const std::string& key = "rebar");
std::vector<Bar> stirrups(const Member& member, const StirrupRule& rule, const std::string& key = "rebar");

}  // namespace talus::rebar
