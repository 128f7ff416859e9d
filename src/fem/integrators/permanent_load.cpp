#include "fem/integrators/permanent_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/memory.hpp"

namespace talus::fem {

namespace {

constexpr double balanced_enough = 1e-8;  // forces left over those that act, where it comes no nearer

struct StaticBalance {
  bool found = false;
  int passes = 0;
};

/// Newton's method with the stiffness K of the undamaged structure,
///
///   u += omega K^-1 (f - f_int(u)),     omega by Aitken's rule on the corrections [irons1969]
///
/// K is no softer than the tangent, so that the iteration converges where the balance is stable. `left(r)`:
/// writes f - f_int(u) [N] and returns its norm over that of f; `solve(r, d)`: d = K^-1 r; `move(d)`: u += d
/// [m]. Vectors of `n` free degrees of freedom.
template <class Left, class Solve, class Move>
StaticBalance find_balance(int n, Left&& left, Solve&& solve, Move&& move) {
  constexpr double exact = 1e-12;                  // forces left over those that act
  constexpr int most_passes = 400, patience = 30;  // the latter: passes that do not halve what is left
  VecX force(n), way(n), last(n);
  double omega = 1, least = std::numeric_limits<double>::infinity();
  int fruitless = 0;
  for (int pass = 0; pass < most_passes; ++pass) {
    const double residual = left(force);
    fruitless = residual < 0.5 * least ? 0 : fruitless + 1;
    if (fruitless == 0) least = residual;
    if (residual <= exact || (fruitless > patience && residual <= balanced_enough)) return {true, pass};
    if (fruitless > patience && least > balanced_enough) return {false, pass};
    solve(force, way);
    if (pass > 0) {
      const VecX change = way - last;
      if (const double size = change.squaredNorm(); size > 0)
        omega = std::clamp(-omega * last.dot(change) / size, 0.5, 20.0);
    }
    last = way;
    move(omega * way);
  }
  return {false, most_passes};
}

}  // namespace

/// Numbers of a nodal field at the free degrees of freedom.
VecX PermanentLoad::at_free(const AlignedVector& field) const {
  VecX values(body_.dofs.size);
  gather(body_.dofs, field, values);
  return values;
}

void PermanentLoad::move_by(const VecX& way) {
  for (std::size_t i = 0; i < body_.mesh.nodes.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = body_.dofs.number[i][c]; d >= 0) fields_.u[4 * i + c] += way[d];
}

/// Sums of squares over the free degrees of freedom of all ranks.
double PermanentLoad::square_of(const VecX& values) const {
  double square = 0;
  for (std::size_t i = 0; i < body_.mesh.nodes.size(); ++i)
    if (body_.own_node(static_cast<int>(i)))
      for (const int d : body_.dofs.number[i])
        if (d >= 0) square += values[d] * values[d];
  body_.sum({&square, 1});
  return square;
}

void PermanentLoad::apply() {
  give_back_memory();
  forces_.load(0);
  for (const PatchLoad& load : body_.loads) {  // gravity alone: what varies in time is dynamics
    const double factor = load.factor(0);
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) fields_.f_ext[4 * load.node[k] + c] -= factor * load.force[k][c];
  }
  VecX left = at_free(fields_.f_ext);
  // What the forces that find a balance are measured by: the weight; without gravity what the bars press
  // with, at no displacement.
  double pressed = 0;
  if (body_.gravity.isZero(0) && body_.bars) {
    body_.bars->add_forces(fields_.u.data(), 0, body_.live, fields_.f_int.data());
    body_.discretisation.condense(fields_.f_int);
    const VecX of_bars = at_free(fields_.f_int);
    left -= of_bars;
    pressed = square_of(of_bars);
  }
  const bool balanced = find_elastic(left, pressed);
  if (body_.damage) {
    loads_.stresses().warn_of_cracks();
    forces_.evaluate(0);
    if (cracked_cells() > 0 && !find_cracked(balanced, pressed)) warn();
  }
}

/// Small strain: one solution. Total Lagrangian: the same factor, until the forces balance; false: they do
/// not. `left`: forces out of balance. `pressed` [N^2].
bool PermanentLoad::find_elastic(VecX left, double pressed) {
  const bool factored = !body_.divided() && body_.dofs.size <= largest_factored_system,
             once = !body_.finite && !body_.bars;
  VecX way = VecX::Zero(body_.dofs.size);
  double residual = 0, scale = 0, last = 0;  // squared
  int iterations = 0;
  constexpr int most_passes = 40;
  for (int pass = 0; pass < most_passes; ++pass) {
    if (!factored) {
      body_.progress(pass == 0 ? "permanent load"
                               : fmt::format("permanent load, pass {} of at most {}, {:.1e} of it left",
                                             pass + 1, most_passes, std::sqrt(residual / scale)));
      iterations += body_.elastic->multigrid().solve(
          left.data(), way.data(),
          once ? 1e-12 : 1e-4);  // no closer than a pass that is not linear comes to its balance
    } else {
      body_.elastic->factor().solve(left.data(), way.data());
    }
    move_by(way);
    if (body_.partition) body_.partition->exchange(fields_.u);
    body_.discretisation.distribute(fields_.u);
    if (once) break;
    std::fill(fields_.f_int.begin(), fields_.f_int.end(), 0.0);
    body_.elements->add_internal_force(fields_.u.data(), fields_.f_int.data(), body_.finite, false);
    if (body_.bars) body_.bars->add_forces(fields_.u.data(), 0, body_.live, fields_.f_int.data());
    if (body_.bearings)
      body_.bearings->add_forces(fields_.u.data(), body_.live, fields_.f_int.data()),
          body_.bearings->accept();
    body_.discretisation.condense(fields_.f_int);
    last = residual;
    const VecX load = at_free(fields_.f_ext);
    left = load - at_free(fields_.f_int);
    residual = square_of(left), scale = pressed + square_of(load);
    if (residual <= 1e-24 * scale || (pass > 0 && residual <= 1e-18 * scale && residual > 0.25 * last))
      break;  // the latter: rounding is all that is left
  }
  if (iterations > 0)
    body_.report(fmt::format("structure {}: gravity preload by multigrid, {} iterations", body_.spec.name,
                             iterations));
  if (body_.bars) body_.bars->accept();
  forces_.moved();
  const bool balanced = !(residual > 1e-12 * scale);
  fields_.still = balanced && body_.spec.initial_velocity.isZero();
  if (!balanced)
    body_.report(fmt::format(
        "warning: under its permanent load no state at rest was found, {:.2g} of the load is left (bars that "
        "yield, a deck that slides): it moves from t = 0 by itself, and what it suffers "
        "by that is in all that the run tells, before any block arrives; see by a run without blocks how "
        "much that is, and correct section, bars, prestress or supports",
        std::sqrt(residual / scale)));
  return balanced;
}

long PermanentLoad::cracked_cells() const {
  return body_.count_of(std::count_if(body_.damage->cells().begin(), body_.damage->cells().end(),
                                      [this](int cell) { return body_.own_cell(cell); }));
}

/// Laws are evaluated from virgin concrete to u each time: what a pass overshoots leaves no crack. False, and
/// the elastic state, if there is none.
bool PermanentLoad::find_cracked(bool balanced, double pressed) {
  const AlignedVector elastic(fields_.u);
  const auto left = [&](VecX& force) {
    double size = pressed;
    for (std::size_t i = 0; i < body_.mesh.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = body_.dofs.number[i][c]; d >= 0) {
          const double weight = body_.mass[i] * body_.gravity[c];
          force[d] = weight - fields_.f_int[4 * i + c];
          size += weight * weight;
        }
    return force.norm() / std::sqrt(size);
  };
  const auto solve = [&](const VecX& force, VecX& way) {
    body_.elastic->factor().solve(force.data(), way.data());
  };
  const auto evaluate = [&] {
    forces_.moved();
    forces_.evaluate(0);
  };
  const auto move = [&](const VecX& way) {
    move_by(way);
    evaluate();
  };
  const bool affordable =
      !body_.divided() && body_.dofs.size <= largest_factored_system;  // each pass is a solution
  // Assumed lateral strains go by the accepted damage (kernels/assumed_strain.hpp): what is accepted is
  // balanced again, until that asks for nothing.
  constexpr int most_turns = 30;
  int passes = 0, turns = 0;
  for (bool found = balanced && affordable; found && turns < most_turns; ++turns) {
    const StaticBalance cracked = find_balance(body_.dofs.size, left, solve, move);
    found = cracked.found && spent_cells(body_).empty();
    passes += cracked.passes;
    if (!found) break;
    energy_.accept_laws();
    evaluate();
    VecX force(body_.dofs.size);
    if (left(force) > balanced_enough) continue;
    body_.report(
        fmt::format("structure {}: its weight takes {} cells beyond the elastic limit of the concrete; it "
                    "stands with what has cracked ({} passes)",
                    body_.spec.name, cracked_cells(), passes));
    energy_.works = StructureEnergy{};  // that was before the run
    forces_.moved();
    return true;
  }
  energy_.works = StructureEnergy{};
  fields_.u = elastic;
  evaluate();
  fields_.still = false;
  return false;
}

void PermanentLoad::warn() const {
  int worst = -1;
  double most = -1;
  for (const int cell : body_.damage->cells())
    if (const double d = std::max(body_.damage->tension(cell), body_.damage->compression(cell));
        body_.own_cell(cell) && d > most)
      most = d, worst = cell;
  const std::string place = loads_.stresses().place_of_most(most, worst);
  body_.report(fmt::format(
      "warning: under its permanent load no state at rest was found: {} cells are beyond the elastic limit "
      "of the concrete, the worst {}, and crack or yield by themselves from t = 0 on, which the run's "
      "damage, "
      "cracks, reactions and damage class include, before any block arrives; see by a run without blocks how "
      "much that is. A deck needs bars or prestress that carry it ([[structure.rebar]] part = \"deck\"), "
      "what is pressed too much less prestress or a larger section",
      cracked_cells(), place));
}

void PermanentLoad::keep() {
  u = fields_.u;
  const StructureEnergy e = energy_.total();
  energy = e.elastic + e.gravity_potential;
  forces_.evaluate(fields_.time);
  loads_.find_feet(body_.mesh);
  reaction_ = loads_.foot_reactions(0);
  for (const MemberState& m : loads_.states()) drift_.push_back(m.drift);
}

void PermanentLoad::shift_peaks(const PermanentLoad& coarser) {
  std::vector<std::array<double, 2>> drift;
  for (std::size_t k = 0; k < drift_.size(); ++k)
    drift.push_back({drift_[k][0] - coarser.drift_[k][0], drift_[k][1] - coarser.drift_[k][1]});
  loads_.find_feet(body_.mesh);  // the track is told of this mesh's
  std::vector<double> reaction;
  for (std::size_t i = 0; i < std::min(reaction_.size(), coarser.reaction_.size()); ++i)
    reaction.push_back(reaction_[i] - coarser.reaction_[i]);
  loads_.track().shift(reaction, drift);
}

}  // namespace talus::fem
