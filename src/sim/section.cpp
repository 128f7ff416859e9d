#include "sim/section.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace talus::sim {
namespace {

std::string form_of(const StructureSpec& spec) {
  if (spec.kind != "box") return spec.kind;
  const Vec3 extent = spec.rotation.cwiseAbs() * spec.size;
  if (2 * extent.z() < std::min(extent.x(), extent.y())) return "slab";
  return extent.z() < std::max(extent.x(), extent.y()) ? "beam" : "column";
}

double area(double diameter) { return M_PI * diameter * diameter / 4; }

/// The bars in the body's axes, from its middle.
std::vector<BarLine> in_body(std::vector<BarLine> bars, const StructureSpec& spec) {
  const Vec3 middle =
      spec.position +
      (spec.kind == "column" ? Vec3(0.5 * spec.size.z() * spec.rotation.col(2)) : Vec3(Vec3::Zero()));
  for (BarLine& bar : bars)
    for (Vec3* end : {&bar.first, &bar.last}) *end = spec.rotation.transpose() * (*end - middle);
  return bars;
}

/// Effective depth and ratio for a blow along axis k from bars in layers; false if they do not run both ways
/// across it.
bool from_layers(const StructureSpec& spec, const std::vector<BarLine>& bars, int k,
                 RunHeader::StructureInfo& info) {
  const double h = spec.size[k];
  double depth = 0, ratio = 1;
  for (int a = 0; a < 3; ++a) {
    if (a == k) continue;
    double sum = 0, moment = 0;
    for (const BarLine& bar : bars) {
      const Vec3 run = bar.last - bar.first;
      const double off = std::abs(bar.first[k]);
      if (std::abs(run[a]) < 0.9 * run.norm() || std::abs(run[a]) < 0.5 * spec.size[a] || off < h / 4)
        continue;
      sum += area(bar.diameter);
      moment += area(bar.diameter) * (h / 2 + off);
    }
    if (!(sum > 0)) return false;
    depth += 0.5 * moment / sum;
    ratio *= 0.5 * sum / (spec.size[3 - k - a] * moment / sum);
  }
  info.effective_depth[k] = depth;
  info.reinforcement_ratio[k] = std::sqrt(ratio);
  return true;
}

}  // namespace

void describe_section(const StructureSpec& spec, const Structure& structure, RunHeader::StructureInfo& info) {
  info.form = form_of(spec);
  info.young = structure.skin().young();
  if (spec.kind != "box" && spec.kind != "column") return;
  const StructureSpec::RebarRule *bars = nullptr, *stirrups = nullptr;
  for (const auto& rule : spec.rebar_rules) (rule.kind == "longitudinal" ? bars : stirrups) = &rule;
  const std::vector<BarLine> layers =
      spec.rebar_file.empty() ? std::vector<BarLine>{} : in_body(structure.bars(), spec);
  Vec3::Index along = 2;  // bars by rule run along a column, and along the longest side of a box
  if (spec.kind == "box") spec.size.maxCoeff(&along);
  for (int k = 0; k < 3; ++k) {
    info.axes.emplace_back(spec.rotation.col(k));
    const double h = spec.size[k], w = spec.size[3 - k - static_cast<int>(along == k ? (k + 1) % 3 : along)];
    info.effective_depth[k] = 0.9 * h;
    if (from_layers(spec, layers, k, info) || !bars || k == along) continue;
    const double d = h - bars->cover - (stirrups ? stirrups->diameter : 0) -
                     bars->diameter / 2;  // the cover is that of the stirrups
    if (!(d > 0)) continue;
    info.effective_depth[k] = d;
    const double far_side = bars->bars * w / (2 * (w + h)) * area(bars->diameter);
    const double across =
        stirrups && stirrups->spacing > 0 ? area(stirrups->diameter) / (stirrups->spacing * d) : 0;
    info.reinforcement_ratio[k] = std::sqrt(far_side / (w * d) * across);
  }
}

}  // namespace talus::sim
