// How long a step may be for contact springs, and where it ends as one lets go.
#include "coupling/springs/spring_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "contact/tolerances.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/springs/spring_rules.hpp"
#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {
namespace {

/// Step over resolved_phase at accuracy 1e-3 that has the force as it rises; the error of it falls with its
/// square, hence with `accuracy`.
double phase_asked(double accuracy) { return std::min(0.5, std::sqrt(250 * accuracy)); }

/// Of a point of a skin [1/kg].
double inverse_mass(const Structure& structure, const SurfaceWeights& w) {
  double inverse = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
    inverse += w.weight[i] * w.weight[i] / structure.skin().node_mass(w.node[i]);
  return inverse;
}

/// Springs between structures: a node of one skin on its spring, whose own oscillation a longer step would
/// take the energy of, as long as they hold or meet with more than rattles [s].
double surface_spring_limit(const IslandContext& in, const Step& step, double ahead) {
  constexpr double resolved_phase = 0.7;
  double fastest_sq = 0, brought = 0, rattles = 0;  // twice the energies
  for (const Touch& t : step.touches) {
    if (t.b >= 0 || t.stiffness == 0 ||
        t.at.gap > 2 * ahead * std::max(0.0, -t.approach) + in.scale.touch_gap())
      continue;
    double inverse =
        1 / in.env.structures[static_cast<std::size_t>(t.b_structure)].structure->skin().node_mass(t.b_node);
    if (t.a.kind == Partner::Kind::structure)
      inverse += inverse_mass(*in.env.structures[static_cast<std::size_t>(t.a.index)].structure,
                              skin_weights(t, in.surface(t.a.index), t.at.point_a));
    if (!(inverse > 0)) continue;
    fastest_sq = std::max(fastest_sq, t.stiffness * inverse);
    brought += t.approach * t.approach / inverse + 2 * t.stored;
    rattles += in.gentle_speed() * in.gentle_speed() / inverse;
  }
  return brought > rattles ? resolved_phase / std::sqrt(fastest_sq) : std::numeric_limits<double>::infinity();
}

}  // namespace

bool part_resolved(const IslandContext& in, const Step& step, const Touch& t) {
  const dda::Model::Block& block = in.model.blocks[static_cast<std::size_t>(t.b)];
  Mat12 mass, inverse;
  dda::impulse_mass(in.model, in.state, t.b, !block.deformable, mass, inverse);
  const Vec12 row = point_row(block, in.state.rotation(t.b), dda::pose(in.state, t.b).F.inverse(),
                              t.at.point_a - in.state.c[static_cast<std::size_t>(t.b)], t.at.normal);
  const StructurePart& part = in.env.structures[static_cast<std::size_t>(t.a.index)];
  const double compliance =
      row.dot(inverse * row) +
      inverse_mass(*part.structure, skin_weights(t, part.index->surface(), t.at.point_a));
  return step.found_for * step.found_for * t.stiffness * compliance < 1;
}

double rise_limit(const IslandContext& in, const Step& step, double ahead) {
  double limit = in.island->surfaces.empty() ? std::numeric_limits<double>::infinity()
                                             : surface_spring_limit(in, step, ahead);
  if (step.bodies.empty()) return limit;   // structures alone
  constexpr double resolved_phase = 0.95;  // conserving() asks for 1
  constexpr double fewest = 2;             // a step that still resolves the contact's own oscillation
  struct AtSkin {
    double stiffness = 0, hard = 0, approach = 0, stored = 0,
           fastest_sq = 0;  // hard: the part of hard contacts; fastest: of a node on Hertz's spring [1/s^2]
    Vec3 force = Vec3::Zero();
  };
  std::vector<AtSkin> skin(step.bodies.size());
  double most = 0;  // twice the energy, as below
  for (const Body& b : step.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    most = std::max(most, in.model.blocks[k].mass * in.state.v[k].squaredNorm());
  }
  constexpr double least = 0.01;  // of the largest energy
  const double rattles = in.gentle_speed() * in.gentle_speed() / least;
  for (const Touch& t : step.touches) {
    if (t.b < 0 || !in.deformable_structure(t)) continue;
    AtSkin& s = skin[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)])];
    s.stored += 2 * t.stored;
    if (t.at.gap > 2 * ahead * std::max(0.0, -t.approach) + in.scale.touch_gap()) continue;
    const StructurePart& part = in.env.structures[static_cast<std::size_t>(t.a.index)];
    const double cell = part.structure->skin().young() * face_edge(part.index->surface(), t.at.face_a);
    const double k = t.stiffness > 0 ? t.stiffness * cell / (t.stiffness + cell) : cell;
    s.stiffness += k;
    if (t.stiffness == 0)
      s.hard += k;
    else if (t.normal_law.relief > 0)
      s.fastest_sq = std::max(
          s.fastest_sq,
          t.stiffness * inverse_mass(*part.structure, skin_weights(t, part.index->surface(), t.at.point_a)));
    s.approach = std::max(s.approach, -t.approach);
    s.force += t.warm;
  }
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    AtSkin& s = skin[i];
    if (s.stiffness == 0) continue;
    const double mass = in.model.blocks[static_cast<std::size_t>(step.bodies[i].block)].mass;
    const double brought = mass * s.approach * s.approach + s.force.squaredNorm() / s.stiffness;
    const bool sprung = s.stiffness > s.hard * (1 + contact::tolerances().same_stiffness);
    const double scale = std::max(
        most,
        sprung ? 0.0 : mass * rattles);  // debris that only rattles is at rest for the accuracy asked for
    const bool gentle = brought < least * scale;
    if (gentle && !sprung) continue;
    if (gentle) s.stiffness -= s.hard;
    const double energy =
        sprung ? mass * in.state.v[static_cast<std::size_t>(step.bodies[i].block)].squaredNorm() + s.stored
               : brought;
    const double part = scale > 0 ? std::min(1.0, std::sqrt(energy / scale)) : 1.0;
    const double exchanges = std::max(std::min<double>(fewest, in.settings.exchanges_per_rise),
                                      part * in.settings.exchanges_per_rise);
    limit = std::min(limit, 0.5 * M_PI * std::sqrt(mass / s.stiffness) / exchanges);
    if (s.fastest_sq > 0)
      limit = std::min(limit, resolved_phase / std::sqrt(s.fastest_sq + s.stiffness / mass));
  }
  return limit;
}

double spring_limit(const IslandContext& in, const Step& step, double h, bool time_stepped) {
  double limit = h;
  for (const Touch& t : step.touches) {
    if (t.stiffness == 0 || !t.energetic || (in.leapfrog() && in.deformable_structure(t)))
      continue;  // there the rise of the force decides
    // The trapezoidal rule lengthens half a period of frequency w and speed V by pi/w (h w)^2/12,
    // which leaves its end off by V times that. A quarter of what the accuracy allows is asked for, and 2 w =
    // sqrt(rate_sq).
    const double rate = t.swing_rate, allowed = 6 / std::numbers::pi * in.settings.accuracy * in.scale.length;
    const double resolved = std::min(phase_asked(in.settings.accuracy) * resolved_phase,
                                     std::sqrt(allowed * rate / t.swing_speed)) /
                            rate;
    if (t.at.gap < -contact::tolerances().overlap_none * in.scale.length || t.pulls() ||
        (t.at.gap <= in.scale.touch_gap() && t.approach <= 0)) {
      limit = std::min(limit, resolved);
    } else if (time_stepped && t.approach < 0) {
      limit = std::min(limit, std::max(resolved, t.at.gap / -t.approach));
    }
  }
  return limit;
}

double energy_of_no_event(const IslandContext& in, const Touch& t, double speed) {
  const double counts = std::max(std::abs(t.approach), speed);
  return 0.5 * contact::tolerances().opening_energy * in.settings.accuracy * mass_in_series(in.model, t) *
         counts * counts;
}

bool cut_at_release(const IslandContext& in, const Step& step, double& h) {
  // A spring that lets go within the step is followed to its free length, so that it gives back what it
  // stored.
  double fraction = 1;
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.mode != Mode::spring_mean || !(t.at.gap < 0) || t.pulls()) continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const double end_speed = step.problem.relative(c, step.problem.v)[0];
    const double beyond = t.at.gap + 0.5 * h * (t.approach + end_speed);
    if (!(beyond > 0)) continue;
    const double way = std::min(beyond, -t.at.gap);  // by which it pulls, or holds no longer what it held
    if (0.5 * mass_in_series(in.model, t) * way * way * t.rate_sq <= energy_of_no_event(in, t, t.quiet_speed))
      continue;
    fraction = std::min(fraction, -t.at.gap / (beyond - t.at.gap));
  }
  if (fraction >= 1 || h * fraction <= in.settings.min_step) return false;
  h *= fraction;
  return true;
}

}  // namespace talus::coupling
