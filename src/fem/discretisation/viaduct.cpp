#include "fem/discretisation/viaduct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fem/discretisation/lattice.hpp"
#include "fem/spec_error.hpp"

namespace talus::fem {

std::vector<rebar::Member> cap_members(const StructureSpec& spec) {
  std::vector<rebar::Member> members;
  for (const ViaductPlan::Part& part : viaduct_plan(spec).parts) {
    if (part.deck >= 0 || (part.boxes.size() < 2 && part.rounds.empty())) continue;
    const Box3& cap = part.boxes.back();
    rebar::Member m;
    m.width = cap.sizes().z();
    m.depth = cap.sizes().x();
    m.length = cap.sizes().y();
    m.base =
        spec.position + spec.rotation * part.placed(Vec3(cap.center().x(), cap.min().y(), cap.center().z()));
    m.axis_x = spec.rotation.col(2);
    m.axis_y = spec.rotation * part.turn.col(0);
    members.push_back(m);
  }
  return members;
}

std::vector<rebar::Bar> deck_bars(const StructureSpec& spec, const StructureSpec::RebarRule& rule,
                                  const material::Steel::Parameters& steel) {
  const Vec3 up = spec.rotation.col(2);
  const double inset = rule.cover + rule.diameter / 2;
  std::vector<rebar::Bar> bars;
  for (const ViaductPlan::Soffit& soffit : viaduct_plan(spec).soffits) {
    const double room = soffit.width - 2 * inset;
    if (!(room >= 0) || (rule.bars > 1 && room / (rule.bars - 1) < rule.diameter))
      bad(spec, "rebar", fmt::format("{} bars of {:g} m", rule.bars, rule.diameter),
          fmt::format("they do not fit side by side into a width of {:g} m", soffit.width),
          "fewer, thinner bars or less cover");
    const Vec3 along = (soffit.end - soffit.start).normalized();
    for (int i = 0; i < rule.bars; ++i) {
      rebar::Bar bar;
      bar.name = fmt::format("D{}", bars.size() + 1);
      bar.diameter = rule.diameter;
      bar.steel = steel;
      const Vec3 shift =
          (rule.bars > 1 ? room * (double(i) / (rule.bars - 1) - 0.5) : 0.0) * soffit.across + inset * up;
      bar.points = {soffit.start + shift + rule.cover * along, soffit.end + shift - rule.cover * along};
      bars.push_back(std::move(bar));
    }
  }
  return bars;
}

namespace {

/// Nodes at the foot of every pier; of a part of one box (an abutment) those of its lower side.
std::vector<int> feet_of(const ViaductPlan::Part& part, const HexMesh& mesh) {
  std::vector<int> feet;
  const std::size_t count = std::max<std::size_t>(1, part.boxes.size() - 1);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3& x = mesh.nodes[n];
    for (std::size_t b = 0; b < count; ++b) {
      const Vec3 low = part.boxes[b].min().array() - 1e-9, high = part.boxes[b].max().array() + 1e-9;
      if (std::abs(x.z() - part.boxes[b].min().z()) > 1e-9 || x.x() < low.x() || x.x() > high.x() ||
          x.y() < low.y() || x.y() > high.y())
        continue;
      feet.push_back(static_cast<int>(n));
      break;
    }
  }
  return feet;
}

}  // namespace

std::vector<StructureSpec::Refinement> zones_of(const ViaductPlan::Part& part, const StructureSpec& spec) {
  std::vector<StructureSpec::Refinement> zones = local_refinements(spec);
  for (StructureSpec::Refinement& zone : zones) {
    Box3 own;
    for (int corner = 0; corner < 8; ++corner)
      own.extend(part.own(zone.region.corner(static_cast<Box3::CornerType>(corner))));
    zone.region = own;
  }
  return zones;
}

HexMesh viaduct_mesh(const StructureSpec& spec) {
  const ViaductPlan plan = viaduct_plan(spec);
  HexMesh mesh;
  std::vector<int> base;
  for (int k = 0; k < static_cast<int>(plan.parts.size()); ++k) {
    const ViaductPlan::Part& what = plan.parts[k];
    std::vector<int> feet;
    const HexMesh part = what.rounds.empty() ? bricks(what.boxes, spec.cell_size, zones_of(what, spec))
                                             : round_bent(what.boxes.back(), what.rounds, spec.cell_size,
                                                          zones_of(what, spec), feet);
    const int shift = static_cast<int>(mesh.nodes.size());
    for (const Vec3& x : part.nodes) {
      mesh.local.push_back(x);
      mesh.nodes.push_back(spec.rotation * what.placed(x) + spec.position);
    }
    for (auto hex : part.hexes) {
      for (int& n : hex) n += shift;
      mesh.hexes.push_back(hex);
      mesh.component.push_back(k);
    }
    if (!what.founded) continue;
    if (what.rounds.empty()) feet = feet_of(what, part);
    for (int n : feet) base.push_back(shift + n);
  }
  mesh.node_groups["base"] = base;
  return mesh;
}

}  // namespace talus::fem
