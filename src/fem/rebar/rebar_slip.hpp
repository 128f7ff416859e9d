/// Bond slip of embedded bars [mc2010, 6.1.1], solved along each bar at the given strains of the concrete:
///
///   eps_k = e_k + (s_{k+1} - s_k) / L_k,   A (sigma_k - sigma_{k-1}) = p l_j tau(s_j)
///
/// the stationary point of bar and bond energy in the slips s, so that the force on the concrete stays A
/// sigma times the gradient of its own strain. The slip has no inertia of its own (the bar's mass moves with
/// the concrete). Straight ends are free but where they lie on a held face; a bend of more than 30 degrees
/// anchors the bar (s = 0), and so do the ends of closed ties.
///
/// symbol   meaning                                                unit
/// e_k      strain of the concrete along segment k                 -
/// s_j      slip of the bar against the concrete at its point j    m
/// p l_j    surface of the bar that belongs to the point           m^2
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "fem/rebar/rebar_embed.hpp"

namespace talus::rebar {

class SlipField {
 public:
  struct Sums {
    double energy = 0, dissipation = 0, largest = 0;
  };  ///< of the bond: stored now, of this call [J]; largest slip [m]

  SlipField(const EmbeddedBars& bars, double f_cm);

  /// Slips and their strains (added to those of the concrete) for the strains `host` of the concrete after a
  /// time h, NaN where it is gone; the steel starts from `old` and the total strains `old_strain`. `counts`:
  /// of the first segment of a bar, whether its bond enters the sums; null: all do. Results wait for
  /// accept(). Throws NumericalFailure if a bar finds no balance.
  Sums solve(std::span<const double> host, double h, std::span<const material::Steel::State> old,
             std::span<const double> old_strain, const std::function<bool(int)>& counts = {});
  void accept();
  std::span<const double> strain() const { return strain_; }  ///< of the last solve, per segment
  double slip(std::size_t point) const { return next_slip_[point]; }

  /// Of a segment: slips and bond at both of its ends, and its strain, which stays what it was where no solve
  /// follows the restart. Every point is in the records of both segments that it joins.
  static constexpr std::size_t record_width = 7;
  void write(std::size_t segment, std::vector<double>& record) const;
  void read(std::size_t segment, const double* record);

 private:
  struct Run {
    int bar, first, last, point;
  };  // segments [first, last) in one piece; its points start at `point`
  void solve_run(const Run& run, std::span<const double> host, double h,
                 std::span<const material::Steel::State> old, std::span<const double> old_strain);

  const EmbeddedBars* bars_;
  material::BondSlip law_;
  std::vector<Run> runs_;
  std::vector<int> point_;       // at the start of each segment
  std::vector<double> surface_;  // p l_j per point; 0: anchored
  std::vector<double> slip_, next_slip_, strain_;
  std::vector<material::BondSlip::State> old_, next_;
};

}  // namespace talus::rebar
