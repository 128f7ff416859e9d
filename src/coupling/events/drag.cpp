// Where a step meets the surface of vegetation, or ground where another grows.
//
// Within a step the drag is that at its start, which the step integrates exactly (dda/kinematics.hpp). A step
// in which a centroid comes to another drag ends there.
#include "coupling/events/drag.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "coupling/ground/ground_laws.hpp"

namespace talus::coupling {
namespace {

constexpr double looked_at = 0.25;  // of the radius: farthest between two places of a way that are looked at
constexpr double late = 1e-4;       // of the error of speed that a step may have: by a layer that it met
constexpr int most_halvings = 60;   // of a time: to its last digit

bool changes_drag(const IslandContext& in, const Body& b, const Vec3& at) {
  return vegetation_drag(in.model.blocks[static_cast<std::size_t>(b.block)], in.env, at) != b.drag;
}

}  // namespace

double drag_limit(const IslandContext& in, const Body& b) {
  const auto k = static_cast<std::size_t>(b.block);
  const double drag = vegetation_drag(in.model.blocks[k], in.env, in.state.c[k]),
               bend = drag * (in.model.gravity - drag * in.state.v[k]).norm();
  return bend > 0 ? std::cbrt(40 * in.settings.accuracy * in.scale.length / bend)
                  : std::numeric_limits<double>::infinity();
}

double first_change_of_drag(const IslandContext& in, const Body& b, double h) {
  const auto k = static_cast<std::size_t>(b.block);
  const Vec3 v0 = b.v0.head<3>(), force = dda::drag_acceleration(b.drag, h, v0, in.state.v[k]),
             beyond = in.state.c[k] - b.start.c - dda::drag_path(b.drag, h, v0, force).way;
  const auto at = [&](double s) {
    const double r = s / h;
    return Vec3(b.start.c + dda::drag_path(b.drag, s, v0, force).way + r * r * (3 - 2 * r) * beyond);
  };
  const int parts = std::max(1, static_cast<int>(std::ceil(std::max(v0.norm(), in.state.v[k].norm()) * h /
                                                           (looked_at * in.model.blocks[k].shape->radius))));
  std::vector<double> times;
  for (int i = 1; i <= parts; ++i) times.push_back(i == parts ? h : h * i / parts);
  // Where the way turns above the ground: v . n = 0.
  for (const Vec3& x : {b.start.c, in.state.c[k]})
    for (const Vec3& n : normals_below(in.env, x)) {
      const double up = v0.dot(n), down = -force.dot(n);
      if (!(up * down > 0)) continue;
      const double turn = b.drag > 0 ? std::log1p(b.drag * up / down) / b.drag : up / down;
      if (turn < h) times.push_back(turn);
    }
  std::sort(times.begin(), times.end());
  double low = 0;
  for (double high : times) {
    if (!changes_drag(in, b, at(high))) {
      low = high;
      continue;
    }
    for (int i = 0; i < most_halvings && high - low > 0; ++i) {
      const double middle = 0.5 * (low + high);
      (changes_drag(in, b, at(middle)) ? high : low) = middle;
    }
    const double other = vegetation_drag(in.model.blocks[k], in.env, at(high)),
                 off = std::abs(other - b.drag) * (h - high) *
                       dda::drag_path(b.drag, high, v0, force).velocity.norm();  // error of speed at the end
    return off > late * in.settings.accuracy * std::sqrt(in.settings.accuracy) * in.scale.speed ? high : h;
  }
  return h;
}

}  // namespace talus::coupling
