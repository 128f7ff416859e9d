#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "geometry/block_output.hpp"

namespace talus::geometry {

using std::numbers::pi;

Eigen::Vector2d equal_area(const Vec3& line) {
  Vec3 d = line.normalized();
  if (d.z() > 0) d = -d;  // lower hemisphere
  const double flat = std::hypot(d.x(), d.y());
  if (flat == 0) return {0, 0};
  const double r =
      std::sqrt(std::max(0.0, 1 + d.z()));  // sqrt(2) sin((90 deg - plunge)/2) = sqrt(1 - sin plunge)
  return {r * d.x() / flat, r * d.y() / flat};
}

std::string stereonet_svg(const CutSpec& spec, const CutResult& cut, const StereonetOptions& options) {
  constexpr double size = 700, radius = 235, cx = 270, cy = 300;
  const char* colours[] = {"#1f5fa8", "#c1272d", "#2e8b57", "#8e44ad",
                           "#d2691e", "#008b8b", "#7f6000", "#555555"};
  const auto place = [&](const Vec3& line) {
    const Eigen::Vector2d p = equal_area(line);
    return Eigen::Vector2d(cx + radius * p.x(), cy - radius * p.y());
  };
  const auto great_circle = [&](double dip_direction, double dip, const std::string& style) {
    const Vec3 strike(std::cos(dip_direction), -std::sin(dip_direction), 0);
    const Vec3 down(std::sin(dip_direction) * std::cos(dip), std::cos(dip_direction) * std::cos(dip),
                    -std::sin(dip));
    std::string path;
    for (int k = 0; k <= 90; ++k) {
      // A vertical plane's circle is a diameter; the tiny inset keeps both of its ends on their own side.
      const double a = (k == 0 ? 1e-9 : k == 90 ? pi - 1e-9 : pi * k / 90);
      Vec3 d = std::cos(a) * strike + std::sin(a) * down;
      if (d.z() > 0) d.z() = 0;
      const Eigen::Vector2d p = place(d.z() == 0 ? Vec3(d.x(), d.y(), -1e-12) : d);
      path += fmt::format("{}{:.2f},{:.2f}", k ? " L" : "M", p.x(), p.y());
    }
    return fmt::format("<path d=\"{}\" fill=\"none\" {}/>\n", path, style);
  };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} 580\" font-family=\"sans-serif\" "
      "font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<text x=\"{1}\" y=\"28\" text-anchor=\"middle\" font-size=\"15\">{2}</text>\n",
      size, size / 2, options.title);
  out += fmt::format(
      "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"#fbfbf8\" stroke=\"black\" stroke-width=\"1.5\"/>\n", cx,
      cy, radius);
  // Net: small circles of equal dip every 30 degrees, ticks every 10 degrees of trend.
  for (const double plunge : {30.0, 60.0})
    out += fmt::format(
        "<circle cx=\"{}\" cy=\"{}\" r=\"{:.2f}\" fill=\"none\" stroke=\"#ccc\" stroke-dasharray=\"3 3\"/>\n",
        cx, cy, radius * std::sqrt(1 - std::sin(plunge * pi / 180)));
  for (int t = 0; t < 360; t += 10) {
    const double a = t * pi / 180, inner = t % 30 ? radius - 5 : radius - 10;
    out += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"black\"/>\n",
                       cx + inner * std::sin(a), cy - inner * std::cos(a), cx + radius * std::sin(a),
                       cy - radius * std::cos(a));
    if (t % 30 == 0)
      out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                         cx + (radius + 16) * std::sin(a), cy - (radius + 16) * std::cos(a) + 4,
                         t == 0 ? std::string("N") : std::to_string(t));
  }
  out += fmt::format("<path d=\"M{} {}h12m-6 -6v12\" stroke=\"#999\"/>\n", cx - 6, cy);
  if (options.friction > 0)
    out += fmt::format(
        "<circle cx=\"{}\" cy=\"{}\" r=\"{:.2f}\" fill=\"none\" stroke=\"#e08e0b\" stroke-width=\"1.5\"/>\n",
        cx, cy,
        radius * std::sqrt(1 - std::cos(options.friction)));  // poles within it: dip below the friction angle
  if (options.slope_dip_direction >= 0)
    out += great_circle(options.slope_dip_direction, options.slope_dip,
                        "stroke=\"black\" stroke-width=\"2\" stroke-dasharray=\"8 3\"");

  const int sets = static_cast<int>(spec.joint_sets.size()), joints = static_cast<int>(spec.joints.size());
  for (const auto& plane : cut.planes) {
    const Eigen::Vector2d p = place(-plane.normal);
    out += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"2.6\" fill=\"{}\" fill-opacity=\"0.55\"/>\n",
                       p.x(), p.y(), colours[plane.joint % 8]);
  }
  double row = 80;
  for (int k = 0; k < sets + joints; ++k) {
    const bool is_set = k < sets;
    const double direction = is_set ? spec.joint_sets[k].dip_direction : spec.joints[k - sets].dip_direction,
                 dip = is_set ? spec.joint_sets[k].dip : spec.joints[k - sets].dip;
    const std::string& name = is_set ? spec.joint_sets[k].name : spec.joints[k - sets].name;
    out += great_circle(direction, dip,
                        fmt::format("stroke=\"{}\" stroke-width=\"1.8\"{}", colours[k % 8],
                                    is_set ? "" : " stroke-dasharray=\"5 3\""));
    const Eigen::Vector2d p = place(-joint_normal(direction, dip));
    out += fmt::format("<path d=\"M{:.2f} {:.2f}l5 9h-10z\" fill=\"{}\" stroke=\"white\"/>\n", p.x(),
                       p.y() - 6, colours[k % 8]);
    std::string escaped;
    for (char c : name) escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    out += fmt::format(
        "<rect x=\"530\" y=\"{0}\" width=\"12\" height=\"12\" fill=\"{1}\"/><text x=\"548\" y=\"{2}\">{3} "
        "{4:03.0f}/{5:02.0f}</text>\n",
        row, colours[k % 8], row + 11, escaped, direction * 180 / pi, dip * 180 / pi);
    row += 20;
  }
  if (options.slope_dip_direction >= 0) {
    out += fmt::format("<text x=\"530\" y=\"{}\">slope {:03.0f}/{:02.0f}</text>\n", row + 11,
                       options.slope_dip_direction * 180 / pi, options.slope_dip * 180 / pi);
    row += 20;
  }
  if (options.friction > 0)
    out += fmt::format("<text x=\"530\" y=\"{}\" fill=\"#e08e0b\">friction {:.0f}°</text>\n", row + 11,
                       options.friction * 180 / pi);
  out +=
      "<text x=\"530\" y=\"520\" fill=\"#555\">▲ pole of the set</text><text x=\"530\" y=\"540\" "
      "fill=\"#555\">● pole of a plane</text>\n</svg>\n";
  return out;
}

}  // namespace talus::geometry
