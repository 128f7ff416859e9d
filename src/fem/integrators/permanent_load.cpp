#include "fem/integrators/permanent_load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/memory.hpp"

namespace talus::fem {

namespace {

constexpr double balanced_enough = 1e-9;  // forces left over those that act, where it comes no nearer

struct StaticBalance {
  bool found = false;
  int passes = 0;
};

/// Newton's method with the stiffness K of the undamaged structure as built, mixed with what the passes
/// before have shown of the tangent [anderson1965]:
///
///   d = K^-1 r,   r = f - f_int(u),     u += d - sum_j g_j (Delta u_j + Delta d_j)
///
/// with g so that |r - sum_j g_j Delta r_j| is least in the energy norm r . K^-1 r. Alone d comes no nearer
/// where cells turn (stretching is stiffer than bending by more than the square of the turn), and slowly
/// where pads lift off or slide.
///
/// `left(r)`: writes r [N] and returns its norm over that of f; `solve(r, d)`; `place()`: u at the free
/// degrees of freedom [m], `put(u)`; `product(a, b)`: over all ranks. What finds no balance is left where it
/// came nearest.
template <class Left, class Solve, class Place, class Put, class Product>
StaticBalance find_balance(Left&& left, Solve&& solve, Place&& place, Put&& put, Product&& product) {
  constexpr double exact = 1e-12;                  // forces left over those that act
  constexpr int most_passes = 400, patience = 30;  // the latter: passes that do not halve what is left
  constexpr int remembered = 8;                    // passes
  struct Pass {
    VecX force, way, moved;  // what it changed of r and d, and how far it went
  };
  std::vector<Pass> before;
  VecX u = place(), best = u, force(u.size()), way = VecX::Zero(u.size()), last_force, last_way, moved;
  double least = std::numeric_limits<double>::infinity(), nearest = least;
  int fruitless = 0, pass = 0;
  for (; pass < most_passes; ++pass) {
    const double residual = left(force);
    if (!std::isfinite(residual)) break;
    fruitless = residual < 0.5 * least ? 0 : fruitless + 1;
    if (fruitless == 0) least = residual;
    if (residual <= nearest) nearest = residual, best = u;
    if (residual <= exact || (fruitless > 0 && residual <= balanced_enough)) return {true, pass};
    if (fruitless > patience) break;
    solve(force, way);
    if (pass > 0) {
      Pass change{force - last_force, way - last_way, moved};
      if (const double size = std::sqrt(product(change.force, change.way)); size > 0) {
        for (VecX* v : {&change.force, &change.way, &change.moved}) *v /= size;
        if (before.size() == remembered) before.erase(before.begin());
        before.push_back(std::move(change));
      }
    }
    last_force = force, last_way = way;
    const auto count = static_cast<int>(before.size());
    MatX gram(count, count);
    VecX against(count);
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j <= i; ++j) gram(i, j) = gram(j, i) = product(before[i].force, before[j].way);
      against[i] = product(before[i].force, way);
    }
    moved = way;
    if (count > 0) {
      const VecX share = gram.completeOrthogonalDecomposition().solve(against);
      for (int j = 0; j < count; ++j) moved -= share[j] * (before[j].moved + before[j].way);
    }
    put(u += moved);
  }
  put(best);
  return {false, pass};
}

}  // namespace

/// Numbers of a nodal field at the free degrees of freedom.
VecX PermanentLoad::at_free(const AlignedVector& field) const {
  VecX values(body_.dofs.size);
  gather(body_.dofs, field, values);
  return values;
}

/// a . b over the free degrees of freedom of all ranks.
double PermanentLoad::product_of(const VecX& a, const VecX& b) const {
  double product = 0;
  for (int d = 0; d < body_.dofs.size; ++d)
    if (body_.own_node(body_.dofs.node(d))) product += a[d] * b[d];
  body_.sum({&product, 1});
  return product;
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
    pressed = product_of(of_bars, of_bars);
  }
  const bool balanced = find_elastic(left, pressed);
  if (body_.damage) {
    loads_.stresses().warn_of_cracks();
    forces_.evaluate(0);
    if (cracked_cells() > 0 && !find_cracked(balanced, pressed)) warn();
  }
}

/// Of elastic cells: of small strain by one solution. False: the forces do not balance. `left`: forces out of
/// balance at no displacement. `pressed` [N^2].
///
/// Bars and bearings are evaluated from their states as built each time: what a pass overshoots makes nothing
/// yield or slide. The feet of bearings follow once there is balance, which is found anew from there.
bool PermanentLoad::find_elastic(const VecX& left, double pressed) {
  const bool factored = !body_.divided() && body_.dofs.size <= largest_factored_system,
             once = !body_.finite && !body_.bars && !body_.bearings;
  int solutions = 0, iterations = 0;
  double remaining = 1;
  const auto solve = [&](const VecX& force, VecX& way) {
    if (factored) {
      body_.elastic->factor().solve(force.data(), way.data());
      return;
    }
    body_.progress(solutions++ == 0
                       ? "permanent load"
                       : fmt::format("permanent load, solution {}, {:.1e} of it left", solutions, remaining));
    iterations += body_.elastic->multigrid().solve(
        force.data(), way.data(),
        once ? 1e-12 : 1e-4);  // no closer than a pass that is not linear comes to its balance
  };
  const auto put = [&](const VecX& u) {
    scatter(body_.dofs, u, fields_.u);
    if (body_.partition) body_.partition->exchange(fields_.u);
    body_.discretisation.distribute(fields_.u);
  };
  const VecX load = at_free(fields_.f_ext);
  const double scale = pressed + product_of(load, load);
  const auto unbalanced = [&](VecX& force) {
    std::fill(fields_.f_int.begin(), fields_.f_int.end(), 0.0);
    body_.elements->add_internal_force(fields_.u.data(), fields_.f_int.data(), body_.finite, false);
    if (body_.bars) body_.bars->add_forces(fields_.u.data(), 0, body_.live, fields_.f_int.data());
    if (body_.bearings) body_.bearings->add_forces(fields_.u.data(), body_.live, fields_.f_int.data());
    body_.discretisation.condense(fields_.f_int);
    force = load - at_free(fields_.f_int);
    return remaining = std::sqrt(product_of(force, force) / scale);
  };
  bool balanced = true;
  if (once || scale == 0) {
    VecX u = VecX::Zero(body_.dofs.size);
    solve(left, u);
    put(u);
  } else {
    double before = 0;
    do {
      before = remaining;
      find_balance(
          unbalanced, solve, [&] { return at_free(fields_.u); }, put,
          [&](const VecX& a, const VecX& b) { return product_of(a, b); });
      VecX force(body_.dofs.size);
      if (body_.bearings) {
        unbalanced(force);  // where it came nearest
        body_.bearings->accept();
      }
      balanced = unbalanced(force) <= balanced_enough;
    } while (body_.bearings && !balanced && remaining < 0.5 * before);
  }
  if (iterations > 0)
    body_.report(fmt::format("structure {}: gravity preload by multigrid, {} iterations", body_.spec.name,
                             iterations));
  if (body_.bars) body_.bars->accept();
  forces_.moved();
  fields_.still = balanced && body_.spec.initial_velocity.isZero();
  if (!balanced)
    body_.report(fmt::format(
        "warning: under its permanent load no state at rest was found, {:.2g} of the load is left ({}): it "
        "moves from t = 0 by itself, and what it suffers by that is in all that the run tells, before any "
        "block arrives; see by a run without blocks how much that is, and correct {}section, bars, prestress "
        "or supports",
        remaining,
        body_.bearings
            ? fmt::format("bars that yield, a deck that slides on bearings whose friction is {:g}{}",
                          body_.bearings->friction(),
                          body_.bearings->friction() > 0
                              ? ""
                              : ", which has no stable rest: the further it slides, the more the cap beams "
                                "tilt under it that way")
            : "bars that yield",
        body_.bearings ? "bearing_friction, " : ""));
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
    for (int d = 0; d < body_.dofs.size; ++d) {
      const int place = body_.dofs.place[d];
      const double weight = body_.mass[place / 4] * body_.gravity[place % 4];
      force[d] = weight - fields_.f_int[place];
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
  const auto put = [&](const VecX& u) {
    scatter(body_.dofs, u, fields_.u);
    evaluate();
  };
  const bool affordable =
      !body_.divided() && body_.dofs.size <= largest_factored_system;  // each pass is a solution
  // Assumed lateral strains go by the accepted damage (kernels/assumed_strain.hpp): what is accepted is
  // balanced again, until that asks for nothing.
  constexpr int most_turns = 30;
  int passes = 0, turns = 0;
  for (bool found = balanced && affordable; found && turns < most_turns; ++turns) {
    const StaticBalance cracked = find_balance(
        left, solve, [&] { return at_free(fields_.u); }, put,
        [](const VecX& a, const VecX& b) { return a.dot(b); });
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
