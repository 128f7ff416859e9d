// Longest steps by what moves and what it stands at, and what events may cost.
#include "coupling/step/step_length.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/drag.hpp"
#include "coupling/springs/spring_limits.hpp"

namespace talus::coupling {

namespace {

constexpr double most_work = 10000;  // contacts times factorisations that events may cost per step of time
                                     // stepping, or `dearer` times what such a step costs itself

/// Time in which a rigid block can meet none of its partners: the balls around it and around blocks, by their
/// speeds and all of gravity; 0 beside terrain and structures [s].
double apart_for(const IslandContext& in, const Body& body) {
  const auto ball = [&](int block) { return in.model.blocks[static_cast<std::size_t>(block)].shape->radius; };
  const auto rigid = [&](int block) {
    return !in.model.blocks[static_cast<std::size_t>(block)].deformable &&
           in.model.blocks[static_cast<std::size_t>(block)].fixed_points.empty();
  };
  if (!rigid(body.block)) return 0;
  double time = std::numeric_limits<double>::infinity();
  for (const CandidatePair& pair : in.island->pairs) {
    const bool is_b = pair.b == body.block,
               is_a = pair.a.kind == Partner::Kind::block && pair.a.index == body.block;
    if (!is_a && !is_b) continue;
    const auto k = static_cast<std::size_t>(pair.b), of_a = static_cast<std::size_t>(pair.a.index);
    double gap = 0, closing = 0;
    if (pair.a.kind == Partner::Kind::plane) {
      const Plane& plane = in.env.planes[of_a];
      gap = plane.normal.dot(in.state.c[k] - plane.point) - ball(pair.b);
      closing = -plane.normal.dot(in.state.v[k]);
    } else if (pair.a.kind == Partner::Kind::block && rigid(pair.a.index) && rigid(pair.b)) {
      gap = (in.state.c[k] - in.state.c[of_a]).norm() - ball(pair.b) - ball(pair.a.index);
      // Drag that brakes one of them alone brings on the other.
      closing = in.vegetated ? in.state.v[k].norm() + in.state.v[of_a].norm()
                             : (in.state.v[k] - in.state.v[of_a]).norm();
    }
    if (!(gap > 0)) return 0;
    const double g = in.model.gravity.norm(),
                 root = std::sqrt(closing * closing + 2 * g * gap);  // closing t + g t^2 / 2 = gap
    if (root + closing > 0) time = std::min(time, 2 * gap / (root + closing));
  }
  return time;
}

}  // namespace

double step_limit(const IslandContext& in, const Step& step, double remaining, bool time_stepped) {
  if (in.settings.fixed_step > 0) return in.settings.fixed_step;
  if (!time_stepped) {
    double h = any_contact(in, step) && step.suggested > 0 ? step.suggested : remaining;
    // In flight the onset search follows chords: half a radian at most, of what may meet anything within the
    // step however it turns.
    for (const Body& b : step.bodies) {
      const double spin = in.state.w[static_cast<std::size_t>(b.block)].norm();
      if (spin * h > 0.5 && !in.island->pairs.empty())
        h = std::min(h, std::max(0.5 / spin, apart_for(in, b)));
      if (in.vegetated) h = std::min(h, drag_limit(in, b));
    }
    return h;
  }
  // Large islands: motion within a step stays a small part of the block size, set by accuracy; of blocks
  // smaller than most of the mass, of the size of that.
  const double size = in.scale.mass_length;
  double h = in.settings.time_step(size, in.model.gravity.norm());
  for (const Body& b : step.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    const double radius = in.model.blocks[k].shape->radius, large = std::max(radius, size);
    const double spin = in.state.w[k].norm();
    if (spin > 0) h = std::min(h, std::sqrt(in.settings.accuracy * 8) / spin * (large / radius));
    const double speed = in.state.v[k].norm();
    if (speed > 0) h = std::min(h, 5 * std::sqrt(in.settings.accuracy) * large / speed);
  }
  return h;
}

double structure_step(const IslandContext& in, Step& step, double duration, double longest) {
  double stable = std::numeric_limits<double>::infinity();
  for (int s : in.island->structures)
    stable = std::min(stable, in.env.structures[static_cast<std::size_t>(s)].structure->critical_step());
  double h = duration / std::ceil(duration / stable * (1 - contact::tolerances().time_round_off));
  longest = std::min(longest, rise_limit(in, step, h));
  bool bound = h > longest * (1 + contact::tolerances().same_instant);
  while (h > longest * (1 + contact::tolerances().same_instant)) h *= 0.5;
  if (step.suggested > 0 && h > lengthening * step.suggested) h = lengthening * step.suggested, bound = true;
  step.suggested = bound ? h : stable;
  return h;
}

double worth_of_a_step(double contacts) {
  return std::max(most_work, StepSettings::dearer * factorisations * contacts);
}

bool too_much_happens(const IslandContext& in, const Step& step, double work, double duration) {
  return in.settings.fixed_step <= 0 && costs_too_much(in, step, work, duration, false);
}

bool costs_too_much(const IslandContext& in, const Step& step, double work, double duration,
                    bool rebounds_alone) {
  // What it costs to locate every contact that will close, at the closed contacts that each of them shakes.
  const double fall = duration * duration * in.model.gravity.norm();
  double closed = 0, closing = 0;
  for (std::size_t i = 0; i < step.touches.size(); ++i) {
    const Touch& t = step.touches[i];
    if (t.at.gap <= in.scale.near_gap()) ++closed;
    const bool first = i == 0 || !(step.touches[i - 1].a == t.a && step.touches[i - 1].b == t.b);
    closing += first && t.at.gap > in.scale.near_gap() && t.at.gap + duration * t.approach < fall &&
               (!rebounds_alone || rebounds(in, t));
  }
  const double ahead = factorisations * closed * closing;
  return work + ahead > worth_of_a_step(closed) * std::ceil(duration / step_limit(in, step, duration, true));
}

}  // namespace talus::coupling
