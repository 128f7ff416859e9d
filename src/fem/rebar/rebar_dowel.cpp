#include "fem/rebar/rebar_dowel.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "fem/materials/material_damage.hpp"

namespace talus::rebar {
namespace {

constexpr double linear_share = 0.01;  // of s_1 that the chord k spans: a tenth of V_max
constexpr double torn_after = 2.5e-3;  // slip from the splitting of the cover until it holds nothing [m]

/// Gradients of the shape functions at a reference point [1/m].
std::array<Vec3, 8> gradients(const fem::TrilinearMap& cell, const Vec3& xi) {
  std::array<Vec3, 8> g = fem::shape_gradients(xi);
  const Mat3 to_space = cell.jacobian(xi).inverse().transpose();
  for (Vec3& of : g) of = to_space * of;
  return g;
}

Vec3 reference_point(const Segment& s) {
  Vec3 xi = Vec3::Zero();
  for (std::size_t i = 0; i < 8; ++i)
    xi += 0.5 * (s.start[i] + s.end[i]) *
          Vec3(fem::corner_sign[i][0], fem::corner_sign[i][1], fem::corner_sign[i][2]);
  return xi;
}

Vec3 at_node(const double* u, int node) { return Eigen::Map<const Vec3>(u + 4L * node); }

/// Number of the pair of faces whose normal is nearest to n, in lengths of the cell along n.
int row_of(const material::CellFrame& frame, const Vec3& n, double* most = nullptr) {
  int row = 0;
  double largest = -1;
  for (int k = 0; k < 3; ++k) {
    const double along = std::abs(n.dot(Vec3(frame.dual[k][0], frame.dual[k][1], frame.dual[k][2])));
    if (along > largest * (1 + 1e-9)) largest = along, row = k;
  }
  if (most != nullptr) *most = largest;
  return row;
}

}  // namespace

Dowel::Dowel(const Parameters& p) : yield_(p.yield), full_slip_(0.1 * p.diameter) {
  const double area = 0.25 * M_PI * p.diameter * p.diameter;
  unstressed_ = std::min(1.6 * area * std::sqrt(p.f_c * p.yield), area * p.yield / std::sqrt(3.0));
  stiffness_ = unstressed_ / full_slip_ / std::sqrt(linear_share);
  for (std::size_t j = 0; j < 2; ++j)
    splitting_[j] = 1.64e6 * std::max(1e-6, p.net_width[j]) * p.diameter * std::cbrt(p.f_c / 1e6);
}

double Dowel::bar_strength(double steel_stress) const {
  const double used = steel_stress / yield_;
  return unstressed_ * std::sqrt(std::max(0.0, 1 - used * used));
}

Dowel::Result Dowel::operator()(const std::array<double, 2>& slip, double steel_stress, const State& before,
                                State& next) const {
  const State old = before;  // next may be the same object
  next = old;
  Result r;
  const double size = std::hypot(slip[0], slip[1]);
  next.largest = std::max(old.largest, size);
  const double trial = stiffness_ * std::max(0.0, size - old.gap);
  double bound = bar_strength(steel_stress) * std::sqrt(std::min(1.0, size / full_slip_));
  if (size > 0) {
    const double x = slip[0] / size / splitting_[0], y = slip[1] / size / splitting_[1];
    const double cover = 1 / std::hypot(x, y);
    if (old.split == 0 && std::min(trial, bound) > cover) next.split = size;
    const double left = next.split > 0 ? 1 - (next.largest - next.split) / torn_after : 1.0;
    bound = std::min(bound, std::max(0.0, left) * cover);
  }
  next.force = std::min(trial, bound);
  if (trial > bound) {
    next.gap = std::max(old.gap, size - next.force / stiffness_);
    r.dissipation = 0.5 * ((old.force > 0 ? old.force : next.force) + next.force) * (next.gap - old.gap);
  }
  r.energy = 0.5 * next.force * next.force / stiffness_;
  if (size > 0) r.force = {next.force * slip[0] / size, next.force * slip[1] / size};
  return r;
}

DowelField::DowelField(const EmbeddedBars& bars, std::span<const Vec3> nodes,
                       std::span<const std::array<int, 8>> hexes, double f_c, double opening,
                       std::shared_ptr<const Surroundings> around)
    : bars_(&bars),
      nodes_(nodes),
      hexes_(hexes),
      f_c_(f_c),
      opening_(opening),
      around_(std::move(around)),
      place_(bars.segments().size(), -1) {}

const HostSearch& DowelField::host() const {
  if (!host_)
    host_ = around_ ? host_search(around_->nodes, around_->hexes) : host_search(nodes_, hexes_, 1e-6);
  return host_;
}

bool DowelField::possible(std::size_t segment, double largest_strain) {
  if (place_[segment] >= 0) return false;
  if (reach_.empty()) {
    reach_.reserve(place_.size());
    for (const Segment& s : bars_->segments()) {
      double longest = 0;
      if (s.cell < 0) {
        reach_.push_back(0);
        continue;
      }
      const auto& hex = hexes_[static_cast<std::size_t>(s.cell)];
      for (const int a : hex)
        for (const int b : hex)
          longest = std::max(
              longest,
              (nodes_[static_cast<std::size_t>(a)] - nodes_[static_cast<std::size_t>(b)]).squaredNorm());
      reach_.push_back(static_cast<float>(std::sqrt(longest)));
    }
  }
  return largest_strain * static_cast<double>(reach_[segment]) >= opening_;
}

void DowelField::open(std::size_t segment, const double* u) {
  const Segment& s = bars_->segments()[segment];
  const auto& hex = hexes_[static_cast<std::size_t>(s.cell)];
  const fem::TrilinearMap cell(nodes_, hex);
  const std::array<Vec3, 8> g = gradients(cell, reference_point(s));
  Mat3 motion = Mat3::Identity();
  for (std::size_t i = 0; i < 8; ++i) motion += at_node(u, hex[i]) * g[i].transpose();
  const Mat3 strain = 0.5 * (motion.transpose() * motion - Mat3::Identity());
  const Eigen::SelfAdjointEigenSolver<Mat3> principal(strain);
  const Vec3 normal = principal.eigenvectors().col(2);
  const material::CellFrame frame = material::CellFrame::of(2 * cell.jacobian(Vec3::Zero()));
  if (!(principal.eigenvalues()[2] * frame.extent({normal.x(), normal.y(), normal.z()}) >= opening_)) return;
  if (row_of(frame, normal) != row_of(frame, bars_->along(segment).normalized())) return;
  Crossing c = crossing(segment);
  c.before = this->motion(c, u).slip;
  const auto at = std::lower_bound(crossings_.begin(), crossings_.end(), segment,
                                   [](const Crossing& x, std::size_t k) { return x.segment < k; });
  crossings_.insert(at, std::move(c));
  for (std::size_t i = 0; i < crossings_.size(); ++i) place_[crossings_[i].segment] = static_cast<int>(i);
}

DowelField::Crossing DowelField::crossing(std::size_t segment) const {
  const Segment& s = bars_->segments()[segment];
  const Bar& bar = bars_->bars()[static_cast<std::size_t>(s.bar)];
  const auto& hex = hexes_[static_cast<std::size_t>(s.cell)];
  const Vec3 along = bars_->along(segment).normalized();
  const fem::TrilinearMap cell(nodes_, hex);
  const Mat3 edges = 2 * cell.jacobian(Vec3::Zero());
  const material::CellFrame frame = material::CellFrame::of(edges);
  // The first transverse direction is that of an edge of the cell: members' faces lie along them.
  Vec3 across = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = edges.col(k).normalized(), part = edge - edge.dot(along) * along;
    if (part.norm() > across.norm() * (1 + 1e-9)) across = part;
  }
  double lengths = 0;
  row_of(frame, along, &lengths);
  const Vec3 p = across.normalized(), q = along.cross(p);
  const std::array<Vec3, 8> g = gradients(cell, reference_point(s));
  Vec3 middle = Vec3::Zero();
  for (std::size_t i = 0; i < 8; ++i)
    middle += 0.5 * (s.start[i] + s.end[i]) * nodes_[static_cast<std::size_t>(hex[i])];
  const auto width = [&](const Vec3& side) {
    return width_beside(segment, middle, along, side) + width_beside(segment, middle, along, -side) -
           bar.diameter;
  };
  Crossing c{segment, {},     Dowel({bar.diameter, bar.steel.yield, f_c_, {width(q), width(p)}}),
             {},      {p, q}, 1 / (lengths * s.length),
             {},      {}};
  for (std::size_t j = 0; j < 2; ++j)
    for (std::size_t i = 0; i < 8; ++i) c.along[j][i] = c.across[j].dot(g[i]);
  return c;
}

/// Concrete on one side of a bar, from its axis to the surface or half of the way to the next bar [m].
double DowelField::width_beside(std::size_t segment, const Vec3& middle, const Vec3& along,
                                const Vec3& side) const {
  const double diameter = bars_->bars()[static_cast<std::size_t>(bars_->segments()[segment].bar)].diameter;
  double width = concrete_reach * diameter;
  const std::size_t others = around_ ? around_->bars.size() : bars_->segments().size();
  for (std::size_t k = 0; k < others; ++k) {
    const Vec3 leg = around_ ? around_->bars[k][1] : bars_->along(k),
               from = (around_ ? around_->bars[k][0] : bars_->start(k)) - middle;
    const double run = leg.dot(along);
    if (run * run < 0.5 * leg.squaredNorm()) continue;  // nearer to across than to along
    const double share = -from.dot(along) / run;
    if (share < 0 || share > 1) continue;
    const Vec3 offset = from + share * leg;
    const double away = offset.dot(side);
    if (away > diameter && offset.squaredNorm() <= 2 * away * away) width = std::min(width, 0.5 * away);
  }
  double inside = 0.5 * diameter, outside = inside;  // its surface lies in the concrete
  while (outside < width) {
    outside = std::min(outside + 0.5 * diameter, width);
    if (!host()(middle + outside * side)) break;
    inside = outside;
  }
  for (int i = 0; i < 12 && outside > inside; ++i) {
    const double half = 0.5 * (inside + outside);
    (host()(middle + half * side) ? inside : outside) = half;
  }
  return inside;
}

DowelField::Motion DowelField::motion(const Crossing& c, const double* u) const {
  const auto& node = bars_->host_nodes(c.segment);
  Motion m{c.across, bars_->along(c.segment), {}};
  const Segment& s = bars_->segments()[c.segment];
  for (std::size_t i = 0; i < 8; ++i) {
    const Vec3 moved = at_node(u, node[i]);
    m.span += (s.end[i] - s.start[i]) * moved;
    for (std::size_t j = 0; j < 2; ++j) m.across[j] += c.along[j][i] * moved;
  }
  for (std::size_t j = 0; j < 2; ++j) m.slip[j] = c.factor * m.across[j].dot(m.span) - c.before[j];
  return m;
}

void DowelField::add(const Crossing& c, const Motion& m, const std::array<double, 2>& shear,
                     double* force) const {
  const auto& node = bars_->host_nodes(c.segment);
  const Segment& s = bars_->segments()[c.segment];
  // The segment is 1 / c of the way through the cell, and carries as much of the crossing.
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t j = 0; j < 2; ++j)
      Eigen::Map<Vec3>(force + 4L * node[i]) +=
          shear[j] * ((s.end[i] - s.start[i]) * m.across[j] + c.along[j][i] * m.span);
}

DowelField::Sums DowelField::forces(const double* u, const std::function<double(std::size_t)>& stress,
                                    const char* live, const char* counted, double* force) {
  Sums sums;
  for (Crossing& c : crossings_) {
    const int cell = bars_->segments()[c.segment].cell;
    c.next = c.old;
    if (!live[cell]) continue;
    const Motion m = motion(c, u);
    const Dowel::Result r = c.law(m.slip, stress(c.segment), c.old, c.next);
    add(c, m, r.force, force);
    if (counted != nullptr && !counted[cell]) continue;
    sums.energy += r.energy / c.factor;
    sums.dissipation += r.dissipation / c.factor;
  }
  return sums;
}

const DowelField::Crossing* DowelField::find(std::size_t segment) const {
  return place_[segment] < 0 ? nullptr : &crossings_[static_cast<std::size_t>(place_[segment])];
}

void DowelField::add_forces_of(std::size_t segment, const double* u, double stress, double* force) const {
  const Crossing* const c = find(segment);
  if (c == nullptr) return;
  const Motion m = motion(*c, u);
  Dowel::State unused;
  add(*c, m, c->law(m.slip, stress, c->old, unused).force, force);
}

double DowelField::stored(std::size_t segment) const {
  const Crossing* const c = find(segment);
  return c == nullptr ? 0 : 0.5 * c->next.force * c->next.force / c->law.stiffness() / c->factor;
}

void DowelField::accept() {
  for (Crossing& c : crossings_) c.old = c.next;
}

void DowelField::save(std::vector<double>& records, const std::function<bool(std::size_t)>& which) const {
  for (const Crossing& c : crossings_)
    if (which(c.segment))
      records.insert(records.end(), {static_cast<double>(c.segment), c.before[0], c.before[1], c.old.gap,
                                     c.old.largest, c.old.split, c.old.force});
}

void DowelField::restore(std::span<const double> records) {
  for (const Crossing& c : crossings_) place_[c.segment] = -1;
  crossings_.clear();
  for (std::size_t at = 0; at + record_width <= records.size(); at += record_width) {
    const auto segment = static_cast<std::size_t>(records[at]);
    if (segment >= place_.size()) throw NumericalFailure("the saved dowels belong to another structure");
    place_[segment] = static_cast<int>(crossings_.size());
    Crossing& c = crossings_.emplace_back(crossing(segment));
    c.before = {records[at + 1], records[at + 2]};
    c.old = c.next = {records[at + 3], records[at + 4], records[at + 5], records[at + 6]};
  }
}

}  // namespace talus::rebar
