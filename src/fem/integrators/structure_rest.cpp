// The permanent load, which comes slowly: the structure is in balance with it before the run begins.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/memory.hpp"
#include "fem/linear/static_balance.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

/// Numbers of a nodal field at the free degrees of freedom.
VecX FemStructure::at_free(const AlignedVector& field) const {
  VecX values(dofs_.size);
  gather(dofs_, field, values);
  return values;
}

void FemStructure::move_by(const VecX& way) {
  for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) u_[4 * i + c] += way[d];
}

/// Sums of squares over the free degrees of freedom of all ranks.
double FemStructure::square_of(const VecX& values) const {
  double square = 0;
  for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
    if (own_node(static_cast<int>(i)))
      for (const int d : dofs_.number[i])
        if (d >= 0) square += values[d] * values[d];
  sum({&square, 1});
  return square;
}

void FemStructure::preload() {
  give_back_memory();
  external_force(0);
  for (const PatchLoad& load : loads_) {  // gravity alone: what varies in time is dynamics
    const double factor = load.factor(0);
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) f_ext_[4 * load.node[k] + c] -= factor * load.force[k][c];
  }
  VecX left = at_free(f_ext_);
  // What the forces that find a balance are measured by: the weight; without gravity what the bars press
  // with, at no displacement.
  double pressed = 0;
  if (gravity_.isZero(0) && bars_) {
    bars_->add_forces(u_.data(), 0, live_, f_int_.data());
    discretisation_.condense(f_int_);
    const VecX of_bars = at_free(f_int_);
    left -= of_bars;
    pressed = square_of(of_bars);
  }
  const bool balanced = find_elastic_rest(left, pressed);
  if (damage_) {
    warn_of_cracks();
    forces(0);
    if (cracked_cells() > 0 && !find_cracked_rest(balanced, pressed)) warn_of_no_rest();
  }
}

/// Small strain: one solution. Total Lagrangian: the same factor, until the forces balance; false: they do
/// not. `left`: forces out of balance. `pressed` [N^2].
bool FemStructure::find_elastic_rest(VecX left, double pressed) {
  const bool factored = !divided() && dofs_.size <= largest_factored_system, once = !finite_ && !bars_;
  VecX way = VecX::Zero(dofs_.size);
  double residual = 0, scale = 0, last = 0;  // squared
  int iterations = 0;
  constexpr int most_passes = 40;
  for (int pass = 0; pass < most_passes; ++pass) {
    if (!factored) {
      progress(pass == 0 ? "permanent load"
                         : fmt::format("permanent load, pass {} of at most {}, {:.1e} of it left", pass + 1,
                                       most_passes, std::sqrt(residual / scale)));
      iterations += elastic_->multigrid().solve(
          left.data(), way.data(),
          once ? 1e-12 : 1e-4);  // no closer than a pass that is not linear comes to its balance
    } else {
      elastic_->factor().solve(left.data(), way.data());
    }
    move_by(way);
    if (partition_) partition_->exchange(u_);
    discretisation_.distribute(u_);
    if (once) break;
    std::fill(f_int_.begin(), f_int_.end(), 0.0);
    operator_->add_internal_force(u_.data(), f_int_.data(), finite_, false);
    if (bars_) bars_->add_forces(u_.data(), 0, live_, f_int_.data());
    if (bearings_) bearings_->add_forces(u_.data(), live_, f_int_.data()), bearings_->accept();
    discretisation_.condense(f_int_);
    last = residual;
    const VecX load = at_free(f_ext_);
    left = load - at_free(f_int_);
    residual = square_of(left), scale = pressed + square_of(load);
    if (residual <= 1e-24 * scale || (pass > 0 && residual <= 1e-18 * scale && residual > 0.25 * last))
      break;  // the latter: rounding is all that is left
  }
  if (iterations > 0)
    report_(fmt::format("structure {}: gravity preload by multigrid, {} iterations", spec_.name, iterations));
  if (bars_) bars_->accept();
  moved();
  const bool balanced = !(residual > 1e-12 * scale);
  still_ = balanced && spec_.initial_velocity.isZero();
  if (!balanced)
    report_(fmt::format(
        "warning: under its permanent load no state at rest was found, {:.2g} of the load is left (bars that "
        "yield, a deck that slides): it moves from t = 0 by itself, and what it suffers "
        "by that is in all that the run tells, before any block arrives; see by a run without blocks how "
        "much that is, and correct section, bars, prestress or supports",
        std::sqrt(residual / scale)));
  return balanced;
}

long FemStructure::cracked_cells() const {
  return count_of(std::count_if(damage_->cells().begin(), damage_->cells().end(),
                                [this](int cell) { return own_cell(cell); }));
}

/// Laws are evaluated from virgin concrete to u each time: what a pass overshoots leaves no crack. False, and
/// the elastic state, if there is none.
bool FemStructure::find_cracked_rest(bool balanced, double pressed) {
  const AlignedVector elastic(u_);
  const auto left = [&](VecX& force) {
    double size = pressed;
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0) {
          const double weight = mass_[i] * gravity_[c];
          force[d] = weight - f_int_[4 * i + c];
          size += weight * weight;
        }
    return force.norm() / std::sqrt(size);
  };
  const auto solve = [&](const VecX& force, VecX& way) {
    elastic_->factor().solve(force.data(), way.data());
  };
  const auto evaluate = [&] {
    moved();
    forces(0);
  };
  const auto move = [&](const VecX& way) {
    move_by(way);
    evaluate();
  };
  const bool affordable = !divided() && dofs_.size <= largest_factored_system;  // each pass is a solution
  // Assumed lateral strains go by the accepted damage (kernels/assumed_strain.hpp): what is accepted is
  // balanced again, until that asks for nothing.
  constexpr int most_turns = 30;
  int passes = 0, turns = 0;
  for (bool found = balanced && affordable; found && turns < most_turns; ++turns) {
    const StaticBalance cracked = find_balance(dofs_.size, left, solve, move);
    found = cracked.found && spent_cells().empty();
    passes += cracked.passes;
    if (!found) break;
    accept_laws();
    evaluate();
    VecX force(dofs_.size);
    if (left(force) > balanced_enough) continue;
    report_(
        fmt::format("structure {}: its weight takes {} cells beyond the elastic limit of the concrete; it "
                    "stands with what has cracked ({} passes)",
                    spec_.name, cracked_cells(), passes));
    books_ = StructureEnergy{};  // that was before the run
    moved();
    return true;
  }
  books_ = StructureEnergy{};
  u_ = elastic;
  evaluate();
  still_ = false;
  return false;
}

void FemStructure::warn_of_no_rest() const {
  int worst = -1;
  double most = -1;
  for (const int cell : damage_->cells())
    if (const double d = std::max(damage_->tension(cell), damage_->compression(cell));
        own_cell(cell) && d > most)
      most = d, worst = cell;
  const std::string place = place_of_most(most, worst);
  report_(fmt::format(
      "warning: under its permanent load no state at rest was found: {} cells are beyond the elastic limit "
      "of the concrete, the worst {}, and crack or yield by themselves from t = 0 on, which the run's "
      "damage, "
      "cracks, reactions and damage class include, before any block arrives; see by a run without blocks how "
      "much that is. A deck needs bars or prestress that carry it ([[structure.rebar]] part = \"deck\"), "
      "what is pressed too much less prestress or a larger section",
      cracked_cells(), place));
}

}  // namespace talus::fem
