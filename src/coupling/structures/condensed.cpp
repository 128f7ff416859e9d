// The condensed regime: structures that take long steps while blocks touch them.
//
// A structure's step is then an affine map of the contact impulses on its touched nodes, v = v_hat + W p
// (contact/structures/structure.hpp). In the contact problem it is one body of 3 m degrees of freedom with
// the dense inverse mass W. Blocks at it move by the same rules as among themselves: velocities live at the
// time of the positions, which follow the trapezoid.
#include "coupling/structures/condensed.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/springs/spring_limits.hpp"
#include "coupling/springs/spring_rules.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {
namespace {

constexpr double least_gain = 4;         // explicit steps that a condensed one costs at most
constexpr std::size_t most_faces = 400;  // touched at a time: the dense body costs the cube of their nodes

bool chosen_condensed(const IslandContext& in) {
  return std::all_of(in.island->structures.begin(), in.island->structures.end(), [&](int s) {
    return in.env.structures[static_cast<std::size_t>(s)].structure->condensed().by_choice();
  });
}

/// Normal speed of the block of a touch alone, < 0 towards its partner [m/s].
double own_approach(const IslandContext& in, const Touch& t) {
  return t.at.normal.dot(point_velocity(in.state, t.b, t.at.point_b));
}

/// Whether a block and a structure meet within h faster than a condensed step may stop.
bool meets_fast(const IslandContext& in, const Touch& t, double h) {
  return t.b >= 0 && in.deformable_structure(t) && t.approach <= -in.gentle_speed() &&
         t.at.gap + h * t.approach - 0.5 * h * h * in.model.gravity.norm() <= 0;
}

/// Faces of moving skins that the touches at hand name.
std::size_t touched_faces(const IslandContext& in, const Step& step) {
  std::vector<std::pair<int, int>> faces;
  for (const Touch& t : step.touches)
    if (t.b >= 0 && in.deformable_structure(t))
      faces.emplace_back(t.a.index, in.env.structures[static_cast<std::size_t>(t.a.index)]
                                        .index->surface()
                                        .parent_face[static_cast<std::size_t>(t.at.face_a)]);
  std::sort(faces.begin(), faces.end());
  return static_cast<std::size_t>(std::unique(faces.begin(), faces.end()) - faces.begin());
}

/// True if no block comes to a structure within the time faster than a condensed step may stop: each rests on
/// it, or stays away.
bool none_strikes(const IslandContext& in, Step& step, ContactSearch& search, double duration) {
  step.found_for = -1;
  search.find(duration);
  step.found_for = -1;  // a step reaches less far
  for (std::size_t i = 0; i < in.island->pairs.size(); ++i) {
    const Partner& a = in.island->pairs[i].a;
    if (a.kind != Partner::Kind::structure ||
        in.env.structures[static_cast<std::size_t>(a.index)].fixed_surface)
      continue;
    const std::span touches = search.of_pair(i);
    const bool rests = std::ranges::any_of(
        touches, [&](const Touch& t) { return t.persistent && own_approach(in, t) > -in.gentle_speed(); });
    if (!rests && std::ranges::any_of(touches, [&](const Touch& t) { return meets_fast(in, t, duration); }))
      return false;
  }
  return true;
}

}  // namespace

std::vector<NodeImpulse> shares_of(const Step& step, int structure) {
  std::vector<NodeImpulse> shares;
  for (const NodeShare& n : step.node_impulses)
    if (n.structure == structure) shares.push_back({n.node, n.impulse});
  return shares;
}

bool may_condense(const IslandContext& in, Step& step, ContactSearch& search, double t, double duration) {
  if (!in.island->surfaces.empty()) return false;
  // What costs least is asked first: the structure's forces, which the next step needs in any case, before a
  // search that reaches through the whole macro step.
  const bool able = std::all_of(in.island->structures.begin(), in.island->structures.end(), [&](int s) {
    return in.env.structures[static_cast<std::size_t>(s)].structure->condensed().longest_step(
               t, in.settings.accuracy, in.settings.accuracy * in.scale.length) > 0;
  });
  return able && (chosen_condensed(in) || none_strikes(in, step, search, duration));
}

bool strikes_structure(const IslandContext& in, const Step& step, double t, double h) {
  bool any = false;
  for (const Touch& touch : step.touches) {
    if (!meets_fast(in, touch, h) || own_approach(in, touch) > -in.gentle_speed()) continue;
    in.env.structures[static_cast<std::size_t>(touch.a.index)].structure->condensed().struck(t);
    any = true;
  }
  return any;
}

double condensed_length(const IslandContext& in, Step& step, ContactSearch& search, double t, double duration,
                        double remaining, double longest) {
  const bool chosen = chosen_condensed(in);
  double explicit_step = duration;
  for (int s : in.island->structures) {
    Structure& structure = *in.env.structures[static_cast<std::size_t>(s)].structure;
    double limit =
        structure.condensed().longest_step(t, in.settings.accuracy, in.settings.accuracy * in.scale.length);
    if (limit == 0) return 0;
    // Motion that stays below the accuracy has no period to keep: a squat structure's, of few stable steps,
    // least of all.
    const double omega = structure.condensed().lowest_frequency(),
                 period = std::sqrt(12 * in.settings.accuracy) / omega;
    double fastest = 0;
    for (const Vec3& v : in.surface(s).velocities) fastest = std::max(fastest, v.norm());
    if (limit >= period &&
        fastest <= contact::tolerances().gentle_height * in.settings.accuracy * in.scale.length * omega)
      limit = std::max({limit, 0.8 / omega, 4 * least_gain * structure.critical_step()});
    explicit_step = std::min(explicit_step, structure.critical_step());
    if (in.settings.fixed_step <= 0) longest = std::min(longest, limit);
  }
  if (step.suggested > 2.5 * explicit_step)
    longest = std::min(longest, step.suggested);  // shorter ones were the explicit regime's
  double h = duration;
  while (h > std::min(longest, remaining) * (1 + contact::tolerances().same_instant)) h *= 0.5;
  search.find(h);
  if (strikes_structure(in, step, t, h) || touched_faces(in, step) > most_faces) return 0;
  const auto begun = [&](double length) {
    const bool all = std::all_of(in.island->structures.begin(), in.island->structures.end(), [&](int s) {
      return in.env.structures[static_cast<std::size_t>(s)].structure->condensed().may_begin(
          t, length, in.settings.accuracy);
    });
    return all ? length : 0.0;
  };
  if (in.settings.fixed_step > 0) return begun(std::min(h, remaining));
  // At least so many exchanges while the force of a spring rises.
  estimate_spring_frequencies(in, step);
  double rate_sq = 0;
  for (const Touch& touch : step.touches)
    if (touch.stiffness > 0 && touch.energetic && in.deformable_structure(touch) &&
        touch.at.gap <= in.scale.touch_gap())
      rate_sq = std::max(rate_sq, touch.rate_sq);
  const double rise = rate_sq > 0 ? 0.5 * M_PI / std::sqrt(rate_sq) / in.settings.exchanges_per_rise : h;
  const double spring = std::max(0.5 * explicit_step, std::min(rise, spring_limit(in, step, h, true)));
  while (h > spring) h *= 0.5;
  if (!chosen && h < std::min(least_gain * explicit_step, remaining))
    return 0;  // explicit sub-steps cost less
  return begun(std::min(h, remaining));
}

void gather_condensed_surfaces(const IslandContext& in, Step& step) {
  step.condensed_surfaces.clear();
  for (int s : in.island->structures) {
    StructurePart& part = in.env.structures[static_cast<std::size_t>(s)];
    CondensedSurface skin;
    skin.structure = s;
    for (const Touch& t : step.touches) {
      if (t.b < 0 || t.a.kind != Partner::Kind::structure || t.a.index != s) continue;
      // Its face's nodes: within the step the point may move over all of them.
      const TriangleSurface& surface = part.index->surface();
      for (int v : surface.triangles[static_cast<std::size_t>(t.at.face_a)])
        for (int k = 0; k < surface.nodes[static_cast<std::size_t>(v)].count; ++k) {
          const int node = surface.nodes[static_cast<std::size_t>(v)].node[static_cast<std::size_t>(k)];
          if (std::isfinite(part.structure->skin().node_mass(node))) skin.node.push_back(node);
        }
    }
    if (skin.node.empty()) continue;
    std::sort(skin.node.begin(), skin.node.end());
    skin.node.erase(std::unique(skin.node.begin(), skin.node.end()), skin.node.end());
    skin.inverse = part.structure->condensed().compliance(skin.node);
    const auto m = static_cast<Eigen::Index>(skin.node.size());
    skin.v_hat.resize(3 * m);
    skin.v_before.resize(3 * m);
    for (Eigen::Index i = 0; i < m; ++i) {
      const int node = skin.node[static_cast<std::size_t>(i)];
      skin.v_hat.segment<3>(3 * i) = part.structure->skin().predicted_velocity(node);
      skin.v_before.segment<3>(3 * i) = part.structure->skin().node_velocity(node);
    }
    step.condensed_surfaces.push_back(std::move(skin));
  }
}

double approach_left(const IslandContext& in, const Step& step, const Touch& t, double h) {
  const bool between_blocks = !in.deformable_structure(t);
  if (between_blocks && t.at.gap <= in.scale.touch_gap() && t.approach < -in.gentle_speed())
    return t.law->restitution_at(t.approach) * t.approach;
  const double start = t.normal.dot(t.slip);
  if (between_blocks || t.at.gap >= 0) return std::max(0.0, 2 * std::max(t.at.gap, 0.0) / h + start);
  // An overlap is taken off by the recovery of a step, and by no more than a twentieth of itself.
  const double moving = in.island->blocks.empty() ? in.scale.speed : step.fastest,
               out = std::min(-0.05 * t.at.gap / h, contact::tolerances().recovery * moving);
  return std::max(-out, start - 2 * out);
}

double condensed_error(const IslandContext& in, const Step& step, double h) {
  VecX change = VecX::Zero(static_cast<Eigen::Index>(step.problem.v.size()));
  for (const Touch& t : step.touches) {
    if (t.row < 0 || !in.deformable_structure(t)) continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const Vec3 p = c.impulse - h * (t.frame.transpose() * t.warm);
    for (const contact::ContactTerm& term : step.problem.terms_of(c)) {
      const contact::ProblemBody& body = step.problem.body_of(term);
      change.segment(body.offset, body.ndof) += step.problem.jacobian(term).transpose() * p;
    }
  }
  double largest = 0;
  for (std::size_t i = 0; i < step.problem.bodies.size(); ++i) {
    const contact::ProblemBody& body = step.problem.bodies[i];
    const VecX v = Eigen::Map<const MatX>(body.mass_inverse, body.ndof, body.ndof) *
                   change.segment(body.offset, body.ndof);
    if (i < step.bodies.size())
      largest = std::max(largest, v.head<3>().norm());
    else
      largest = std::max(largest, v.cwiseAbs().maxCoeff());
  }
  return h / 12 * largest / in.scale.length;
}

void update_surface_approaches(const IslandContext& in, Step& step) {
  for (Touch& t : step.touches)
    if (t.b >= 0 && in.deformable_structure(t))
      t.approach = t.at.normal.dot(point_velocity(in.state, t.b, t.at.point_b) -
                                   partner_velocity(in.state, in.env, t));
}

bool correct_condensed(const IslandContext& in, const Step& step, double t, double h) {
  bool taken = std::none_of(step.touches.begin(), step.touches.end(),
                            [&](const Touch& touch) { return meets_fast(in, touch, h); });
  std::size_t done = taken ? 0 : in.island->structures.size();
  for (int s : in.island->structures) {
    if (!taken) break;
    Structure& structure = *in.env.structures[static_cast<std::size_t>(s)].structure;
    taken = structure.condensed().correct(t, h, shares_of(step, s));
    ++done;
  }
  if (!taken)
    for (std::size_t i = 0; i < done; ++i) {
      Structure& structure = *in.env.structures[static_cast<std::size_t>(in.island->structures[i])].structure;
      structure.condensed().undo();
      if (i + 1 == done) structure.condensed().struck(t);
    }
  return taken;
}

double surface_speed(const IslandContext& in, const Step& step) {
  double fastest = 0;
  for (const CondensedSurface& skin : step.condensed_surfaces)
    for (const int node : skin.node)
      fastest = std::max(fastest, in.env.structures[static_cast<std::size_t>(skin.structure)]
                                      .structure->skin()
                                      .node_velocity(node)
                                      .norm());
  return fastest;
}

}  // namespace talus::coupling
