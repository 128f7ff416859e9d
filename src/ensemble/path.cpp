#include "ensemble/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/multiples.hpp"
#include "dda/kinematics.hpp"
#include "geometry/terrain.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

/// A part of a line, from p to p + d.
struct Segment {
  static constexpr double same = 1e-9;  // places as near to each other are one [m, or of its length]
  int line = 0;
  Eigen::Vector2d p, d;
  int start = -1, end = -1;  // vertices that it shares with the segments before and after it; -1: none
  double side(const Vec3& c) const { return d.x() * (c.y() - p.y()) - d.y() * (c.x() - p.x()); }
  double slack() const { return same * (1 + d.norm()); }
  double along(const Vec3& c) const { return d.dot(c.head<2>() - p) / d.norm(); }
  bool holds(const Vec3& c) const { return along(c) >= -slack() && along(c) <= d.norm() + slack(); }
  /// The shared vertex that c lies on; -1: none.
  int vertex(const Vec3& c) const {
    return along(c) <= slack() ? start : along(c) >= d.norm() - slack() ? end : -1;
  }
};

namespace {

constexpr double piece =
    1e-3;  // longest part of a macro step with contact within which the path is one cubic [s]
constexpr double apart = 0.1;  // a block that has not touched a structure for so long hits it anew [s]

/// A block at an instant.
struct Moment {
  double time = 0;
  Vec3 c = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
  double translational = 0, rotational = 0;
};

Moment moment(const dda::Model& model, const dda::State& s, int block, double time) {
  const auto k = static_cast<std::size_t>(block);
  const dda::BlockEnergy e = dda::energy(model, s, block);
  return {time, s.c[k], s.v[k], s.w[k], e.translational, e.rotational + e.straining};
}

/// Whether the way from a to b is that of a free fall.
bool in_flight(const Moment& a, const Moment& b, const Vec3& g) {
  const double h = b.time - a.time;
  const Vec3 fall = a.c + h * a.v + 0.5 * h * h * g;
  return (b.c - fall).norm() <= 1e-9 * (1 + (b.c - a.c).norm()) &&
         (b.v - a.v - h * g).norm() <= 1e-9 * (1 + b.v.norm());
}

/// When after a, in (0, h), the free falls onwards from a and back from b come nearest to each other: the
/// time of a blow that parts two flights. Nothing where there is none.
std::optional<double> blow_time(const Moment& a, const Moment& b, const Vec3& g) {
  if (in_flight(a, b, g)) return {};
  const double h = b.time - a.time;
  // Their distance is linear in time: both fall alike.
  const Vec3 at_start = a.c - b.c + h * b.v - 0.5 * h * h * g, rate = a.v - b.v + h * g;
  constexpr double gentle = 0.01, weights = 3;  // of the speed, of what a steady force gives: drag, friction
  if (rate.norm() < std::max(gentle * a.v.norm(), weights * h * g.norm())) return {};
  const double time = -at_start.dot(rate) / rate.squaredNorm();
  return time > 0 && time < h ? std::optional(time) : std::nullopt;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Times in (a, b] at which the parabola through a changes sides, ascending.
std::vector<double> parabola_times(const Moment& a, const Moment& b, const Segment& s, const Vec3& g) {
  const double q = 0.5 * cross(s.d, g.head<2>()), l = cross(s.d, a.v.head<2>()), k = s.side(a.c),
               h = b.time - a.time;
  std::vector<double> times;
  const auto add = [&](double t) {
    if (t > 0 && t <= h) times.push_back(t);
  };
  if (std::abs(q) * h * h <= 1e-15 * (std::abs(l) * h + std::abs(k))) {
    if ((k >= 0) != (s.side(b.c) >= 0) && l != 0) times.push_back(std::clamp(-k / l, 0.0, h));
    return times;
  }
  const double root = l * l - 4 * q * k;
  if (root <= 0) return times;
  const double z = -0.5 * (l + std::copysign(std::sqrt(root), l));
  add(z / q);
  if (z != 0) add(k / z);
  std::sort(times.begin(), times.end());
  return times;
}

/// Place on the cubic through a and b, at the part s of the way.
Vec3 hermite(const Moment& a, const Moment& b, double s) {
  const double h = b.time - a.time, t = 1 - s;
  return t * t * (1 + 2 * s) * a.c + s * s * (1 + 2 * t) * b.c + h * s * t * (t * a.v - s * b.v);
}

}  // namespace

class Path::Watcher {
 public:
  Watcher(sim::Simulation& simulation, const std::vector<PlanLine>& lines, GroundHeight ground,
          const Vec3& origin, double cell, std::function<void()>& after)
      : world_(simulation.world()),
        system_(*world_.system),
        ground_(std::move(ground)),
        origin_(origin),
        cell_(cell),
        after_(after) {
    for (std::size_t l = 0; l < lines.size(); ++l)
      for (const auto& part : lines[l].parts) add_segments(static_cast<int>(l), part);
    const bool stepped =
        std::any_of(system_.environment().structures.begin(), system_.environment().structures.end(),
                    [](const coupling::StructurePart& p) { return p.stepped(); });
    made_again_ = !stepped && !world_.paper;
    if (world_.paper)
      world_.watch_paper = [this](double from, const dda::State& before) {
        see(from, before, world_.paper->time, nullptr);
      };
    else
      system_.watch([this](const coupling::SystemState& before) {
        see(before.time, before.blocks, system_.state().time, &before);
      });
    const int n = system_.model().blocks.empty() ? 0 : static_cast<int>(system_.model().blocks.size());
    for (int b = 0; b < n; ++b)
      if (moves(b)) mark(moment(system_.model(), system_.state().blocks, b, 0));
  }
  ~Watcher() {
    system_.watch({});
    world_.watch_paper = {};
  }

  std::vector<Crossing> take_crossings() {
    std::stable_sort(crossings_.begin(), crossings_.end(),
                     [](const Crossing& a, const Crossing& b) { return a.time < b.time; });
    at_vertices_.clear();
    return std::exchange(crossings_, {});
  }

  void finish(Member& m) {
    std::stable_sort(crossings_.begin(), crossings_.end(),
                     [](const Crossing& a, const Crossing& b) { return a.time < b.time; });
    m.crossings = std::move(crossings_);
    m.hits = std::move(hits_);
    for (const auto& [at, largest] : cells_)
      m.passages.push_back({at.second, at.first, largest.first, largest.second});
  }

 private:
  const dda::Model& model() const { return system_.model(); }
  bool moves(int b) const { return model().blocks[static_cast<std::size_t>(b)].ndof() > 0; }

  void see(double from, const dda::State& before, double to, const coupling::SystemState* start) {
    const dda::State& now = system_.state().blocks;
    std::vector<std::pair<double, dda::State>> between_ends;  // of all blocks, if one meets something
    for (int b = 0; b < before.size(); ++b) {
      if (!moves(b)) continue;
      const Moment p = moment(model(), before, b, from), q = moment(model(), now, b, to);
      if (p.c == q.c && p.v == q.v) continue;
      cross_lines(b, p, q, start);
      if (!(cell_ > 0)) continue;
      Moment last = p;
      if (start && !in_flight(p, q, model().gravity)) {
        if (between_ends.empty()) between_ends = read_off(from, to);
        for (const auto& [time, state] : between_ends) {
          const Moment next = moment(model(), state, b, time);
          mark_part(b, last, next);
          last = next;
        }
      }
      mark_part(b, last, q);
    }
    see_hits(from, before, to, start);
    if (after_) after_();
  }

  // Lines

  /// Of a part of a line; one that ends where it begins is closed there.
  void add_segments(int line, const std::vector<Eigen::Vector2d>& part) {
    const bool closed = part.size() > 2 && part.front() == part.back();
    const int first = vertices_, last = closed ? first : -1;
    ++vertices_;
    int before = last;
    for (std::size_t k = 0; k + 1 < part.size(); ++k) {
      const int end = k + 2 < part.size() ? vertices_++ : last;
      segments_.push_back(
          {.line = line, .p = part[k], .d = part[k + 1] - part[k], .start = before, .end = end});
      before = end;
    }
  }

  bool may_meet(const Segment& s, const Moment& p, const Moment& q) const {
    const double h = q.time - p.time,
                 reach = (std::max(p.v.norm(), q.v.norm()) + model().gravity.norm() * h) * h;
    const double u = std::clamp(s.d.dot(p.c.head<2>() - s.p) / s.d.squaredNorm(), 0.0, 1.0);
    return (s.p + u * s.d - p.c.head<2>()).norm() <= 1.1 * reach + (q.c - p.c).norm();
  }

  void cross_lines(int b, const Moment& p, const Moment& q, const coupling::SystemState* start) {
    std::vector<const Segment*> near;
    for (const Segment& s : segments_)
      if (may_meet(s, p, q)) near.push_back(&s);
    if (near.empty()) return;
    std::vector<Moment> way{p};
    if (start && made_again_ && !in_flight(p, q, model().gravity)) {
      const int n = static_cast<int>(std::ceil((q.time - p.time) / piece * (1 - 1e-9)));
      std::vector<double> times;
      for (int k = 1; k < n; ++k) times.push_back(p.time + (q.time - p.time) * k / n);
      const std::vector<dda::State> states = system_.again(*start, times);
      for (std::size_t k = 0; k < states.size(); ++k) way.push_back(moment(model(), states[k], b, times[k]));
    }
    way.push_back(q);
    for (std::size_t k = 0; k + 1 < way.size(); ++k)
      for (const Segment* s : near) cross_segment(b, way[k], way[k + 1], *s, start);
  }

  void cross_segment(int b, const Moment& p, const Moment& q, const Segment& s,
                     const coupling::SystemState* start) {
    if (in_flight(p, q, model().gravity)) {
      for (const double t : parabola_times(p, q, s, model().gravity)) {
        Moment at = p;
        at.time += t;
        at.c += t * p.v + 0.5 * t * t * model().gravity;
        at.v += t * model().gravity;
        if (!s.holds(at.c)) continue;
        at.translational = 0.5 * model().blocks[static_cast<std::size_t>(b)].mass * at.v.squaredNorm();
        at.rotational = p.rotational;  // no couple acts in flight
        at.w = spin_at(b, p, q, at.time, start);
        add(b, s, at);
      }
      return;
    }
    if ((s.side(p.c) >= 0) == (s.side(q.c) >= 0)) return;
    double low = 0, high = 1;
    const bool from = s.side(p.c) >= 0;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      ((s.side(hermite(p, q, middle)) >= 0) == from ? low : high) = middle;
    }
    const double part = 0.5 * (low + high);
    Moment at = between(p, q, part);
    if (start && made_again_) {
      const double time = at.time;
      if (const std::vector<dda::State> states = system_.again(*start, {&time, 1}); !states.empty()) {
        Moment exact = moment(model(), states.front(), b, time);
        // The cubic is not quite the path: the rest of the way to the line at the speed there.
        const double speed = cross(s.d, exact.v.head<2>()),
                     rest = speed != 0 ? -s.side(exact.c) / speed : std::numeric_limits<double>::infinity();
        if (std::abs(rest) <= q.time - p.time) {
          exact.time += rest;
          exact.c += rest * exact.v;
          at = exact;
        }
      }
    }
    if (s.holds(at.c)) add(b, s, at);
  }

  /// In flight the spin of all but balls changes: that of the motion made again, of a chord where it cannot
  /// be.
  Vec3 spin_at(int b, const Moment& p, const Moment& q, double time, const coupling::SystemState* start) {
    if (p.w == q.w) return p.w;
    if (start && made_again_)
      if (const std::vector<dda::State> states = system_.again(*start, {&time, 1}); !states.empty())
        return states.front().w[static_cast<std::size_t>(b)];
    return p.w + (time - p.time) / (q.time - p.time) * (q.w - p.w);
  }

  static Moment between(const Moment& p, const Moment& q, double s) {
    Moment at;
    at.time = p.time + s * (q.time - p.time);
    at.c = hermite(p, q, s);
    at.v = p.v + s * (q.v - p.v);
    at.w = p.w + s * (q.w - p.w);
    at.translational = p.translational + s * (q.translational - p.translational);
    at.rotational = p.rotational + s * (q.rotational - p.rotational);
    return at;
  }

  /// Through a vertex both segments are crossed, whatever the last digits of its place say: one crossing if
  /// both are the same way, none if the line is touched there and left on the side it was come from.
  bool counted_at_vertex(int b, const Segment& s, const Moment& at) {
    const int vertex = s.vertex(at.c);
    if (vertex < 0) return false;
    const bool leftwards = cross(s.d, at.v.head<2>()) > 0;
    const double moment = 4 * s.slack() / std::max(at.v.head<2>().norm(), 1e-300);
    const auto same = std::find_if(at_vertices_.begin(), at_vertices_.end(), [&](const AtVertex& other) {
      return other.vertex == vertex && other.block == b && std::abs(other.time - at.time) <= moment;
    });
    if (same == at_vertices_.end()) {
      at_vertices_.push_back({vertex, b, at.time, leftwards});
      return false;
    }
    if (same->leftwards != leftwards)
      std::erase_if(crossings_, [&](const Crossing& c) {
        return c.line == s.line && c.block == world_.listed(b) && c.time == same->time;
      });
    at_vertices_.erase(same);
    return true;
  }

  void add(int b, const Segment& s, const Moment& at) {
    if (counted_at_vertex(b, s, at)) return;
    crossings_.push_back({.line = s.line,
                          .block = world_.listed(b),
                          .time = at.time,
                          .position = at.c,
                          .velocity = at.v,
                          .spin = at.w,
                          .translational = at.translational,
                          .rotational = at.rotational,
                          .height = at.c.z() - ground_(at.c.x(), at.c.y())});
  }

  // Hits

  void see_hits(double from, const dda::State& before, double to, const coupling::SystemState* start) {
    for (const coupling::StructureContact& row : system_.structure_contacts()) {
      if (row.time <= from || row.time > to || row.force.isZero(0)) continue;
      auto [last, first] =
          touched_.try_emplace({row.block, row.structure}, -std::numeric_limits<double>::infinity());
      const bool anew = row.time - row.dt - last->second > apart;
      last->second = std::max(last->second, row.time);
      if (!anew) continue;
      Hit& hit = hits_.emplace_back();
      hit.structure = row.structure;
      hit.block = world_.listed(row.block);
      hit.time = std::max(from, row.time - row.dt);
      hit.point = row.point;
      const auto k = static_cast<std::size_t>(row.block);
      hit.mass = model().blocks[k].mass;
      const dda::State* state = &before;
      double at = from;
      // Just before the blow: the rest of the way is flight or goes on as it is.
      std::vector<dda::State> states;
      if (const double wanted = from + (hit.time - from) * (1 - 1e-6);
          start && made_again_ && wanted > from) {
        states = system_.again(*start, {&wanted, 1});
        if (!states.empty()) state = &states.front(), at = wanted;
      }
      hit.centre = state->c[k];
      hit.velocity = state->v[k] + (hit.time - at) * model().gravity;
      hit.spin = state->w[k];
      hit.orientation = {state->q[k].w(), state->q[k].x(), state->q[k].y(), state->q[k].z()};
    }
  }

  // Maps

  void mark(const Moment& m) {
    if (!(cell_ > 0)) return;
    const auto i = static_cast<std::int32_t>(std::floor((m.c.x() + origin_.x()) / cell_)),
               j = static_cast<std::int32_t>(std::floor((m.c.y() + origin_.y()) / cell_));
    const double height = m.c.z() - ground_(m.c.x(), m.c.y());
    if (!std::isfinite(height)) return;  // what has left the model falls beside the map
    auto [at, first] = cells_.try_emplace({j, i}, 0.0f, std::numeric_limits<float>::lowest());
    at->second.first = std::max(at->second.first, static_cast<float>(m.translational + m.rotational));
    at->second.second = std::max(at->second.second, static_cast<float>(height));
  }

  /// What the macro step at hand was read off at, between its ends.
  std::vector<std::pair<double, dda::State>> read_off(double from, double to) const {
    std::vector<std::pair<double, dda::State>> states;
    const Multiples times(map_interval);
    for (long k = times.after(from); times.at(k) < to; ++k)
      states.emplace_back(times.at(k), system_.at(times.at(k)).blocks);
    return states;
  }

  /// The moment a time later, or earlier, in free fall.
  Moment flown(int b, const Moment& from, double time) const {
    Moment at = from;
    at.time += time;
    at.c += time * from.v + 0.5 * time * time * model().gravity;
    at.v += time * model().gravity;
    at.translational +=
        0.5 * model().blocks[static_cast<std::size_t>(b)].mass * (at.v.squaredNorm() - from.v.squaredNorm());
    return at;
  }

  /// A part with one blow at most: a flight before it, and one behind.
  void mark_part(int b, const Moment& p, const Moment& q) {
    if (const std::optional<double> blow = blow_time(p, q, model().gravity)) {
      mark_way(p, flown(b, p, *blow));
      mark_way(flown(b, q, *blow - (q.time - p.time)), q);
    } else {
      mark_way(p, q);
    }
  }

  /// Of points of the way no farther apart than half a cell, and on both sides of every border between cells.
  void mark_way(const Moment& p, const Moment& q) {
    const int n = std::max(1, static_cast<int>(std::ceil((q.c - p.c).head<2>().norm() / (0.5 * cell_))));
    Moment last = p;
    for (int k = 1; k <= n; ++k) {
      const Moment next = k == n ? q : between(p, q, static_cast<double>(k) / n);
      for (int axis = 0; axis < 2; ++axis) {
        const double a = (last.c[axis] + origin_[axis]) / cell_, b = (next.c[axis] + origin_[axis]) / cell_;
        if (std::floor(a) == std::floor(b)) continue;
        const double border = std::max(std::floor(a), std::floor(b));
        constexpr double beside = 1e-6;  // of the part, within float accuracy of the energy there
        const double s = (border - a) / (b - a);
        mark(between(last, next, std::max(0.0, s - beside)));
        mark(between(last, next, std::min(1.0, s + beside)));
      }
      mark(next);
      last = next;
    }
  }

  sim::World& world_;
  coupling::CoupledSystem& system_;
  GroundHeight ground_;
  Vec3 origin_;
  double cell_;
  std::function<void()>& after_;
  std::vector<Segment> segments_;
  int vertices_ = 0;         // of them, numbered from 0
  bool made_again_ = false;  // macro steps can be
  std::vector<Crossing> crossings_;
  struct AtVertex {
    int vertex = -1, block = 0;
    double time = 0;
    bool leftwards = false;
  };
  std::vector<AtVertex> at_vertices_;  // crossings of one of the two segments there
  std::vector<Hit> hits_;
  std::map<std::pair<int, int>, double> touched_;  // block, structure: until when
  std::map<std::pair<std::int32_t, std::int32_t>, std::pair<float, float>> cells_;  // north, east
};

std::vector<PlanLine> plan_lines(const scene::Scene& scene, std::string& crs) {
  std::vector<PlanLine> lines;
  for (const scene::Line& line : scene.lines) {
    PlanLine& plan = lines.emplace_back(PlanLine{line.name, line.parts, !line.file.empty(), {}});
    if (line.file.empty()) continue;
    const geometry::PlanLines read_lines =
        geometry::read_plan_lines(line.file, "line." + line.name + ".file");
    geometry::agree_on_crs(crs, read_lines.crs, read_lines.lines.front().front(), line.file,
                           "line." + line.name + ".file");
    plan.warnings = read_lines.warnings;
    const Vec3 origin = scene.site ? scene.site->origin : Vec3::Zero();
    for (auto part : read_lines.lines) {
      for (Eigen::Vector2d& p : part) p -= origin.head<2>();
      plan.parts.push_back(std::move(part));
    }
  }
  return lines;
}

namespace {

/// Length of a segment, and of what of it has no ground below [m]; the ends of the latter are found by
/// bisection.
struct Off {
  double length = 0, off = 0;
};
Off off_ground(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const GroundHeight& height) {
  const auto over = [&](double s) {
    const Eigen::Vector2d p = a + s * (b - a);
    return std::isfinite(height(p.x(), p.y()));
  };
  constexpr int pieces = 16, halvings = 20;
  double off = 0;
  for (int q = 0; q < pieces; ++q) {
    const double from = static_cast<double>(q) / pieces, to = static_cast<double>(q + 1) / pieces;
    const bool begins = over(from), ends = over(to);
    double on_side = begins ? from : to, off_side = begins ? to : from;
    if (begins == ends) {
      if (!begins) off += to - from;
      continue;
    }
    const double beyond = off_side;
    for (int k = 0; k < halvings; ++k) {
      const double middle = 0.5 * (on_side + off_side);
      (over(middle) ? on_side : off_side) = middle;
    }
    off += std::abs(beyond - on_side);
  }
  const double length = (b - a).norm();
  return {length, off * length};
}

std::string span_text(const Eigen::AlignedBox2d& box) {
  return fmt::format("x {:.6g} to {:.6g}, y {:.6g} to {:.6g}", box.min().x(), box.max().x(), box.min().y(),
                     box.max().y());
}

/// Whether what of a segment has no ground below is the outer half of the outermost cells of the grid, at
/// both ends at most, askew across a corner at most.
bool within_cells(const GroundExtent& ground, const Eigen::AlignedBox2d& limits, double off) {
  if (off == 0) return true;
  if (ground.box.isEmpty()) return false;
  const double half = 0.5 * ground.cell * (1 + 1e-6);  // round-off of map coordinates
  const Eigen::Vector2d margin(half, half);
  return off <= 2 * std::sqrt(2.0) * half &&
         Eigen::AlignedBox2d(Eigen::Vector2d(ground.box.min().head<2>()) - margin,
                             Eigen::Vector2d(ground.box.max().head<2>()) + margin)
             .contains(limits);
}

/// What is wrong with a line that lies nowhere over the ground.
std::string remedy_off(const PlanLine& line, const GroundExtent& ground, const Eigen::AlignedBox2d& limits,
                       const Vec3& origin) {
  if (line.of_file)
    if (std::string degrees =
            geometry::remedy_for_degrees({Eigen::Vector2d(limits.min() + origin.head<2>()),
                                          Eigen::Vector2d(limits.max() + origin.head<2>())});
        !degrees.empty())
      return degrees;
  if (ground.box.isEmpty())
    return "points are scene coordinates, those of a file map coordinates: check site.origin";
  if (std::string missing = geometry::remedy_for_origin(ground.box, origin); !missing.empty())
    return missing + " in the scene, not in files";
  return fmt::format(
      "the terrain spans {} there; points are scene coordinates, those of a file map "
      "coordinates: check site.origin",
      span_text({Eigen::Vector2d(ground.box.min().head<2>()), Eigen::Vector2d(ground.box.max().head<2>())}));
}

}  // namespace

std::vector<Problem> line_problems(const std::vector<PlanLine>& lines, const GroundHeight& height,
                                   const GroundExtent& ground, const std::string& file, const Vec3& origin) {
  std::vector<Problem> problems;
  for (const PlanLine& line : lines) {
    problems.insert(problems.end(), line.warnings.begin(), line.warnings.end());
    Off sum;
    double most = 0;  // of one segment
    Eigen::AlignedBox2d limits;
    for (const auto& part : line.parts) {
      for (const Eigen::Vector2d& p : part) limits.extend(p);
      for (std::size_t k = 0; k + 1 < part.size(); ++k) {
        const Off segment = off_ground(part[k], part[k + 1], height);
        sum.length += segment.length, sum.off += segment.off;
        most = std::max(most, segment.off);
      }
    }
    const bool off = sum.off == sum.length;
    if (!off && within_cells(ground, limits, most)) continue;
    problems.push_back(
        {.severity = off ? Problem::Severity::error : Problem::Severity::warning,
         .file = file,
         .line = 0,
         .column = 0,
         .key = "line." + line.name,
         .value = span_text(limits) + " in scene coordinates",
         .rule = off ? std::string("lies off the terrain")
                     : fmt::format("{:.3g} m of its {:.4g} m lie off the terrain; nothing crosses it there "
                                   "with a height",
                                   sum.off, sum.length),
         .remedy = off ? remedy_off(line, ground, limits, origin)
                       : "shorten it to the terrain, or take a larger terrain"});
  }
  return problems;
}

Path::Path(sim::Simulation& simulation, const std::vector<PlanLine>& lines, GroundHeight ground,
           const Vec3& origin, double cell)
    : watcher_(std::make_unique<Watcher>(simulation, lines, std::move(ground), origin, cell, after)) {}
Path::~Path() = default;
std::vector<Crossing> Path::take_crossings() { return watcher_->take_crossings(); }
void Path::finish(Member& member) { watcher_->finish(member); }

}  // namespace talus::ensemble
