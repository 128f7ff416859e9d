/// Dowel action: the shear that a bar carries across a crack.
///
/// In the cell that the crack opens, with d the span of the bar's segment and F the gradient of the motion at
/// its middle, the slip of the crack's faces across the bar and the forces on the host's nodes are
///
///   s_j = c (F p_j) . d,   c = l / L,   counted from where the crack stands open by G_F / f_t
///   f_i = V_j (D_i F p_j + (p_j . grad N_i) d)
///
/// s_j is the angle that the bar has lost against its host, times the length of its way through the cell: a
/// crack that only opens across the bar has none. The bar bears on the concrete with the stiffness k over a
/// gap of what it has crushed, along s,
///
///   V = k <|s| - g>, at most V_u;   g = |s| - V / k where that is reached, and never less again
///   stored V^2 / (2 k), dissipated V dg
///
/// Forces are derivatives of an energy while nothing is crushed, and every cycle loses what it crushes.
/// Reversed motion meets no resistance until the gap is closed on the other side: loops are pinched
/// [vintzeleou1987]. V_u is the least of what the bar and the cover bear,
///
///   the bar     V_max sqrt(min(1, |s| / s_1)),  s_1 = 0.1 phi                                  [mc2010, 6.3]
///               V_max = min(1.6 A sqrt(f_c f_y), A f_y / sqrt(3)) sqrt(1 - (sigma / f_y)^2)
///   the cover   1.64 b_n phi f_c^(1/3) (N, mm) until it splits; from there falling in a straight line, to
///               nothing after a further slip of 2.5 mm                                       [baumann1970]
///
/// and k is that of the chord of the root up to s_1 / 100. The cover splits in the plane of the bar that is
/// normal to the push; b_n is the width of concrete in it that is the bar's: to the surface, or half of the
/// way to the next bar, on both sides, less phi. Between the two transverse directions V_u lies on an
/// ellipse. Stirrups that hold a bar once its cover has split are not seen.
///
/// The crack crosses a bar in the row of cells that it runs along: where its normal, the direction of the
/// largest principal strain, and the bar are nearest to the normal of the same pair of faces. Bars along the
/// row are sheared by its slip, but bridge nothing.
///
/// symbol   meaning                                                        unit    shape
/// p_j      unit vectors normal to the bar as placed                       -       2 x 3
/// L l      length of the segment; of a line through the cell along it     m       1
/// D_i N_i  as in rebar_embed.hpp, at the segment's middle                 -       8
/// sigma    stress of the bar                                              Pa      1
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "fem/rebar/rebar_embed.hpp"

namespace talus::rebar {

/// The law of one crossing.
class Dowel {
 public:
  struct Parameters {
    double diameter = 0, yield = 500e6;  ///< phi [m], f_y [Pa]
    double f_c = 38e6;                   ///< [Pa]
    std::array<double, 2> net_width{};   ///< b_n of a push along each of the two directions [m]
  };
  struct State {
    double gap = 0;      ///< g [m]
    double largest = 0;  ///< |s| so far [m]
    double split = 0;    ///< slip at which the cover split [m]; 0: it holds
    double force = 0;    ///< V [N]
  };
  struct Result {
    std::array<double, 2> force{};       ///< [N]
    double energy = 0, dissipation = 0;  ///< stored now; of this call [J]
  };

  explicit Dowel(const Parameters& p);
  Result operator()(const std::array<double, 2>& slip, double steel_stress, const State& old,
                    State& next) const;
  double bar_strength(double steel_stress) const;  ///< V_max [N]
  double stiffness() const { return stiffness_; }  ///< k [N/m]

 private:
  double yield_, unstressed_, full_slip_, stiffness_;
  std::array<double, 2> splitting_;
};

/// What lies about the bars of a part of a structure, as far as dowels ask for it.
struct Surroundings {
  std::vector<Vec3> nodes;  ///< of the concrete, as built
  std::vector<std::array<int, 8>> hexes;
  std::vector<std::array<Vec3, 2>> bars;  ///< of each segment its first end as placed, and d_0
};

/// The crossings of cracks and bars of a structure.
class DowelField {
 public:
  struct Sums {
    double energy = 0, dissipation = 0;
  };  ///< [J]
  /// nodes and hexes: the mesh as built; all must outlive the field. opening: of a crack that a bar bridges,
  /// G_F / f_t [m]. `around`: where bars and hexes are a part alone; null: they are the whole.
  DowelField(const EmbeddedBars& bars, std::span<const Vec3> nodes, std::span<const std::array<int, 8>> hexes,
             double f_c, double opening, std::shared_ptr<const Surroundings> around = nullptr);
  /// Concrete and other bars further from one than so many of its diameters are of no account: 31, with which
  /// the cover is stronger than any bar; other bars narrow it by half of the way, up to as far aside as away.
  static constexpr double concrete_reach = 31, bar_reach = 88;

  /// Whether a crack can cross the segment in a cell whose points strain by at most so much (Frobenius norm).
  bool possible(std::size_t segment, double largest_strain);
  /// Puts a dowel where the cell of this segment is cracked across it at displacements u.
  void open(std::size_t segment, const double* u);
  bool empty() const { return crossings_.empty(); }
  std::size_t count() const { return crossings_.size(); }

  /// Adds internal forces at displacements u of the crossings in `live` cells. stress: of a segment's steel
  /// now [Pa], infinite where it is broken. Crossings in cells not in `counted` (null: all) do not enter the
  /// sums.
  Sums forces(const double* u, const std::function<double(std::size_t)>& stress, const char* live,
              const char* counted, double* force);
  /// Adds the forces of a segment's crossing from its accepted state; nothing is kept.
  void add_forces_of(std::size_t segment, const double* u, double stress, double* force) const;
  double stored(std::size_t segment) const;  ///< by the last evaluation [J]
  void accept();

  static constexpr std::size_t record_width = 7;  // numbers of a crossing in a saved state
  void save(std::vector<double>& records, const std::function<bool(std::size_t)>& which) const;
  void restore(std::span<const double> records);  ///< ascending

 private:
  struct Crossing {
    std::size_t segment;
    std::array<double, 2> before;  // the angles' lengths when the crack opened [m]
    Dowel law;
    std::array<std::array<double, 8>, 2> along;  // p_j . grad N_i [1/m]
    std::array<Vec3, 2> across;                  // p_j
    double factor;                               // c
    Dowel::State old, next;
  };
  struct Motion {
    std::array<Vec3, 2> across;
    Vec3 span;
    std::array<double, 2> slip;
  };  // F p_j, d, c (F p_j) . d
  Motion motion(const Crossing& c, const double* u) const;
  Crossing crossing(std::size_t segment) const;
  const Crossing* find(std::size_t segment) const;
  double width_beside(std::size_t segment, const Vec3& middle, const Vec3& along, const Vec3& side) const;
  void add(const Crossing& c, const Motion& m, const std::array<double, 2>& shear, double* force) const;
  const HostSearch& host() const;

  const EmbeddedBars* bars_;
  std::span<const Vec3> nodes_;
  std::span<const std::array<int, 8>> hexes_;
  double f_c_, opening_;
  std::shared_ptr<const Surroundings> around_;
  mutable HostSearch host_;          // made when the first crack asks for it
  std::vector<float> reach_;         // of each segment's cell, the largest extent [m]
  std::vector<int> place_;           // of each segment in crossings_, -1: none
  std::vector<Crossing> crossings_;  // ascending
};

}  // namespace talus::rebar
