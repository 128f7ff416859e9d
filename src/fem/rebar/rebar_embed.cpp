#include "fem/rebar/rebar_embed.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "contact/geometry/bvh_tree.hpp"
#include "core/error.hpp"
#include "core/place.hpp"
#include "fem/materials/material_simd.hpp"

namespace talus::rebar {
namespace {

/// By one course of roundings, whatever the compiler makes of it elsewhere: an undeformed bar has no strain
/// to the last bit.
double length(double x, double y, double z) { return std::sqrt(std::fma(x, x, std::fma(y, y, z * z))); }

/// The lowest cell that holds a point.
class CellSearch {
 public:
  CellSearch(std::span<const Vec3> nodes, std::span<const std::array<int, 8>> hexes, double tolerance)
      : nodes_(nodes), hexes_(hexes), tolerance_(tolerance) {
    tree_.build(static_cast<int>(hexes.size()), [this](int cell) { return box_of(cell); });
  }

  std::optional<HostPoint> operator()(const Vec3& p) const {
    std::vector<int> near;
    tree_.traverse([&](const Vec3& low, const Vec3& high) { return Box3(low, high).contains(p); },
                   [&](int cell) {
                     if (box_of(cell).contains(p)) near.push_back(cell);
                     return true;
                   });
    std::sort(near.begin(), near.end());
    std::optional<HostPoint> nearly;  // outside all cells by no more than the tolerance: the nearest cell
    double nearest = 1 + 2 * tolerance_;
    for (const int c : near) {
      std::array<Vec3, 8> x;
      for (int i = 0; i < 8; ++i) x[i] = nodes_[hexes_[c][i]];
      // From the cell's own corner: far from the origin the last digits of the coordinates are coarser than
      // the tolerance.
      const Vec3 corner_at = x[0];
      for (Vec3& node : x) node -= corner_at;
      const fem::TrilinearMap map(nodes_, hexes_[c]);
      Vec3 xi = Vec3::Zero();
      bool solved = false;
      for (int it = 0; it < 30; ++it) {
        const auto n = fem::shape_values(xi);
        Vec3 r = p - corner_at;
        for (int i = 0; i < 8; ++i) r -= n[i] * x[i];
        const Vec3 step = map.jacobian(xi).partialPivLu().solve(r);
        if (!step.allFinite()) break;
        xi += step;
        if (xi.cwiseAbs().maxCoeff() > 10) break;
        if (step.cwiseAbs().maxCoeff() < 1e-13) {
          solved = true;
          break;
        }
      }
      if (!solved) continue;
      const double reach = xi.cwiseAbs().maxCoeff();
      const HostPoint here{c, xi.cwiseMax(-1.0).cwiseMin(1.0)};
      if (reach <= 1 + 1e-11) return here;
      if (reach <= nearest * (1 - 1e-12) || (!nearly && reach <= nearest)) nearly = here, nearest = reach;
    }
    return nearly;
  }

 private:
  Box3 box_of(int cell) const {
    Box3 box;
    for (const int n : hexes_[cell]) box.extend(nodes_[n]);
    const Vec3 margin = Vec3::Constant(2 * tolerance_ * box.sizes().maxCoeff());
    return {box.min() - margin, box.max() + margin};
  }

  std::span<const Vec3> nodes_;
  std::span<const std::array<int, 8>> hexes_;
  double tolerance_;
  contact::BoxTree tree_;
};

struct Sample {
  double t;
  std::optional<HostPoint> host;
};

/// Splits [a, b] until its ends lie in one cell (cells are convex enough that what lies between does too) or
/// it is short.
void refine(const Vec3& p, const Vec3& q, const Sample& a, const Sample& b, const HostSearch& host,
            std::vector<Sample>& out) {
  const bool same = a.host && b.host && a.host->cell == b.host->cell;
  if (!same && b.t - a.t > 1e-9) {
    Sample mid{0.5 * (a.t + b.t), {}};
    mid.host = host(p + mid.t * (q - p));
    if (!mid.host) {  // outside: enough to report it, no need to find the exact edge
      out.push_back(mid);
      return;
    }
    refine(p, q, a, mid, host, out);
    out.push_back(mid);
    refine(p, q, mid, b, host, out);
  }
}

/// Bars that are not in the concrete: the first five are named, the others counted.
class Outsiders {
 public:
  explicit Outsiders(const std::string& key) : key_(key) {}
  void add(const Bar& bar, const Vec3& at, const std::string& rule, const std::string& remedy) {
    if (++count_ > named) return;
    Problem problem;
    problem.file = bar.file;
    problem.line = bar.line;
    problem.key = fmt::format("{} bar {}", key_, bar.name);
    problem.value = place_text(at);
    problem.rule = rule;
    problem.remedy = remedy;
    problems_.push_back(problem);
  }
  void done() {
    if (count_ > named) problems_.back().rule += fmt::format("; so do {} more bars", count_ - named);
    if (!problems_.empty()) throw InputError(problems_);
  }

 private:
  static constexpr std::size_t named = 5;
  std::string key_;
  std::vector<Problem> problems_;
  std::size_t count_ = 0;
};

/// A point on the surface of a bar about `centre`, on a leg along `direction`, that lies outside the
/// concrete, if one of eight around does.
std::optional<Vec3> surface_outside(const Vec3& centre, const Vec3& direction, double radius,
                                    const HostSearch& host) {
  const Vec3 a = direction.unitOrthogonal(), b = direction.normalized().cross(a);
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.25 * M_PI * i;
    const Vec3 point = centre + radius * (std::cos(angle) * a + std::sin(angle) * b);
    if (!host(point)) return point;
  }
  return {};
}

}  // namespace

HostSearch host_search(std::span<const Vec3> nodes, std::span<const std::array<int, 8>> hexes,
                       double tolerance) {
  return [search = std::make_shared<const CellSearch>(nodes, hexes, tolerance)](const Vec3& p) {
    return (*search)(p);
  };
}

std::vector<Segment> embed(const std::vector<Bar>& bars, const HostSearch& host, const std::string& key) {
  Outsiders outsiders(key);
  std::vector<Segment> segments;
  for (std::size_t index = 0; index < bars.size(); ++index) {
    const Bar& bar = bars[index];
    double arc = 0;
    std::optional<Vec3> outside;
    for (std::size_t leg = 1; leg < bar.points.size() && !outside; ++leg) {
      const Vec3 p = bar.points[leg - 1], q = bar.points[leg];
      const double length = (q - p).norm();
      std::vector<Sample> samples;
      // A leg can leave the concrete and return: sample it first at a handful of points, then bisect.
      constexpr int coarse = 16;
      for (int i = 0; i <= coarse; ++i) {
        const double t = double(i) / coarse;
        Sample s{t, host(p + t * (q - p))};
        if (i > 0) {
          const Sample previous = samples.back();
          if (previous.host && s.host) refine(p, q, previous, s, host, samples);
        }
        samples.push_back(s);
      }
      for (const Sample& s : samples)
        if (!s.host && !outside) outside = p + s.t * (q - p);
      if (outside) break;
      for (std::size_t i = 0; i < samples.size();) {
        std::size_t j = i;
        while (j + 1 < samples.size() && samples[j + 1].host->cell == samples[i].host->cell) ++j;
        const double from = samples[i].t, to = samples[j].t;
        if (to - from > 1e-8) {
          Segment s;
          s.bar = static_cast<int>(index);
          s.cell = samples[i].host->cell;
          s.start = fem::shape_values(samples[i].host->xi);
          s.end = fem::shape_values(samples[j].host->xi);
          s.length = (to - from) * length;
          s.area = bar.area();
          s.arc = arc + from * length;
          segments.push_back(s);
        }
        i = j + 1;
      }
      arc += length;
    }
    if (outside)
      outsiders.add(bar, *outside, "this point of the bar lies outside the concrete",
                    "move or shorten the bar; coordinates are those of the scene, in metres");
  }
  outsiders.done();
  return segments;
}

void check_surfaces(const std::vector<Bar>& bars, const std::vector<Segment>& segments,
                    const HostSearch& host, const std::string& key) {
  Outsiders outsiders(key);
  auto segment = segments.begin();
  for (std::size_t index = 0; index < bars.size(); ++index) {
    const Bar& bar = bars[index];
    const bool closed = (bar.points.back() - bar.points.front()).norm() < 1e-9;
    const double whole = bar.length();
    std::optional<Vec3> outside;
    std::size_t leg = 1;
    double passed = 0;  // of the bar, before the leg
    for (; segment != segments.end() && segment->bar == static_cast<int>(index); ++segment) {
      const double middle = segment->arc + 0.5 * segment->length;
      double length = (bar.points[leg] - bar.points[leg - 1]).norm();
      while (leg + 1 < bar.points.size() && middle > passed + length)
        passed += length, ++leg, length = (bar.points[leg] - bar.points[leg - 1]).norm();
      // Close to its ends a bar that is cut off askew may pass a face.
      if (outside || (!closed && std::min(middle, whole - middle) < bar.diameter)) continue;
      const Vec3 along = (bar.points[leg] - bar.points[leg - 1]) / length;
      outside =
          surface_outside(bar.points[leg - 1] + (middle - passed) * along, along, 0.5 * bar.diameter, host);
    }
    if (outside)
      outsiders.add(
          bar, *outside,
          fmt::format("the bar is {:.3g} mm thick, and this point of its surface lies outside the concrete",
                      1e3 * bar.diameter),
          "a thinner bar, or one that lies deeper in the member");
  }
  outsiders.done();
}

EmbeddedBars::EmbeddedBars(std::vector<Bar> bars, std::vector<Segment> segments,
                           std::span<const Vec3> reference, std::span<const std::array<int, 8>> hexes)
    : bars_(std::move(bars)), segments_(std::move(segments)) {
  laws_.reserve(bars_.size());
  for (const Bar& b : bars_) laws_.emplace_back(b.steel);
  nodes_.reserve(segments_.size()), start_.reserve(segments_.size()), along_.reserve(segments_.size()),
      compact_.reserve(segments_.size());
  for (Segment& s : segments_) {
    nodes_.push_back(hexes[s.cell]);
    Vec3 d = Vec3::Zero(), start = Vec3::Zero();
    Compact& c = compact_.emplace_back();
    for (int i = 0; i < 8; ++i) {
      c.delta[i] = s.end[i] - s.start[i];
      d += c.delta[i] * reference[nodes_.back()[i]];
      start += s.start[i] * reference[nodes_.back()[i]];
    }
    s.length = length(d.x(), d.y(), d.z());
    start_.push_back(start);
    along_.push_back(d);
    c.along = {d.x(), d.y(), d.z(), 0};
    c.node = nodes_.back();
    c.length = s.length, c.area = s.area, c.bar = s.bar, c.cell = s.cell;
  }
}

EmbeddedBars EmbeddedBars::part(const std::vector<int>& segments, const std::function<int(int)>& cell,
                                const std::function<int(int)>& node) const {
  EmbeddedBars part;
  part.bars_ = bars_, part.laws_ = laws_;
  const auto make_room = [&](auto&... lists) { (lists.reserve(segments.size()), ...); };
  make_room(part.segments_, part.compact_, part.nodes_, part.start_, part.along_);
  for (const int number : segments) {
    const auto k = static_cast<std::size_t>(number);
    Segment& s = part.segments_.emplace_back(segments_[k]);
    Compact& c = part.compact_.emplace_back(compact_[k]);
    c.cell = s.cell = cell(s.cell);
    for (int& n : c.node) n = s.cell < 0 ? -1 : node(n);
    part.nodes_.push_back(c.node);
    part.start_.push_back(start_[k]), part.along_.push_back(along_[k]);
  }
  return part;
}

std::size_t EmbeddedBars::memory_consumption() const {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return of(bars_) + of(segments_) + of(nodes_) + of(start_) + of(along_) + of(compact_) + of(laws_);
}

EmbeddedBars::Sums EmbeddedBars::forces(const double* u, double h,
                                        std::span<const material::Steel::State> old,
                                        std::span<const double> old_strain,
                                        std::span<material::Steel::State> next, std::span<double> next_strain,
                                        std::vector<int>& changed, double* force,
                                        const std::vector<int>* which, std::span<const double> slip_strain,
                                        const char* counted, std::span<const double> host_strain) const {
  using material::V4, material::load4, material::store4;
  Sums sums;
  for (std::size_t i = 0, count = which ? which->size() : compact_.size(); i < count; ++i) {
    const std::size_t k = which ? static_cast<std::size_t>((*which)[i]) : i;
    const Compact& s = compact_[k];
    const bool here = s.cell >= 0;
    if (!here && std::isnan(host_strain[k])) continue;
    V4 d = load4(s.along.data());
    for (int a = 0; a < 8 && here; ++a) d += s.delta[a] * load4(u + 4L * s.node[a]);
    const double l = length(d[0], d[1], d[2]), of_host = here ? (l - s.length) / s.length : host_strain[k];
    const double strain = of_host + (slip_strain.empty() ? 0.0 : slip_strain[k]);
    const double volume = s.area * s.length;
    const material::Steel& law = laws_[s.bar];
    const bool in_sums = here && (!counted || counted[s.cell]);
    double stress, energy;
    if (law.elastic(strain, old[k], stress, energy)) {
      if (in_sums) { sums.energy += volume * energy; }
    } else if (old[k].broken > 0) {
      stress = 0;
    } else {
      const auto r = law(strain, h > 0 ? (strain - old_strain[k]) / h : 0.0, old[k], next[k]);
      changed.push_back(static_cast<int>(k));
      stress = r.stress;
      sums.breaking += next[k].broken > 0;
      if (in_sums) {
        sums.energy += volume * r.energy;
        sums.dissipation += volume * r.dissipation;
      }
    }
    next_strain[k] = strain;
    if (stress == 0 || !here) continue;
    const V4 f = (s.area * stress / l) * d;
    for (int a = 0; a < 8; ++a)
      store4(force + 4L * s.node[a], load4(force + 4L * s.node[a]) + s.delta[a] * f);
  }
  return sums;
}

/// d now.
Vec3 EmbeddedBars::span_now(std::size_t k, const double* u) const {
  Vec3 d = along_[k];
  for (int i = 0; i < 8; ++i) d += compact_[k].delta[i] * Eigen::Map<const Vec3>(u + 4L * nodes_[k][i]);
  return d;
}

void EmbeddedBars::host_strains(const double* u, std::vector<double>& strain) const {
  strain.resize(segments_.size());
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    if (segments_[k].cell < 0) continue;
    const Vec3 d = span_now(k, u);
    strain[k] = (length(d.x(), d.y(), d.z()) - segments_[k].length) / segments_[k].length;
  }
}

EmbeddedBars::Pull EmbeddedBars::pull(std::size_t k, const double* u, const material::Steel::State& state,
                                      double slip_strain) const {
  const Segment& s = segments_[k];
  const Vec3 d = span_now(k, u);
  const double l = length(d.x(), d.y(), d.z());
  Pull out;
  out.strain = (l - s.length) / s.length + slip_strain;
  material::Steel::State unused;
  out.stress = laws_[s.bar](out.strain, 0, state, unused).stress;
  out.force = (s.area * out.stress / l) * d;
  return out;
}

std::pair<Vec3, Vec3> EmbeddedBars::ends(std::size_t k, const double* u) const {
  Vec3 a = start_[k];
  for (int i = 0; i < 8; ++i) a += segments_[k].start[i] * Eigen::Map<const Vec3>(u + 4L * nodes_[k][i]);
  return {a, a + span_now(k, u)};
}

void EmbeddedBars::add_pull(std::size_t k, const Vec3& pull, double* force) const {
  for (int i = 0; i < 8; ++i) Eigen::Map<Vec3>(force + 4L * nodes_[k][i]) += compact_[k].delta[i] * pull;
}

void EmbeddedBars::add_mass(double density, std::span<double> mass) const {
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    const Segment& s = segments_[k];
    if (s.cell < 0) continue;
    const double m = density * s.area * s.length;
    for (int i = 0; i < 8; ++i) mass[nodes_[k][i]] += 0.5 * m * (s.start[i] + s.end[i]);
  }
}

double EmbeddedBars::stress(std::size_t k, const material::Steel::State& state, double strain) const {
  if (state.broken > 0) return INFINITY;
  material::Steel::State unused;
  return laws_[segments_[k].bar](strain, 0, state, unused).stress;
}

std::vector<int> EmbeddedBars::segments_in(std::vector<int> cells) const {
  std::sort(cells.begin(), cells.end());
  std::vector<int> list;
  for (std::size_t k = 0; k < segments_.size(); ++k)
    if (std::binary_search(cells.begin(), cells.end(), segments_[k].cell))
      list.push_back(static_cast<int>(k));
  return list;
}

double EmbeddedBars::stiffness(std::size_t segment) const {
  const Segment& s = segments_[segment];
  return bars_[s.bar].steel.young * s.area / s.length;
}

}  // namespace talus::rebar
