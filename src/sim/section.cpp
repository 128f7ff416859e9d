#include "sim/section.hpp"

#include <algorithm>
#include <cmath>

namespace talus::sim {
namespace {

std::string form_of(const StructureSpec& spec) {
  if (spec.kind != "box") return spec.kind;
  const Vec3 extent = spec.rotation.cwiseAbs() * spec.size;
  if (2 * extent.z() < std::min(extent.x(), extent.y())) return "slab";
  return extent.z() < std::max(extent.x(), extent.y()) ? "beam" : "column";
}

double area(double diameter) { return M_PI * diameter * diameter / 4; }

}  // namespace

void describe_section(const StructureSpec& spec, RunHeader::StructureInfo& info) {
  info.form = form_of(spec);
  // fib Model Code 2010, 5.1-21
  info.young = spec.young > 0 ? spec.young : spec.f_cm > 0 ? 21.5e9 * std::cbrt(spec.f_cm / 10e6) : 0;
  if (spec.kind != "box" && spec.kind != "column") return;
  const StructureSpec::RebarRule *bars = nullptr, *stirrups = nullptr;
  for (const auto& rule : spec.rebar_rules) (rule.kind == "longitudinal" ? bars : stirrups) = &rule;
  Vec3::Index along = 2;   // bars by rule run along a column, and along the longest side of a box
  if (spec.kind == "box") spec.size.maxCoeff(&along);
  for (int k = 0; k < 3; ++k) {
    info.axes.emplace_back(spec.rotation.col(k));
    const double h = spec.size[k], w = spec.size[3 - k - static_cast<int>(along == k ? (k + 1) % 3 : along)];
    info.effective_depth[k] = 0.9 * h;
    if (!bars || k == along) continue;
    const double d = h - bars->cover - bars->diameter / 2;
    if (!(d > 0)) continue;
    info.effective_depth[k] = d;
    const double far_side = bars->bars * w / (2 * (w + h)) * area(bars->diameter);
    const double across = stirrups && stirrups->spacing > 0 ? area(stirrups->diameter) / (stirrups->spacing * d) : 0;
    info.reinforcement_ratio[k] = std::sqrt(far_side / (w * d) * across);
  }
}

}  // namespace talus::sim
