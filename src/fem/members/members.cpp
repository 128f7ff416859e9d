#include "fem/members/members.hpp"

#include <algorithm>
#include <cmath>

#include "core/sort_unique.hpp"
#include "fem/discretisation/viaduct.hpp"

namespace talus::fem {
namespace {

Pier whole(const StructureSpec& spec) {
  Pier p;
  p.name = spec.name;
  rebar::Member& m = p.shape;
  if (spec.kind == "column") {
    if (spec.section == "round") m.section = rebar::Member::Section::round;
    if (spec.section == "hollow") p.wall = spec.wall_thickness;
    m.width = spec.size.x(), m.depth = spec.size.y(), m.length = spec.size.z();
    m.axis_x = spec.rotation * Vec3::UnitX();
    m.axis_y = spec.rotation * Vec3::UnitY();
    m.base = spec.position;
  } else {
    int axis = 0;
    spec.size.maxCoeff(&axis);
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    m.width = spec.size[a], m.depth = spec.size[b], m.length = spec.size[axis];
    m.axis_x = spec.rotation * Vec3::Unit(a);
    m.axis_y = spec.rotation * Vec3::Unit(b);
    m.base = spec.position - spec.rotation * Vec3::Unit(axis) * (spec.size[axis] / 2);
  }
  p.clear = m.length;
  return p;
}

/// Steel of ties along a direction of the section, per length of the member: each tie over its share of the
/// length, which ends midway to its neighbours.
class Ties {
 public:
  struct Mean {
    double area = 0, yield = 0;
  };  // [m^2/m], [Pa]

  /// `e`: the direction; `height`: of the section along it.
  Ties(const Pier& pier, const std::vector<rebar::Bar>& bars, const Vec3& e, double height)
      : clear_(pier.clear) {
    std::vector<Level> legs;
    for (const rebar::Bar& bar : bars) add_legs(pier, bar, e, height, legs);
    std::sort(legs.begin(), legs.end(), [](const Level& a, const Level& b) { return a.at < b.at; });
    double from = 0;  // of the level that grows
    for (const Level& leg : legs)
      if (levels_.empty() || leg.at - from > leg.reach)
        levels_.push_back(leg), from = leg.at;
      else
        levels_.back().join(leg);
  }

  /// Mean over `window` about the section `at`, as much of it as the member has.
  Mean about(double at, double window) const {
    const double low = std::max(0.0, at - window / 2), high = std::min(clear_, at + window / 2);
    Mean mean;
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      const Level& tie = levels_[i];
      const double below = gap(i), above = gap(i + 1), share = (below + above) / 2;
      // The outermost ties stand for the length of a spacing beyond them: rules begin with half of one to a
      // whole one.
      const double from = tie.at - (i == 0 ? below : below / 2),
                   to = tie.at + (i + 1 == levels_.size() ? above : above / 2);
      const double steel =
          tie.steel / share * std::max(0.0, std::min(high, to) - std::max(low, from)) / (high - low);
      mean.area += steel, mean.yield += steel * tie.yield;
    }
    if (mean.area > 0) mean.yield /= mean.area;
    return mean;
  }

 private:
  /// Legs at one level of the member; `reach`: how far from one another they are still one tie.
  struct Level {
    double at, steel, yield, reach;
    void join(const Level& other) {
      const double sum = steel + other.steel;
      at = (at * steel + other.at * other.steel) / sum;
      yield = (yield * steel + other.yield * other.steel) / sum;
      steel = sum;
    }
  };

  /// Those of a bar that runs around the section or across it; turns of a spiral lie at levels of their own.
  static void add_legs(const Pier& pier, const rebar::Bar& bar, const Vec3& e, double height,
                       std::vector<Level>& legs) {
    const rebar::Member& m = pier.shape;
    const Vec3 z = pier.axis();
    double from = 1e300, to = -1e300;
    for (const Vec3& point : bar.points) {
      const Vec3 p = point - m.base;
      if (std::abs(p.dot(m.axis_x)) > m.width / 2 || std::abs(p.dot(m.axis_y)) > m.depth / 2) return;
      from = std::min(from, p.dot(e)), to = std::max(to, p.dot(e));
    }
    if (!(to - from > 0.3 * height)) return;
    for (std::size_t i = 1; i < bar.points.size(); ++i) {
      const Vec3 leg = bar.points[i] - bar.points[i - 1],
                 middle = (bar.points[i] + bar.points[i - 1]) / 2 - m.base;
      const double steel = bar.area() * std::abs(leg.dot(e)) / (to - from);
      if (steel > 0 && std::abs(leg.dot(z)) < 0.3 * leg.norm())
        legs.push_back({middle.dot(z), steel, bar.steel.yield, bar.diameter});
    }
  }

  /// Between the ties i - 1 and i; beyond the outermost ones as beside them.
  double gap(std::size_t i) const {
    if (levels_.size() < 2) return clear_;
    const std::size_t k = std::clamp<std::size_t>(i, 1, levels_.size() - 1);
    return levels_[k].at - levels_[k - 1].at;
  }

  double clear_;
  std::vector<Level> levels_;
};

}  // namespace

std::vector<Pier> find_piers(const StructureSpec& spec) {
  if (spec.kind == "viaduct") return viaduct_plan(spec).piers;
  if (spec.kind == "column" || spec.kind == "box") return {whole(spec)};
  return {};
}

std::vector<Pier> find_spans(const StructureSpec& spec) {
  return spec.kind == "viaduct" ? viaduct_plan(spec).spans : std::vector<Pier>{};
}

PierPlace place_of(const Pier& pier, const HexMesh& mesh, int cuts) {
  PierPlace place;
  const Vec3 x = pier.shape.axis_x, y = pier.shape.axis_y, z = pier.axis();
  const double half_x = pier.shape.width / 2 * (1 + 1e-6), half_y = pier.shape.depth / 2 * (1 + 1e-6);
  std::vector<double> height(mesh.nodes.size());
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) height[n] = (mesh.nodes[n] - pier.shape.base).dot(z);
  std::vector<std::array<double, 2>> range;
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    double low = 1e300, high = -1e300;
    for (int n : mesh.hexes[cell]) low = std::min(low, height[n]), high = std::max(high, height[n]);
    const Vec3 d = cell_centre(mesh, cell) - pier.shape.base;
    const double h = d.dot(z);
    if (std::abs(d.dot(x)) > half_x || std::abs(d.dot(y)) > half_y || h < 0 || h > pier.clear) continue;
    place.cells.push_back(cell);
    range.push_back({low, high});
  }
  const double near = 1e-6 * pier.clear;
  for (int cell : place.cells)
    for (int n : mesh.hexes[cell]) {
      if (height[n] < near) place.foot.push_back(n);
      if (height[n] > pier.clear - near) place.top.push_back(n);
    }
  sort_unique(place.foot), sort_unique(place.top);
  // Cells that hold what lies just above the plane (+1), or just below it (-1).
  const auto layer_of = [&](double plane, int side) {
    Layer layer;
    const double level = plane + side * near;
    for (std::size_t i = 0; i < place.cells.size(); ++i) {
      const auto [low, high] = range[i];
      if (!(low <= level && level < high)) continue;
      layer.cells.push_back(place.cells[i]);
      layer.part.push_back(std::clamp((high - plane) / (high - low), 0.0, 1.0));
      for (int n : mesh.hexes[place.cells[i]]) {
        layer.nodes.push_back(n);
        if (height[n] > level) layer.above.push_back(n);
      }
    }
    sort_unique(layer.nodes), sort_unique(layer.above);
    return layer;
  };
  for (int k = 0; k < cuts; ++k) {
    Cut cut;
    cut.at = pier.clear * k / (cuts - 1);
    Layer above = layer_of(cut.at, 1), below = layer_of(cut.at, -1);
    cut.nodes = above.nodes;
    cut.nodes.insert(cut.nodes.end(), below.nodes.begin(), below.nodes.end());
    sort_unique(cut.nodes);
    const bool same = above.cells == below.cells;
    if (!above.cells.empty()) cut.layers.push_back(std::move(above));
    if (!same && !below.cells.empty()) cut.layers.push_back(std::move(below));
    place.cuts.push_back(std::move(cut));
  }
  return place;
}

rebar::ShearInput shear_input(const Pier& pier, const std::vector<rebar::Bar>& bars, double at, int axis,
                              double axial) {
  const rebar::Member& m = pier.shape;
  const Vec3 e = axis == 0 ? m.axis_x : m.axis_y, z = pier.axis();
  const bool round = m.section == rebar::Member::Section::round;
  const double height = axis == 0 ? m.width : m.depth, width = axis == 0 ? m.depth : m.width;
  rebar::ShearInput in;
  in.axial = axial;
  in.gross_area = round ? M_PI / 4 * m.width * m.width : m.width * m.depth;
  if (pier.wall > 0) in.gross_area -= (m.width - 2 * pier.wall) * (m.depth - 2 * pier.wall);
  if (pier.area > 0) in.gross_area = pier.area;

  // Bars along the axis that cross the section: those on the tension side (half the section) and where they
  // lie.
  const double tensile = pier.span && axis == 1 ? -1 : 1;
  double area = 0, lever = 0, ring = 0, all = 0;
  for (const rebar::Bar& bar : bars)
    for (std::size_t i = 1; i < bar.points.size(); ++i) {
      const Vec3 p = bar.points[i - 1] - m.base, q = bar.points[i] - m.base;
      const double a = p.dot(z) - at, b = q.dot(z) - at;
      if (!((a <= 0 && b > 0) || (b <= 0 && a > 0)) || std::abs(b - a) < 0.7 * (q - p).norm()) continue;
      const Vec3 here = p + (q - p) * (a / (a - b));
      const double side = tensile * here.dot(e);
      if (std::abs(here.dot(m.axis_x)) > m.width / 2 || std::abs(here.dot(m.axis_y)) > m.depth / 2)
        continue;  // of another pier
      ring += bar.area() * (here - here.dot(z) * z).norm(), all += bar.area();
      in.axial += bar.steel.prestress * bar.area() * std::abs(b - a) / (q - p).norm();
      if (side <= 1e-9 * height) continue;
      area += bar.area(), lever += bar.area() * side;
    }
  in.tension_area = area;
  const double r = height / 2;
  if (round) {
    const double r_s = all > 0 ? ring / all : 0.9 * r;
    const double d = r + 2 * r_s / M_PI;                  // to the centroid of the tension bars
    const double c = std::clamp((d - r) / r, -1.0, 1.0);  // the segment of the circle above that depth
    in.effective_depth = d;
    in.width = r * r * (M_PI - std::acos(c) + c * std::sqrt(1 - c * c)) / d;
  } else {
    in.effective_depth = area > 0 ? r + lever / area : 0.9 * height;
    in.width = pier.web[static_cast<std::size_t>(axis)] > 0 ? pier.web[static_cast<std::size_t>(axis)]
               : pier.wall > 0                              ? 2 * pier.wall
                                                            : width;
  }

  const Ties::Mean ties = Ties(pier, bars, e, height).about(at, std::max(height, 0.5));
  in.stirrup_area_per_length =
      ties.area * (round ? M_PI / 4 : 1);  // the mean share of a hoop's tension along e
  if (ties.area > 0) in.stirrup_yield = ties.yield;
  return in;
}

}  // namespace talus::fem
