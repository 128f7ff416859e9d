/// Bars embedded in hexahedra: polylines cut by the cells, strain from the host's shape functions, perfect
/// bond.
///
///   a, b     ends of a segment in its host cell;  D_i = N_i(b) - N_i(a)
///   d = d_0 + sum_i D_i u_i,  l = |d|,  eps = (l - L) / L,  sigma by the steel law
///   f_i = A sigma (d / l) D_i       internal force (resists motion): the gradient of A L psi(eps) with
///                                   respect to u_i
///
/// symbol   meaning                                                        unit    shape
/// u_i      displacements of the host's nodes, VTK order                   m       8 x 3
/// d_0      from end to end as placed                                      m       3
/// xi       reference coordinates in [-1, 1]^3                             -       3
/// L A      initial length and area of the segment                         m, m^2  1
///
/// Nodal vectors have four components per node, the fourth is zero: a node is one vector of the processor.
///
/// A bar replaces no concrete: its area is extra stiffness (E_s - E_c is not subtracted), as usual for
/// embedded trusses.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/types.hpp"
#include "fem/discretisation/trilinear.hpp"
#include "fem/rebar/rebar_geometry.hpp"

namespace talus::rebar {

struct HostPoint {
  int cell = -1;
  Vec3 xi = Vec3::Zero();
};
/// Maps a point (world, reference configuration) to its cell, or nothing if it is outside. On shared faces
/// any of the cells.
using HostSearch = std::function<std::optional<HostPoint>(const Vec3&)>;

/// Search over a mesh given as arrays; they must outlive the function. `tolerance`: how far outside, relative
/// to the cell, still counts as inside.
HostSearch host_search(std::span<const Vec3> nodes, std::span<const std::array<int, 8>> hexes,
                       double tolerance = 1e-6);

struct Segment {
  int bar = 0;                           ///< index into the bars
  int cell = 0;                          ///< -1: on another process, from which its strain is heard
  std::array<double, 8> start{}, end{};  ///< shape functions at both ends
  double length = 0, area = 0;           ///< L, A
  double arc = 0;                        ///< distance of its start from the start of the bar [m]
};

/// Cuts every leg of every bar where it passes from cell to cell (to 1e-9 of the leg). Throws InputError that
/// names each bar with a part outside all cells, and where.
std::vector<Segment> embed(const std::vector<Bar>& bars, const HostSearch& host,
                           const std::string& key = "structure.rebar");

/// Throws InputError that names each bar of which a part of the surface, in the middle of one of the segments
/// (as of embed()) and further than a diameter from the ends, lies outside the concrete: bars thicker than
/// their cover, or than their member.
void check_surfaces(const std::vector<Bar>& bars, const std::vector<Segment>& segments,
                    const HostSearch& host, const std::string& key = "structure.rebar");

/// All segments with their laws and states.
class EmbeddedBars {
 public:
  struct Sums {
    double energy = 0, dissipation = 0;  ///< stored now; of this call [J]
    int breaking = 0;                    ///< broken in this call
  };
  EmbeddedBars() = default;
  EmbeddedBars(std::vector<Bar> bars, std::vector<Segment> segments, std::span<const Vec3> reference,
               std::span<const std::array<int, 8>> hexes);

  /// Adds internal forces at displacement u; h: time since the last call [s], 0 for no rate effect. Segments
  /// that leave the elastic range are appended to `changed`, in ascending order, and only their `next` is
  /// written; `next` may be `old`. Only the segments `which` (null: all) carry something, the states of
  /// others are left alone; those in cells not in `counted` (null: all) carry force, but do not enter the
  /// sums. `slip_strain` (empty: perfect bond) is added to the strain of the host; strains in and out are the
  /// bar's own. `host_strain`: of segments on other processes, NaN: their cells are gone.
  Sums forces(const double* u, double h, std::span<const material::Steel::State> old,
              std::span<const double> old_strain, std::span<material::Steel::State> next,
              std::span<double> next_strain, std::vector<int>& changed, double* force,
              const std::vector<int>* which = nullptr, std::span<const double> slip_strain = {},
              const char* counted = nullptr, std::span<const double> host_strain = {}) const;
  /// Strain of the concrete along every segment of this process; those of others stay.
  void host_strains(const double* u, std::vector<double>& strain) const;

  /// Strain, stress and force of one segment now (force: what its end must be pulled with), its state left as
  /// it is.
  struct Pull {
    double strain = 0, stress = 0;
    Vec3 force = Vec3::Zero();
  };
  Pull pull(std::size_t segment, const double* u, const material::Steel::State& state,
            double slip_strain) const;
  /// Stress at a strain, the state left as it is; infinite once it is broken [Pa].
  double stress(std::size_t segment, const material::Steel::State& state, double strain) const;
  const material::Steel& law(int bar) const { return laws_[static_cast<std::size_t>(bar)]; }
  /// Its two ends now.
  std::pair<Vec3, Vec3> ends(std::size_t segment, const double* u) const;
  /// From end to end as placed, d_0.
  const Vec3& along(std::size_t segment) const { return along_[segment]; }
  const Vec3& start(std::size_t segment) const { return start_[segment]; }  ///< its first end as placed
  /// Adds the nodal forces of a segment so pulled.
  void add_pull(std::size_t segment, const Vec3& pull, double* force) const;

  /// These segments alone, ascending, with cells and nodes by the numbers that they have elsewhere, cells -1
  /// for none; what was found of them on the whole mesh keeps its bits.
  EmbeddedBars part(const std::vector<int>& segments, const std::function<int(int)>& cell,
                    const std::function<int(int)>& node) const;

  const std::vector<Bar>& bars() const { return bars_; }
  const std::vector<Segment>& segments() const { return segments_; }
  /// Segments hosted by the given cells, ascending.
  std::vector<int> segments_in(std::vector<int> cells) const;
  const std::array<int, 8>& host_nodes(std::size_t segment) const { return nodes_[segment]; }
  std::vector<material::Steel::State> initial_states() const {
    return std::vector<material::Steel::State>(segments_.size());
  }
  /// Mass of steel per node to add to the lumped mass [kg]; density of steel minus that of the concrete
  /// displaced.
  void add_mass(double density, std::span<double> mass) const;
  /// Axial stiffness E A / L of each segment: bounds the critical step.
  double stiffness(std::size_t segment) const;
  std::size_t memory_consumption() const;  ///< [bytes]

 private:
  std::vector<Bar> bars_;
  std::vector<Segment> segments_;
  std::vector<std::array<int, 8>> nodes_;  // of each segment's host
  std::vector<Vec3> start_, along_;        // each segment's first end as placed, and d_0
  /// What forces need of a segment, beside each other: they are bound by memory.
  struct Compact {
    std::array<double, 4> along;  // d_0
    std::array<double, 8> delta;  // D_i
    std::array<int, 8> node;
    double length, area;
    int bar, cell;
  };
  std::vector<Compact> compact_;
  Vec3 span_now(std::size_t segment, const double* u) const;
  std::vector<material::Steel> laws_;  // of each bar
};

}  // namespace talus::rebar
