// Round piers under a cap beam.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/sort_unique.hpp"
#include "fem/discretisation/disc.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/discretisation/viaduct.hpp"

namespace talus::fem {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr double largest_patch = 1.3;  // half side of the square around the disc over the radius

struct Plan {
  std::vector<Vec2> nodes;
  std::vector<std::array<int, 4>> quads;
  std::vector<int> pier;  // per quad; -1: cap beam alone
};

int count(double length, double cell) {
  return std::max(1, static_cast<int>(std::ceil(length / cell - 1e-9)));
}

/// Appends the grid lines after the last one up to `to`.
void lines_to(std::vector<double>& lines, double to, double cell) {
  const double from = lines.back();
  if (to - from < 1e-9) return;
  const int n = count(to - from, cell);
  for (int i = 1; i <= n; ++i) lines.push_back(from + (to - from) * i / n);
}

/// The lines through a patch: equal angles seen from its centre.
void patch_lines(std::vector<double>& lines, double centre, double half, int n) {
  for (int i = 1; i <= n; ++i) lines.push_back(centre + half * std::tan(M_PI / 4 * (2.0 * i / n - 1)));
}

class PlanBuilder {
 public:
  int node(const Vec2& x) {
    const std::pair<long, long> key{std::lround(x.x() * 1e7), std::lround(x.y() * 1e7)};
    const auto [at, fresh] = number_.try_emplace(key, static_cast<int>(plan.nodes.size()));
    if (fresh) plan.nodes.push_back(x);
    return at->second;
  }
  void quad(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d, int pier) {
    plan.quads.push_back({node(a), node(b), node(c), node(d)});
    plan.pier.push_back(pier);
  }
  Plan plan;

 private:
  std::map<std::pair<long, long>, int> number_;
};

/// The square of half side `half` around a disc: the section of the pier, and rings of the cap beam outside.
void disc_in_square(PlanBuilder& plan, const Vec2& centre, double radius, double half, const DiscMesh& disc,
                    double cell, int pier) {
  const auto at = [&](int node) {
    const auto& x = disc.nodes[static_cast<std::size_t>(node)];
    return Vec2(centre + radius * Vec2(x[0], x[1]));
  };
  for (const auto& q : disc.quads) plan.quad(at(q[0]), at(q[1]), at(q[2]), at(q[3]), pier);
  const int rings = count(half - radius, cell), around = static_cast<int>(disc.rim.size());
  const auto layer = [&](int k, int level) {
    const Vec2 rim = at(disc.rim[static_cast<std::size_t>(k % around)]), away = rim - centre;
    const Vec2 square = centre + half / away.cwiseAbs().maxCoeff() * away;
    return Vec2(rim + (square - rim) * level / rings);
  };
  for (int level = 0; level < rings; ++level)
    for (int k = 0; k < around; ++k)
      plan.quad(layer(k, level), layer(k, level + 1), layer(k + 1, level + 1), layer(k + 1, level), -1);
}

}  // namespace

HexMesh round_bent(const Box3& cap, const std::vector<ViaductPlan::Round>& piers, double wanted,
                   const std::vector<StructureSpec::Refinement>& refinements, std::vector<int>& feet) {
  const double radius = piers[0].radius;
  Box3 bent = cap;
  for (const auto& pier : piers) bent.extend(pier.foot);
  double cell_size = wanted;    // in plan: the finest that is asked for anywhere in the bent
  std::vector<FineZone> zones;  // up the piers
  for (const auto& r : refinements) {
    if (!r.region.intersects(bent)) continue;
    cell_size = std::min(cell_size, r.cell_size);
    zones.push_back({r.region.min().z(), r.region.max().z(), r.cell_size});
  }
  const RoundSection section = round_section(2 * radius, cell_size);
  const DiscMesh disc = disc_mesh(section);
  const int n = section.side;
  double half = largest_patch * radius;
  const double x = piers[0].foot.x();
  half = std::min({half, x - cap.min().x(), cap.max().x() - x, piers.front().foot.y() - cap.min().y(),
                   cap.max().y() - piers.back().foot.y()});
  for (std::size_t k = 1; k < piers.size(); ++k)
    half = std::min(half, 0.5 * (piers[k].foot.y() - piers[k - 1].foot.y()));

  std::vector<double> xs{cap.min().x()}, ys{cap.min().y()};
  lines_to(xs, x - half, cell_size);
  const double patch_x = xs.back();
  patch_lines(xs, x, half, n);
  lines_to(xs, cap.max().x(), cell_size);
  std::vector<double> patch_y;
  for (const auto& pier : piers) {
    lines_to(ys, pier.foot.y() - half, cell_size);
    patch_y.push_back(ys.back());
    patch_lines(ys, pier.foot.y(), half, n);
  }
  lines_to(ys, cap.max().y(), cell_size);

  PlanBuilder builder;
  for (std::size_t i = 0; i + 1 < xs.size(); ++i)
    for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
      const Vec2 middle(0.5 * (xs[i] + xs[i + 1]), 0.5 * (ys[j] + ys[j + 1]));
      const bool in_patch = middle.x() > patch_x && middle.x() < patch_x + 2 * half &&
                            std::any_of(patch_y.begin(), patch_y.end(), [&](double y) {
                              return middle.y() > y && middle.y() < y + 2 * half;
                            });
      if (!in_patch)
        builder.quad({xs[i], ys[j]}, {xs[i + 1], ys[j]}, {xs[i + 1], ys[j + 1]}, {xs[i], ys[j + 1]}, -1);
    }
  for (std::size_t k = 0; k < piers.size(); ++k)
    disc_in_square(builder, piers[k].foot.head<2>(), radius, half, disc, cell_size, static_cast<int>(k));

  // Extruded: each pier from its foot to the cap beam, then everything through the cap beam.
  const Plan& plan = builder.plan;
  HexMesh mesh;
  std::map<std::pair<int, double>, int> number;
  const auto node = [&](int p, double z) {
    const auto [at, fresh] = number.try_emplace({p, z}, static_cast<int>(mesh.nodes.size()));
    if (fresh) mesh.nodes.emplace_back(plan.nodes[p].x(), plan.nodes[p].y(), z);
    return at->second;
  };
  const auto extrude = [&](int pier, double low, double high) {
    const std::vector<double> planes = graded_lines({low, high}, wanted, zones);
    for (std::size_t l = 0; l + 1 < planes.size(); ++l)
      for (std::size_t q = 0; q < plan.quads.size(); ++q) {
        if (pier >= 0 && plan.pier[q] != pier) continue;
        std::array<int, 8> hex;
        for (int a = 0; a < 4; ++a)
          hex[a] = node(plan.quads[q][a], planes[l]), hex[4 + a] = node(plan.quads[q][a], planes[l + 1]);
        mesh.hexes.push_back(hex);
      }
  };
  for (std::size_t k = 0; k < piers.size(); ++k) {
    extrude(static_cast<int>(k), piers[k].foot.z(), piers[k].top);
    for (std::size_t q = 0; q < plan.quads.size(); ++q)
      if (plan.pier[q] == static_cast<int>(k))
        for (int a : plan.quads[q]) feet.push_back(node(a, piers[k].foot.z()));
  }
  sort_unique(feet);
  extrude(-1, cap.min().z(), cap.max().z());
  return mesh;
}

}  // namespace talus::fem
