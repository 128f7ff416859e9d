/// What summary.json says of one member (pier, column, span of a deck) of a structure.
///
///   V_dyn / V_Rd    max over time and stations of sqrt((V_x / V_Rd,x)^2 + (V_y / V_Rd,y)^2), V the mean of
///                   every step over load_window
///   residual drift  mean of the last tenth of the run less that under permanent load; a span's deflection
///
/// Damage class, our own, by what an inspection would find (the first that holds, from the top):
///   4 lost      a tenth of it is gone, its top has come off, a span's end has left its bearings, drift > 5 %
///   3 severe    a bar is broken, 1 % of it is gone, drift > 1 %, V_dyn exceeds V_Rd with mean strengths
///   2 moderate  a bar has yielded, a crack exceeds 0.4 mm, or V_dyn exceeds the design resistance
///   1 slight    a crack exceeds 0.1 mm;  0 none;  drift: the residual one over the length
/// V_dyn / V_Rd and cracks of the runs that this one goes on from count: damage stays.
///
/// Function of a span, our own, the class its own or that of a pier below one of its ends if that is worse:
/// the first that holds of
///   closed      class 3 or 4, an end has moved by more than 50 mm (the joint), deflection > 1/250 of length
///   restricted  class 2, or the residual deflection exceeds 1/1000: to be inspected before traffic
///   open        otherwise
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "sim/frame.hpp"

namespace talus::io {

class MemberTrack {
 public:
  /// `elastic`: no cracks, no losses are computed (damage = "none").
  explicit MemberTrack(const Member& member, bool elastic = false) : member_(member), elastic_(elastic) {}
  /// A history row: the state then, and the greatest loads up to it.
  void add(double time, const MemberState& state, const MemberPeaks& peaks);
  /// `all`: the members of its structure, in their order.
  nlohmann::ordered_json summary(std::span<const MemberTrack> all) const;
  /// Damage class and what it rests on; of what is elastic alone there is none.
  struct Verdict {
    int grade = 0;
    const char* name = "";
    std::string basis;
    double use_design = 0;
    int least = 0, most = 0;    // what the class would be with the scatter of time steps and cells
    std::string doubt() const;  // that in words, empty where it is one class
  };
  bool has_verdict() const { return member_.shear_design[0] > 0; }
  bool elastic() const { return elastic_; }
  /// Something presses on it in the last tenth of the run: its drift then is no residual one.
  void set_under_load(bool under_load) { under_load_ = under_load; }
  Verdict verdict() const;
  /// What traffic a span may carry after the run, and why; of anything else nothing.
  struct Function {
    const char* state = "";
    std::string basis;
  };
  Function function(std::span<const MemberTrack> all) const;
  const std::string& name() const { return member_.name; }

 private:
  bool top_came_off() const;
  std::array<double, 2> residual_drift() const;

  Member member_;
  bool elastic_ = false, under_load_ = false;
  MemberPeaks peaks_;
  double widest_ = 0;  // crack of samples and rows [m]
  MemberState last_;
  std::vector<double> time_;
  std::vector<std::array<double, 2>> drift_;  // without that of the first row
  std::array<double, 2> first_drift_{};
  double first_shift_ = 0;  // of a span's ends [m]
};

}  // namespace talus::io
