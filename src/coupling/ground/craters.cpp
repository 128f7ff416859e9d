#include "coupling/ground/craters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace talus::coupling {
namespace {

using contact::Column;
using contact::Footprint;
using CraterPlane = Vec3;  // in the middle of the face, and its slopes along the axes [m, 1, 1]

/// Columns of a face below one facet of the block in one cell.
struct Patch {
  int cell, facet;
  CraterPlane depth;                                                      // of the facet
  double area = 0;                                                        // that has sunk in [m^2]
  double deepest = -std::numeric_limits<double>::infinity();              // [m]
  bool crushed = false, own = false;                                      // it has a floor; that was known
  CraterPlane floor = CraterPlane::Zero(), before = CraterPlane::Zero();  // y, now and before it was crushed
  CraterPlane over = CraterPlane::Zero();                                 // g
  double least = std::numeric_limits<double>::infinity();                 // g_0 [m]
  double yields = 0, squares = 0;                                         // numerator and denominator of a
};

/// For the value of a plane there: (1, a, b).
Vec3 at(const Footprint& part, const Vec3& x) {
  return {1, part.u.dot(x - part.centre), part.v.dot(x - part.centre)};
}

CraterPlane facet_plane(const Footprint& part, const Column& c) {
  CraterPlane plane(0, c.lift.dot(part.u), c.lift.dot(part.v));
  plane[0] = c.depth[0] - plane.dot(at(part, c.place[0]));
  return plane;
}

/// Integral over a triangle of the product of two functions that are linear over it, by their values at the
/// corners.
double product(double area, const Vec3& f, const Vec3& g) {
  return area / 12 * (f.sum() * g.sum() + f.dot(g));
}

/// Mean over a triangle of max(0, f), f linear, by its values at the corners.
double mean_above(Vec3 f) {
  std::sort(f.begin(), f.end());
  if (f[2] <= 0) return 0;
  if (f[0] >= 0) return f.mean();
  if (f[1] <= 0) return f[2] / (f[2] - f[0]) * (f[2] / (f[2] - f[1])) * f[2] / 3;
  return f.mean() - f[0] / (f[0] - f[2]) * (f[0] / (f[0] - f[1])) * f[0] / 3;
}

/// Calls use(piece) for the parts of a triangle above and below a level of its `value`, whole if that is met
/// within `tolerance`.
template <class Use>
void cut(const Column& c, const std::array<double, 3> Column::*value, double level, double tolerance,
         Use&& use) {
  const std::array<double, 3>& v = c.*value;
  const auto [least, most] = std::minmax({v[0], v[1], v[2]});
  if (!(least < level - tolerance && most > level + tolerance)) return use(c);
  std::size_t i = 0;  // the corner alone on its side
  while ((v[i] > level) == (v[(i + 1) % 3] > level) || (v[i] > level) == (v[(i + 2) % 3] > level)) ++i;
  const std::size_t k = (i + 1) % 3, l = (i + 2) % 3;
  const double tk = (level - v[i]) / (v[k] - v[i]), tl = (level - v[i]) / (v[l] - v[i]);
  const auto piece = [&](double share, const std::array<Vec3, 3>& corner) {  // corners by their weights
    Column part = c;
    part.area *= share;
    for (std::size_t q = 0; q < 3; ++q) {
      part.depth[q] = part.spring[q] = 0, part.place[q].setZero();
      for (std::size_t r = 0; r < 3; ++r) {
        const double w = corner[q][static_cast<int>(r)];
        part.depth[q] += w * c.depth[r], part.spring[q] += w * c.spring[r], part.place[q] += w * c.place[r];
      }
    }
    use(part);
  };
  const auto unit = [](std::size_t n) { return Vec3(Vec3::Unit(static_cast<int>(n))); };
  const Vec3 p = (1 - tk) * unit(i) + tk * unit(k), q = (1 - tl) * unit(i) + tl * unit(l);
  piece(tk * tl, {unit(i), p, q});
  piece(1 - tk, {p, unit(k), unit(l)});
  piece(tk * (1 - tl), {p, unit(l), q});
}

/// The craters of one face.
class Crusher {
 public:
  Crusher(std::span<Footprint> parts, double limit) : parts_(parts), limit_(limit) {
    deepest_.fill(-std::numeric_limits<double>::infinity());
    greatest_.fill(-std::numeric_limits<double>::infinity());
    for (const Footprint& part : parts_)
      for (const Column& c : part.columns) {
        Patch& p = patch_of(part, c);
        patch_.push_back(static_cast<std::size_t>(&p - patches_.data()));
        Mat3& corner = corners_.emplace_back();
        for (int k = 0; k < 3; ++k)
          corner.row(k) = at(part, c.place[static_cast<std::size_t>(k)]).transpose();
        p.deepest = std::max({p.deepest, c.depth[0], c.depth[1], c.depth[2]});
        if (c.mean() > 0) p.area += c.area;
      }
    for (const Patch& p : patches_) deepest_[cell(p)] = std::max(deepest_[cell(p)], p.deepest);
  }

  /// Floors from before; a facet that is new to its cell goes on with what its neighbour there leaves of the
  /// depth, or with what the cell's deepest columns have left. What is deeper than `comes_to` below a floor
  /// of before came so without pressing: it starts unloaded.
  void recall(std::uint64_t first, std::span<const ContactMemory> known, bool late, double comes_to) {
    for (const ContactMemory& m : known) {
      double& greatest = greatest_[static_cast<std::size_t>((m.feature - first) >> 16)];
      greatest = std::max(greatest, m.crushed);
      for (Patch& p : patches_)
        if (feature(first, p) == m.feature) p.floor = m.place, p.crushed = p.own = true;
    }
    let_lie(comes_to);
    for (Patch& p : patches_) {
      if (p.own) continue;
      const double left = deepest_[cell(p)] - greatest_[cell(p)];
      if (const Patch* n = neighbour(p))
        start(p, n->depth - n->floor);
      else if (std::isfinite(greatest_[cell(p)]))
        start(p, CraterPlane(left > comes_to ? 0.0 : left, 0, 0));
      else if (late || (!known.empty() && p.deepest > comes_to))
        start(p, CraterPlane::Zero());
    }
    for (Patch& p : patches_) {
      p.before = p.floor;
      if (p.crushed || !(p.deepest > limit_)) continue;
      start(p, CraterPlane(limit_, 0, 0));
      p.before = CraterPlane(-std::numeric_limits<double>::infinity(), 0, 0);  // as new
    }
  }

  /// Moves the floors by dy.
  void yield() {
    for (Patch& p : patches_) {
      p.over = p.depth - p.floor;
      p.over[0] -= limit_;
    }
    each_crushed([](Patch& p, double, const Vec3& g) { p.least = std::min(p.least, g.minCoeff()); });
    each_crushed([&](Patch& p, double area, const Vec3& g) {
      if (p.least >= 0 || !(g.mean() > -limit_)) return;
      const Vec3 above = g.array() - p.least;
      p.yields += product(area, g, above), p.squares += product(area, above, above);
    });
    for (Patch& p : patches_) {
      if (std::isinf(p.least)) continue;
      if (p.least >= 0)
        p.floor += p.over;
      else if (p.yields > 0)
        p.floor += p.yields / p.squares * (p.over - CraterPlane(p.least, 0, 0));
    }
  }

  /// Compresses the columns.
  void compress() {
    std::size_t i = 0;
    for (Footprint& part : parts_) {
      columns_.clear();
      for (Column& c : part.columns) {
        const Patch& p = patches_[patch_[i++]];
        if (!p.crushed) {
          columns_.push_back(c);
          continue;
        }
        Eigen::Map<Vec3>(c.spring.data()) = corners_[i - 1] * p.floor;
        cut(c, &Column::spring, 0, 0, [&](const Column& piece) { press(piece, p, part); });
      }
      part.columns.swap(columns_);
    }
  }

  std::vector<Crater> craters(std::uint64_t first) const {
    std::vector<Crater> list;
    for (const Patch& p : patches_)
      if (p.crushed && (p.own || p.deepest > 0) && deepest_[cell(p)] > 0)
        list.push_back({feature(first, p), p.floor, std::max(0.0, greatest_[cell(p)])});
    return list;
  }

 private:
  static std::size_t cell(const Patch& p) { return static_cast<std::size_t>(p.cell); }
  static std::uint64_t feature(std::uint64_t first, const Patch& p) {
    return first + (static_cast<std::uint64_t>(p.cell) << 16) +
           (static_cast<std::uint64_t>(p.facet) & 0xffff);
  }

  Patch& patch_of(const Footprint& part, const Column& c) {
    const auto found = std::find_if(patches_.rbegin(), patches_.rend(),
                                    [&](const Patch& p) { return p.cell == c.cell && p.facet == c.facet; });
    return found != patches_.rend() ? *found
                                    : patches_.emplace_back(Patch{c.cell, c.facet, facet_plane(part, c)});
  }

  /// Raises floors of before to where nothing is compressed, if something is by more than `comes_to`.
  void let_lie(double comes_to) {
    if (std::isinf(comes_to)) return;
    std::vector<double> most(patches_.size(), -std::numeric_limits<double>::infinity());
    std::size_t i = 0;
    for (const Footprint& part : parts_)
      for (std::size_t k = 0; k < part.columns.size(); ++k, ++i)
        if (const Patch& p = patches_[patch_[i]]; p.own)
          most[patch_[i]] = std::max(most[patch_[i]], (corners_[i] * (p.depth - p.floor)).maxCoeff());
    for (std::size_t k = 0; k < patches_.size(); ++k)
      if (most[k] > comes_to) patches_[k].floor[0] += most[k];
  }

  const Patch* neighbour(const Patch& p) const {
    const Patch* largest = nullptr;
    for (const Patch& n : patches_)
      if (n.cell == p.cell && n.own && n.area > 0 && (largest == nullptr || n.area > largest->area))
        largest = &n;
    return largest;
  }

  static void start(Patch& p, const CraterPlane& left) {
    p.floor = p.depth - left;
    p.crushed = true;
  }

  /// Calls use(patch, area, g at the corners) for the columns that were crushed or are.
  template <class Use>
  void each_crushed(Use&& use) {
    std::size_t i = 0;
    for (const Footprint& part : parts_)
      for (const Column& c : part.columns) {
        Patch& p = patches_[patch_[i++]];
        const double depth = c.mean();
        if (!p.crushed || !(depth > 0)) continue;
        const Vec3 g = corners_[i - 1] * p.over;
        if (depth > limit_ || depth > g.mean() + limit_) use(p, c.area, g);
      }
  }

  /// A triangle that lies below the zero of its floor, or above it, `spring` its floor.
  void press(Column c, const Patch& p, Footprint& part) {
    const bool deep = c.spring[0] + c.spring[1] + c.spring[2] > 0;
    double& greatest = greatest_[cell(p)];
    Vec3 y = Vec3::Zero(), before = y;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<int>(k);
      if (deep) y[i] = c.spring[k], before[i] = p.before.dot(at(part, c.place[k]));
      c.spring[k] = c.depth[k] - y[i];
    }
    if (deep && c.spring[0] + c.spring[1] + c.spring[2] > 0)
      part.crushed += c.area * (y.mean() - mean_above(before));
    if (c.mean() > 0) greatest = std::max(greatest, y.maxCoeff());
    cut(c, &Column::spring, limit_, (1 - contact::full_at) * limit_,
        [&](const Column& piece) { columns_.push_back(piece); });
  }

  std::span<Footprint> parts_;
  double limit_;
  std::vector<Patch> patches_;
  std::vector<std::size_t> patch_;  // of the columns
  std::vector<Mat3> corners_;       // theirs, each row (1, a, b)
  std::vector<Column> columns_;
  std::array<double, contact::crater_cells * contact::crater_cells> deepest_,
      greatest_;  // depth and floor in each cell [m]
};

}  // namespace

std::vector<Crater> crush(std::span<Footprint> parts, std::uint64_t first,
                          std::span<const ContactMemory> known, double limit, bool late, double comes_to) {
  Crusher crusher(parts, limit);
  crusher.recall(first, known, late, comes_to);
  crusher.yield();
  crusher.compress();
  return crusher.craters(first);
}

void compress_at_most(Footprint& part, double most) {
  std::vector<Column> columns;
  for (const Column& c : part.columns)
    cut(c, &Column::depth, most, 0, [&](Column piece) {
      if (piece.mean() > most) piece.spring.fill(most);
      columns.push_back(piece);
    });
  part.columns.swap(columns);
}

}  // namespace talus::coupling
