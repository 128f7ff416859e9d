#include "fem/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fem/rebar/rebar_embed.hpp"
#include "fem/spec_error.hpp"

namespace talus::fem {
namespace {

std::string text(const Vec3& a) { return fmt::format("[{:g}, {:g}, {:g}]", a.x(), a.y(), a.z()); }
std::string text(const Box3& b) { return "min " + text(b.min()) + ", max " + text(b.max()); }

}  // namespace

material::Concrete concrete_of(const StructureSpec& spec) {
  material::ConcreteInput input;
  input.f_cm = spec.f_cm;
  input.young = spec.young;
  input.poisson = spec.poisson;
  input.density = spec.density;
  input.f_t = spec.tensile_strength;
  input.fracture_energy = spec.fracture_energy;
  material::Concrete concrete = material::mc2010(input, "structure." + spec.name + ".material");
  concrete.aggregate = spec.aggregate;
  return concrete;
}

Box3 bounds(const std::vector<Vec3>& points) {
  Box3 box;
  for (const Vec3& x : points) box.extend(x);
  return box;
}

Supports find_supports(const StructureSpec& spec, const HexMesh& mesh) {
  Supports s;
  s.held.assign(mesh.nodes.size(), {false, false, false});
  const Box3 box = bounds(mesh.local);
  const double tolerance = 1e-7 * box.diagonal().norm();
  for (const StructureSpec::Support& support : spec.supports) {
    std::vector<int> chosen;
    std::string what;
    if (spec.kind == "viaduct" && support.face == "-z") {
      chosen = mesh.node_groups.at("base");  // the feet of the piers follow the ground
    } else if (!support.face.empty()) {
      what = support.face;
      const std::size_t axis =
          support.face.size() == 2 ? std::string("xyz").find(support.face[1]) : std::string::npos;
      if (axis == std::string::npos || (support.face[0] != '-' && support.face[0] != '+'))
        bad(spec, "support", support.face, "one of -x, +x, -y, +y, -z, +z",
            "name a face of the bounding box");
      const double plane = support.face[0] == '-' ? box.min()[axis] : box.max()[axis];
      for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n)
        if (std::abs(mesh.local[n][axis] - plane) <= tolerance) chosen.push_back(n);
    } else if (!support.group.empty()) {
      what = support.group;
      const auto group = mesh.node_groups.find(support.group);
      if (group == mesh.node_groups.end()) {
        std::string known;
        for (const auto& [name, nodes] : mesh.node_groups) known += (known.empty() ? "" : ", ") + name;
        bad(spec, "support", support.group, "no such group in the mesh",
            known.empty() ? "the mesh has no groups" : "groups of the mesh: " + known);
      }
      chosen = group->second;
    } else {
      what = text(support.region);
      Box3 region = support.region;
      if (!region.isEmpty()) region.min().array() -= tolerance, region.max().array() += tolerance;
      for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n)
        if (region.contains(mesh.nodes[n])) chosen.push_back(n);
    }
    if (chosen.empty())
      bad(spec, "support", what, "no node of the mesh lies there", "move or enlarge the support");
    for (int n : chosen)
      for (int c = 0; c < 3; ++c) s.held[n][c] = s.held[n][c] || support.held[c];
  }
  for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n)
    if (s.held[n][0] || s.held[n][1] || s.held[n][2]) {
      s.nodes.push_back(n);
      s.centroid += mesh.nodes[n];
    }
  s.none = s.nodes.empty();
  if (!s.none) s.centroid /= static_cast<double>(s.nodes.size());
  return s;
}

double PatchLoad::factor(double t) const {
  if (history.empty()) return 1;
  if (t <= history.front().first) return history.front().second;
  for (std::size_t i = 1; i < history.size(); ++i)
    if (t <= history[i].first) {
      const double span = history[i].first - history[i - 1].first;
      const double s = span > 0 ? (t - history[i - 1].first) / span : 1;
      return history[i - 1].second + s * (history[i].second - history[i - 1].second);
    }
  return history.back().second;
}

namespace {

/// The share of the box x +- half that lies in a region, axis by axis; an axis without extent lies inside or
/// not.
double share_inside(const Box3& region, const Vec3& x, const Vec3& half) {
  double share = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = std::max(x[k] - half[k], region.min()[k]),
                 high = std::min(x[k] + half[k], region.max()[k]);
    if (!(high >= low)) return 0;
    if (half[k] > 1e-12 * region.sizes().norm()) share *= (high - low) / (2 * half[k]);
  }
  return share;
}

/// Adds the traction on the part of a face inside a region to the nodal forces, and its area. 2 x 2 Gauss
/// points when the face lies inside; when it is cut, many parts, each by its share: exact in area for a face
/// along two axes.
void press(const HexMesh& mesh, const SkinQuad& quad, const Box3& region, const Vec3& traction,
           double& pressed, std::vector<Vec3>& force) {
  Box3 face;
  for (int n : quad.node) face.extend(mesh.nodes[n]);
  const bool inside = region.contains(face);
  const int cuts = inside ? 2 : 40;
  const double g = 1 / std::sqrt(3.0), weight = inside ? 1.0 : 4.0 / (cuts * cuts);
  for (int i = 0; i < cuts; ++i)
    for (int j = 0; j < cuts; ++j) {
      const double s = inside ? (i ? g : -g) : -1 + (2 * i + 1.0) / cuts,
                   t = inside ? (j ? g : -g) : -1 + (2 * j + 1.0) / cuts;
      const double n[4] = {0.25 * (1 - s) * (1 - t), 0.25 * (1 + s) * (1 - t), 0.25 * (1 + s) * (1 + t),
                           0.25 * (1 - s) * (1 + t)};
      const double ds[4] = {-0.25 * (1 - t), 0.25 * (1 - t), 0.25 * (1 + t), -0.25 * (1 + t)};
      const double dt[4] = {-0.25 * (1 - s), -0.25 * (1 + s), 0.25 * (1 + s), 0.25 * (1 - s)};
      Vec3 x = Vec3::Zero(), a = Vec3::Zero(), b = Vec3::Zero();
      for (int k = 0; k < 4; ++k) {
        x += n[k] * mesh.nodes[quad.node[k]];
        a += ds[k] * mesh.nodes[quad.node[k]];
        b += dt[k] * mesh.nodes[quad.node[k]];
      }
      const double share = inside ? 1.0 : share_inside(region, x, (a.cwiseAbs() + b.cwiseAbs()) / cuts);
      if (share == 0) continue;
      const double area = a.cross(b).norm() * weight * share;
      pressed += area;
      for (int k = 0; k < 4; ++k) force[quad.node[k]] += n[k] * area * traction;
    }
}

}  // namespace

void check_area(const StructureSpec& spec, const StructureSpec::Load& load, double area) {
  if (!(area > 0))
    bad(spec, "load.region", text(load.region), "no part of the surface lies inside",
        "let the region contain the patch of the surface");
}

std::vector<PatchLoad> find_loads(const StructureSpec& spec, const HexMesh& mesh,
                                  const std::vector<SkinQuad>& skin, const Box3* whole) {
  std::vector<PatchLoad> loads;
  const double tolerance = 1e-7 * (whole != nullptr ? *whole : bounds(mesh.nodes)).diagonal().norm();
  for (const StructureSpec::Load& given : spec.loads) {
    Box3 region = given.region;
    if (region.isEmpty())
      bad(spec, "load.region", text(given.region), "min must not exceed max", "exchange them");
    region.min().array() -= tolerance;
    region.max().array() += tolerance;
    // A box that is thin along one axis means the faces across that axis, not the slivers of their neighbours
    // that it cuts.
    int thin = -1;
    {
      const Vec3 extent = given.region.sizes();
      int least = 0;
      const double smallest = extent.minCoeff(&least);
      double second = INFINITY;
      for (int i = 0; i < 3; ++i)
        if (i != least) second = std::min(second, extent[i]);
      if (smallest < 0.2 * second) thin = least;
    }
    PatchLoad load;
    load.history = given.history;
    for (std::size_t i = 1; i < load.history.size(); ++i)
      if (!(load.history[i].first > load.history[i - 1].first))
        bad(spec, "load.history", fmt::format("{:g} s", load.history[i].first), "times must increase",
            "sort the table");
    std::vector<Vec3> force(mesh.nodes.size(), Vec3::Zero());
    for (const SkinQuad& quad : skin) {
      Box3 face;
      for (int n : quad.node) face.extend(mesh.nodes[n]);
      if (!region.intersects(face)) continue;
      if (thin >= 0) {
        const Vec3 normal = (mesh.nodes[quad.node[2]] - mesh.nodes[quad.node[0]])
                                .cross(mesh.nodes[quad.node[3]] - mesh.nodes[quad.node[1]])
                                .normalized();
        if (std::abs(normal[thin]) < 0.7) continue;
      }
      press(mesh, quad, region, given.traction, load.area, force);
    }
    if (whole == nullptr) check_area(spec, given, load.area);
    for (int n = 0; n < static_cast<int>(force.size()); ++n)
      if (force[n] != Vec3::Zero()) load.node.push_back(n), load.force.push_back(force[n]);
    loads.push_back(std::move(load));
  }
  return loads;
}

std::vector<ProbePoint> find_probes(const StructureSpec& spec, const HexMesh& mesh) {
  std::vector<ProbePoint> probes;
  if (spec.probes.empty()) return probes;
  constexpr double beyond = 0.5;  // of a cell's size
  const rebar::HostSearch search = rebar::host_search(mesh.nodes, mesh.hexes, beyond);
  for (const StructureSpec::Probe& given : spec.probes) {
    ProbePoint& point = probes.emplace_back();
    if (const auto host = search(given.at)) {
      point = {mesh.hexes[static_cast<std::size_t>(host->cell)], shape_values(host->xi)};
      continue;
    }
    const auto nearest =
        std::min_element(mesh.nodes.begin(), mesh.nodes.end(), [&](const Vec3& a, const Vec3& b) {
          return (a - given.at).squaredNorm() < (b - given.at).squaredNorm();
        });
    point.node.fill(static_cast<int>(nearest - mesh.nodes.begin()));
    point.weight = {1, 0, 0, 0, 0, 0, 0, 0};
  }
  return probes;
}

}  // namespace talus::fem
