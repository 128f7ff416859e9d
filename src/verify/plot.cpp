// A plain log-log plot as SVG: decades as grid, a marker and a line per method.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "verify/suite.hpp"

namespace talus::verify {

std::string svg_plot(const std::string& title, const std::vector<CurvePoint>& points) {
  constexpr double width = 640, height = 440, left = 78, right = 20, top = 44, bottom = 58, floor = 1e-16;
  double x0 = 1e300, x1 = 0, y0 = 1e300, y1 = 0;
  for (const CurvePoint& p : points) {
    if (p.failed) continue;
    x0 = std::min(x0, std::max(p.cpu, 1e-5));
    x1 = std::max(x1, std::max(p.cpu, 1e-5));
    y0 = std::min(y0, std::max(p.error, floor));
    y1 = std::max(y1, std::max(p.error, floor));
  }
  if (x1 == 0) {
    x0 = 0.1;
    x1 = 1;
    y0 = 1e-3;
    y1 = 1;
  }
  const double lx0 = std::floor(std::log10(x0)), lx1 = std::max(lx0 + 1, std::ceil(std::log10(x1)));
  const double ly0 = std::floor(std::log10(y0)), ly1 = std::max(ly0 + 1, std::ceil(std::log10(y1)));
  const auto px = [&](double v) {
    return left + (std::log10(std::max(v, 1e-5)) - lx0) / (lx1 - lx0) * (width - left - right);
  };
  const auto py = [&](double v) {
    return height - bottom - (std::log10(std::max(v, floor)) - ly0) / (ly1 - ly0) * (height - top - bottom);
  };
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      width, height);
  s += fmt::format("<text x=\"{}\" y=\"18\" font-size=\"14\">{}</text>\n", left, title);
  const int every = std::max(1, static_cast<int>(std::ceil((ly1 - ly0) / 8)));
  for (double d = lx0; d <= lx1; ++d) {
    const double x = px(std::pow(10, d));
    s += fmt::format(
        "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">1e{4:.0f}</text>\n",
        x, top, height - bottom, height - bottom + 18, d);
  }
  for (double d = ly0; d <= ly1; d += every) {
    const double y = py(std::pow(10, d));
    s += fmt::format(
        "<path d=\"M{0} {1:.1f}H{2}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">1e{5:.0f}</text>\n",
        left, y, width - right, left - 8, y + 4, d);
  }
  s += fmt::format(
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">CPU time [s]</text><text transform=\"translate(18 {}) "
      "rotate(-90)\" text-anchor=\"middle\">error against the reference</text>\n",
      (left + width - right) / 2, height - 14, (top + height - bottom) / 2);
  const char* colours[] = {"#b5482a", "#2a6fb5", "#2e8b57", "#7a4fa3"};
  std::vector<std::string> methods;
  for (const CurvePoint& p : points)
    if (std::find(methods.begin(), methods.end(), p.method) == methods.end()) methods.push_back(p.method);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const char* colour = colours[m % 4];
    std::string path, marks;
    int failed = 0;
    for (const CurvePoint& p : points) {
      if (p.method != methods[m]) continue;
      if (p.failed) {
        ++failed;
        continue;
      }
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", px(p.cpu), py(p.error));
      marks += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"><title>{}, parameter {:g}: error {:.3g}, "
          "{:.3g} s</title></circle>\n",
          px(p.cpu), py(p.error), colour, p.method, p.parameter, p.error, p.cpu);
    }
    if (!path.empty())
      s += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", path, colour) +
           marks;
    s += fmt::format("<text x=\"{:.1f}\" y=\"36\" fill=\"{}\">{}{}</text>\n",
                     left + 180.0 * static_cast<double>(m), colour, methods[m],
                     failed > 0 ? fmt::format(" ({} failed)", failed) : "");
  }
  return s + "</svg>\n";
}

}  // namespace talus::verify
