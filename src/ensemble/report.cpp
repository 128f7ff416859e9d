#include "ensemble/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "ensemble/brief.hpp"
#include "ensemble/fragility/fragility_file.hpp"
#include "ensemble/statistics.hpp"
#include "geometry/raster.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"
#include "io/json_file.hpp"
#include "io/xml.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;
using Colour = std::array<double, 3>;

constexpr int picture_side = 420;          // cells of the picture of the ground, along the longer side
constexpr std::size_t most_points = 3000;  // end points drawn

std::string base64(const std::string& bytes) {
  constexpr char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k)
      v = (v << 8) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : letters[(v >> (18 - 6 * k)) & 63];
  }
  return out;
}

/// A picture of 24 bits a point, south row first, as a file.
std::string bitmap(int columns, int rows, const std::vector<Colour>& points) {
  const int line = (3 * columns + 3) / 4 * 4;
  std::string file = "BM";
  const auto put = [&](std::uint32_t value, int bytes) {
    for (int k = 0; k < bytes; ++k) file += static_cast<char>((value >> (8 * k)) & 255);
  };
  put(static_cast<std::uint32_t>(54 + line * rows), 4), put(0, 4), put(54, 4);
  put(40, 4), put(static_cast<std::uint32_t>(columns), 4), put(static_cast<std::uint32_t>(rows), 4),
      put(1, 2), put(24, 2), put(0, 4), put(static_cast<std::uint32_t>(line * rows), 4), put(2835, 4),
      put(2835, 4), put(0, 4), put(0, 4);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const Colour& c = points[static_cast<std::size_t>(i * columns + j)];
      for (const int k : {2, 1, 0})
        file += static_cast<char>(
            static_cast<unsigned char>(std::clamp(c[static_cast<std::size_t>(k)], 0.0, 255.0)));
    }
    for (int k = 3 * columns; k < line; ++k) file += '\0';
  }
  return file;
}

/// Of a part from 0 to 1: yellow over orange to a dark red.
Colour heat(double s) {
  constexpr std::array<Colour, 4> stops{Colour{255, 243, 178}, Colour{253, 174, 77}, Colour{227, 74, 51},
                                        Colour{127, 0, 31}};
  const double at = std::clamp(s, 0.0, 1.0) * 3;
  const auto k = std::min<std::size_t>(2, static_cast<std::size_t>(at));
  Colour c{};
  for (std::size_t q = 0; q < 3; ++q)
    c[q] = stops[k][q] + (at - static_cast<double>(k)) * (stops[k + 1][q] - stops[k][q]);
  return c;
}

std::string number(const Json& x, double scale = 1) {
  if (!x.is_number()) return "–";
  const double value = scale * x.get<double>();
  return std::abs(value) >= 1000 && std::abs(value) < 1e7 ? fmt::format("{:.0f}", value)
                                                          : fmt::format("{:.3g}", value);
}

/// An end that the members do not bound is null.
std::string estimate(const Json& e, double scale = 1) {
  const bool low = e["low"].is_number(), high = e["high"].is_number();
  return number(e["value"], scale) + "<br><small>" +
         (low    ? number(e["low"], scale) + (high ? " to " + number(e["high"], scale) : " or more")
          : high ? number(e["high"], scale) + " or less"
                 : "") +
         "</small>";
}

/// 1, 2 or 5 times a power of ten, at least a fifth of the range.
double tick_of(double range) {
  const double raw = range / 5, power = std::pow(10.0, std::floor(std::log10(raw)));
  return (raw <= power ? 1 : raw <= 2 * power ? 2 : raw <= 5 * power ? 5 : 10) * power;
}

/// A diagram of curves over a common axis. On an axis of decades x is a decimal logarithm.
class Chart {
 public:
  enum class Axis { linear, decades };
  Chart(std::string x_label, std::string y_label, double x0, double x1, double y0, double y1,
        Axis axis = Axis::linear)
      : x_label_(std::move(x_label)),
        y_label_(std::move(y_label)),
        decades_(axis == Axis::decades),
        x0_(decades_ ? std::floor(x0) : x0),
        x1_(decades_  ? std::max(std::ceil(x1), x0_ + 1)
            : x1 > x0 ? x1
                      : x0 + 1),
        y0_(y0),
        y1_(y1) {}
  void curve(const std::vector<std::pair<double, double>>& points, const std::string& colour) {
    std::string path;
    for (const auto& [x, y] : points)
      path += fmt::format("{}{:.1f},{:.1f}", path.empty() ? "" : " ", at_x(x), at_y(y));
    body_ +=
        fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>", path, colour);
  }
  void band(const std::vector<std::pair<double, double>>& low,
            const std::vector<std::pair<double, double>>& high, const std::string& colour) {
    std::string path;
    for (const auto& [x, y] : low) path += fmt::format("{:.1f},{:.1f} ", at_x(x), at_y(y));
    for (auto p = high.rbegin(); p != high.rend(); ++p)
      path += fmt::format("{:.1f},{:.1f} ", at_x(p->first), at_y(p->second));
    body_ += fmt::format("<polygon points=\"{}\" fill=\"{}\" opacity=\"0.15\"/>", path, colour);
  }
  void mark(double x, const std::string& text) {
    body_ += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#888\" stroke-dasharray=\"4 "
        "3\"/><text x=\"{3:.1f}\" y=\"{4}\" class=\"t\">{5}</text>",
        at_x(x), top, bottom, at_x(x) + 3, top + 10, text);
  }
  std::string svg() const {
    std::string axes;
    const double dx = decades_ ? 1 : tick_of(x1_ - x0_), dy = tick_of(y1_ - y0_);
    for (double x = std::ceil(x0_ / dx) * dx; x <= x1_ * (1 + 1e-9); x += dx)
      axes += fmt::format(
          "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" class=\"g\"/><text x=\"{0:.1f}\" "
          "y=\"{3}\" class=\"t\" text-anchor=\"middle\">{4:g}</text>",
          at_x(x), top, bottom, bottom + 15, decades_ ? std::pow(10, std::round(x)) : x);
    for (double y = std::ceil(y0_ / dy) * dy; y <= y1_ * (1 + 1e-9); y += dy)
      axes += fmt::format(
          "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" class=\"g\"/><text x=\"{3}\" "
          "y=\"{4:.1f}\" class=\"t\" text-anchor=\"end\">{5:g}</text>",
          left, right, at_y(y), left - 6, at_y(y) + 4, y);
    return fmt::format(
        "<svg viewBox=\"0 0 480 280\" class=\"chart\" role=\"img\" aria-label=\"{0} over {1}\">{2}{3}<text "
        "x=\"{4}\" y=\"274\" class=\"l\" text-anchor=\"middle\">{1}</text><text x=\"14\" y=\"{5}\" "
        "class=\"l\" text-anchor=\"middle\" transform=\"rotate(-90 14 {5})\">{0}</text></svg>",
        io::xml_text(y_label_), io::xml_text(x_label_), axes, body_, (left + right) / 2, (top + bottom) / 2);
  }

 private:
  static constexpr int left = 62, right = 450, top = 12, bottom = 236;
  double at_x(double x) const { return left + (x - x0_) / (x1_ - x0_) * (right - left); }
  double at_y(double y) const { return bottom - (y - y0_) / (y1_ - y0_) * (bottom - top); }
  std::string x_label_, y_label_, body_;
  bool decades_;
  double x0_, x1_, y0_, y1_;
};

class Page {
 public:
  Page(const Ensemble& ensemble, const fs::path& directory)
      : ensemble_(ensemble),
        directory_(directory),
        file_(io::Hdf5File::open(directory / "ensemble.h5")),
        summary_(io::read_json(directory / "summary.json", "run talus ensemble again")),
        details_(io::read_json(directory / "details.json", "run talus ensemble again")),
        fragility_(read_fragility(directory)) {
    const auto index = file_.read<std::int64_t>("/members/index").values;
    const std::vector<std::string> status = file_.read_texts("/members/status");
    for (std::size_t k = 0; k < index.size(); ++k)
      if (status[k] != status_text(Status::failed) && status[k] != status_text(Status::over_limit))
        finished_.insert(index[k]);
  }

  std::string text() {
    std::string body = head();
    body += "<div class=\"row\">" + map("reach", "Reach", "Share of members through a cell", 100, " %") +
            map("energy_p95", "Energy, 95th percentile", "Kinetic energy of the members through a cell", 1e-3,
                " kJ") +
            "</div>";
    for (std::size_t l = 0; l < summary_["lines"].size(); ++l) body += line(l);
    for (const std::string& s : ensemble_.structures()) body += hits(s);
    for (const Json& f : fragility_) body += fragility(f);
    body += notes();
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
           "content=\"width=device-width\"><title>" +
           title() +
           "</title><style>"
           ":root{color-scheme:light "
           "dark;--ink:#1d2733;--soft:#5b6672;--line:#d9dee4;--faint:#e4e8ec;--ground:#fff;--curve:#0b5fa5}"
           "@media(prefers-color-scheme:dark){:root{--ink:#e7ebf0;--soft:#a8b3bf;--line:#3a4552;--faint:#"
           "2b343f;--ground:#14191f;--curve:#6db3f2}.map image,.key span{filter:brightness(.7)}}"
           "body{font:15px/1.55 "
           "system-ui,sans-serif;color:var(--ink);background:var(--ground);max-width:1080px;margin:0 "
           "auto;padding:1.5em}h1{font-size:1.5em}h2{margin-top:2em;border-bottom:1px solid var(--line)}"
           ".cards{display:flex;flex-wrap:wrap;gap:.8em}.card{border:1px solid "
           "var(--line);border-radius:6px;padding:.5em 1em;min-width:7em;max-width:16em}.card "
           "b{display:block;font-size:1.35em}"
           "table{border-collapse:collapse;margin:.8em "
           "0;display:block;overflow-x:auto;max-width:100%}td,th{padding:.3em .8em;border-bottom:1px solid "
           "var(--faint);text-align:right;vertical-align:top;font-variant-numeric:tabular-nums}"
           "td:first-child,th:first-child,.text{text-align:left}small{color:var(--soft)}td "
           "small,.key b{white-space:nowrap}.key b{font-weight:400}.row{"
           "display:flex;flex-wrap:wrap;gap:1em}.row>section{flex:1 1 "
           "400px;min-width:0}.chart{width:min(480px,100%);height:auto}"
           ".g{stroke:var(--faint)}.t{font-size:11px;fill:var(--soft)}.l{font-size:12px;fill:var(--ink)}.map{"
           "width:100%;height:auto;border:1px solid var(--line)}.key "
           "span{display:inline-block;width:1.6em;height:.8em;margin:0 .3em 0 .9em}"
           "@media(max-width:600px){body{padding:.8em}table{font-size:13px}td,th{padding:.3em .3em}td "
           "small{white-space:normal}}"
           "@media "
           "print{table{display:table;overflow:visible}tr,section,.chart,.card{break-inside:avoid}h2,h3{"
           "break-after:avoid}}</style></head><body><main>" +
           body + "</main></body></html>\n";
  }

 private:
  std::string title() const {
    return io::xml_text(ensemble_.title().empty() ? "Ensemble" : ensemble_.title());
  }

  static std::string card(const std::string& name, const std::string& value) {
    return "<div class=\"card\"><b>" + value + "</b>" + name + "</div>";
  }

  /// P(severe or worse) of a structure and of its members that can be.
  static std::string damage_cards(const Json& f) {
    constexpr std::size_t severe = 2;  // place of class 3 in the lists
    const auto of = [](const std::string& name, const Json& p) {
      if (p.size() <= severe || !p[severe]["value"].is_number()) return std::string();
      const auto percent = [&](const char* key) { return number(p[severe][key], 100); };
      return card(io::xml_text(name) + " severe or worse, per event<br><small>" + percent("low") + " to " +
                      percent("high") + " %</small>",
                  percent("value") + " %");
    };
    std::string text = of(f.value("structure", ""), f.value("per_event", Json::array()));
    for (const Json& m : f.value("members", Json::array()))
      if (const Json& p = m["per_event"]; m.value("name", "") != f.value("structure", "") &&
                                          p.size() > severe && p[severe]["value"].is_number() &&
                                          p[severe]["value"].get<double>() > 0)
        text += of(f.value("structure", "") + " " + m.value("name", ""), p);
    return text;
  }

  /// Of a line or a structure, with its interval; a line of which nothing is known has one all the same.
  static std::string probability_card(const std::string& what, const Json& of, bool always) {
    const std::string name = what + io::xml_text(of.value("name", ""));
    const Json& p = of["probability"];
    if (!p["value"].is_number()) return always ? card(name, "–") : "";
    return card(name + "<br><small>" + number(p["low"], 100) + " to " + number(p["high"], 100) + " %</small>",
                number(p["value"], 100) + " %");
  }

  std::string head() const {
    const Json& m = summary_["members"];
    std::string text = "<h1>" + title() + "</h1><div class=\"cards\">";
    for (const Json& f : fragility_) text += damage_cards(f);
    for (const auto& [key, name] :
         {std::pair{"asked", "members"}, std::pair{"done", "done"}, std::pair{"suspect", "suspect"},
          std::pair{"over_limit", "over the limit"}, std::pair{"failed", "failed"}}) {
      const long count = m.value(key, 0L);
      std::string means = name;
      if (key == std::string("done"))
        means += "<br><small>came to rest, left the terrain, or ran to the end of their time</small>";
      if (key == std::string("suspect") && count > 0)
        means += "<br><small>energy gain above 1 %, or still moving at the end</small>";
      text += card(means, fmt::format("{}", count));
    }
    for (const Json& l : summary_["lines"]) text += probability_card("cross ", l, true);
    for (const Json& s : summary_.value("structures", Json::array()))
      text += probability_card("hit ", s, false);
    text += "</div>";
    for (const std::string& means :
         {m.value("left_means", ""), summary_.value("precision", Json::object()).value("means", "")})
      if (!means.empty()) text += "<p><b>" + io::xml_text(means) + "</b></p>";
    return text;
  }

  /// Ground in relief, coloured by a map of the directory, with lines, hits and end points.
  std::string map(const std::string& name, const std::string& title, const std::string& what, double scale,
                  const std::string& unit) {
    const fs::path raster = directory_ / "maps" / (name + ".tif");
    if (!fs::exists(raster)) return "";
    const geometry::Raster reach = geometry::read_raster(raster.string());
    const Vec3& origin = ensemble_.origin();
    const double cell = reach.transform[1], margin = 0.08 * cell * std::max(reach.columns, reach.rows);
    const double west = reach.transform[0] - origin.x() - margin,
                 north = reach.transform[3] - origin.y() + margin, width = reach.columns * cell + 2 * margin,
                 height = reach.rows * cell + 2 * margin;
    const double step = std::max(width, height) / picture_side;
    const int columns = std::max(2, static_cast<int>(width / step)),
              rows = std::max(2, static_cast<int>(height / step));
    double most = 0;
    for (const double r : reach.values)
      if (std::isfinite(r)) most = std::max(most, r);
    std::vector<Colour> points;
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const double x = west + (j + 0.5) * step, y = north - height + (i + 0.5) * step;
        const double z = ensemble_.height(x, y), zx = ensemble_.height(x + step, y),
                     zy = ensemble_.height(x, y + step);
        Colour c{250, 250, 250};
        if (std::isfinite(z)) {
          const Vec3 n =
              Vec3(-(std::isfinite(zx) ? zx - z : 0) / step, -(std::isfinite(zy) ? zy - z : 0) / step, 1)
                  .normalized();
          const double light = 150 + 95 * std::clamp(n.dot(Vec3(-1, 1, 1.4).normalized()), 0.0, 1.0);
          c = {light, light, light};
        }
        const int u = static_cast<int>(std::floor((x + origin.x() - reach.transform[0]) / cell)),
                  v = static_cast<int>(std::floor((reach.transform[3] - y - origin.y()) / cell));
        if (u >= 0 && v >= 0 && u < reach.columns && v < reach.rows)
          if (const double r =
                  reach.values[static_cast<std::size_t>(v) * static_cast<std::size_t>(reach.columns) +
                               static_cast<std::size_t>(u)];
              std::isfinite(r)) {
            const Colour h = heat(std::sqrt(std::max(0.0, r) / std::max(most, 1e-300)));
            for (std::size_t k = 0; k < 3; ++k) c[k] = c[k] / 255 * h[k];
          }
        points.push_back(c);
      }
    const auto px = [&](double x) { return (x - west) / width * 1000; };
    const auto py = [&](double y) { return (north - y) / width * 1000; };
    std::string drawn;
    const auto ends = file_.read<double>("/members/end_position");
    const std::size_t count = ends.values.size() / 3, every = std::max<std::size_t>(1, count / most_points);
    for (std::size_t k = 0; k < count; k += every)
      if (const double x = ends.values[3 * k], y = ends.values[3 * k + 1];
          std::isfinite(x) && x > west && x < west + width && y < north && y > north - height)
        drawn += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.4\"/>", px(x), py(y));
    std::string lines;
    for (const PlanLine& l : ensemble_.lines())
      for (const auto& part : l.parts) {
        std::string path;
        for (const auto& p : part) path += fmt::format("{:.1f},{:.1f} ", px(p.x()), py(p.y()));
        const auto& middle = part[part.size() / 2];
        lines += fmt::format(
            "<polyline points=\"{}\"/><text x=\"{:.1f}\" y=\"{:.1f}\" stroke=\"none\" fill=\"#0b3c8c\" "
            "font-size=\"28\">{}</text>",
            path, std::clamp(px(middle.x()) + 6, 0.0, 900.0), py(middle.y()) - 8, io::xml_text(l.name));
      }
    std::string struck;
    for (const std::string& structure : ensemble_.structures()) {
      const auto at = file_.read<double>("/hits/" + structure + "/point").values;
      for (std::size_t k = 0; k + 2 < at.size() && k < 3 * most_points; k += 3)
        struck += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"9\" height=\"9\"/>", px(at[k]) - 4.5,
                              py(at[k + 1]) - 4.5);
    }
    for (const std::vector<talus::Member>& parts : ensemble_.structure_members())
      for (const talus::Member& part : parts)
        if (!part.span && parts.size() > 1)
          struck += fmt::format(
              "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"20\" fill=\"#003b44\" stroke=\"#fff\" "
              "stroke-width=\"4\" paint-order=\"stroke\" text-anchor=\"middle\">{}</text>",
              px(part.base.x()), py(part.base.y()) + 26, io::xml_text(part.name));
    const double tall = height / width * 1000, bar = tick_of(width);
    return fmt::format(
        "<section><h2>{11}</h2><svg viewBox=\"0 0 1000 {0:.0f}\" class=\"map\" role=\"img\" "
        "aria-label=\"map: {11}\"><image href=\"data:image/bmp;base64,{1}\" width=\"1000\" "
        "height=\"{0:.0f}\" preserveAspectRatio=\"none\"/>"
        "<g fill=\"#14304f\" opacity=\"0.55\">{2}</g><g fill=\"#00a0b0\" stroke=\"#fff\" "
        "stroke-width=\"1.5\">{12}</g><g fill=\"none\" stroke=\"#0b3c8c\" stroke-width=\"4\">{3}</g>"
        "<line x1=\"20\" x2=\"{4:.0f}\" y1=\"{5:.0f}\" y2=\"{5:.0f}\" stroke=\"#000\" "
        "stroke-width=\"4\"/><text x=\"20\" y=\"{6:.0f}\" font-size=\"28\">{7:g} m</text></svg>"
        "<p class=\"key\">{13} of {8:g} m: <b><span style=\"background:#fff3b2\"></span>little</b> <b><span "
        "style=\"background:#7f001f\"></span>{9}{14}.</b> Dots: end points{15}. North is "
        "up.{10}</p></section>",
        tall, base64(bitmap(columns, rows, points)), drawn, lines, 20 + bar / width * 1000, tall - 20,
        tall - 30, bar, cell, number(Json(scale * most)),
        ensemble_.crs().empty() ? "" : " " + io::xml_text(ensemble_.crs().substr(0, 40)) + ".", title, struck,
        what, unit, struck.empty() ? "" : "; squares: hits");
  }

  /// Share of members that exceed a value, over the value.
  std::string exceedance(const std::string& label, std::vector<double> values, double members,
                         const Json& percentiles, double scale) const {
    std::sort(values.begin(), values.end());
    std::vector<std::pair<double, double>> curve;
    const double n = static_cast<double>(values.size());
    const std::size_t every = std::max<std::size_t>(1, values.size() / 400);
    for (std::size_t k = 0; k < values.size(); k += every)
      curve.emplace_back(values[k] * scale, (n - static_cast<double>(k)) / members);
    curve.emplace_back(values.back() * scale, 1 / members);
    Chart chart(label, "share of members above", 0, values.back() * scale * 1.05, 0,
                std::max(1e-6, n / members) * 1.05);
    chart.curve(curve, "var(--curve)");
    for (const char* p : {"p50", "p95"})
      if (percentiles[p]["value"].is_number()) chart.mark(percentiles[p]["value"].get<double>() * scale, p);
    return chart.svg();
  }

  std::string line(std::size_t l) {
    const Json& s = summary_["lines"][l];
    const std::string name = s.value("name", "");
    std::string text = "<h2>" + io::xml_text(name) + "</h2><p>" +
                       fmt::format("{} crossings. ", s.value("crossings", 0L)) +
                       "A member crosses with probability " + number(s["probability"]["value"]) + " (" +
                       number(s["probability"]["low"]) + " to " + number(s["probability"]["high"]) + ").</p>";
    if (s.value("crossings", 0L) == 0) return text;
    text +=
        "<table><tr><th scope=\"col\">largest of a member</th><th scope=\"col\">p50</th><th "
        "scope=\"col\">p90</th><th "
        "scope=\"col\">p95</th><th scope=\"col\">p99</th></tr>";
    const std::array<std::pair<const char*, double>, 3> units{std::pair{"kinetic energy, kJ", 1e-3},
                                                              std::pair{"speed, m/s", 1.0},
                                                              std::pair{"height of the centroid, m", 1.0}};
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      text += fmt::format("<tr><td>{}</td>", units[q].first);
      for (const char* p : {"p50", "p90", "p95", "p99"})
        text += "<td>" + estimate(s[quantities[q]][p], units[q].second) + "</td>";
      text += "</tr>";
    }
    text += "</table>";
    if (s.value("members", 0L) < enough_for(99))
      text += fmt::format(
          "<p>Of {} members. A 95th percentile is bounded by {} that cross, a 99th by {}; of fewer the "
          "interval has no upper end (\u201cor more\u201d).</p>",
          s.value("members", 0L), enough_for(95), enough_for(99));
    const std::string at = "/lines/" + name + "/";
    const auto member = file_.read<std::int64_t>(at + "member").values;
    const auto translational = file_.read<double>(at + "kinetic_translational").values,
               rotational = file_.read<double>(at + "kinetic_rotational").values,
               height = file_.read<double>(at + "height").values;
    std::map<std::int64_t, std::pair<double, double>> largest;
    for (std::size_t k = 0; k < member.size(); ++k) {
      if (!finished_.contains(member[k])) continue;
      auto [m, first] = largest.try_emplace(member[k], 0.0, -std::numeric_limits<double>::infinity());
      m->second.first = std::max(m->second.first, translational[k] + rotational[k]);
      if (std::isfinite(height[k])) m->second.second = std::max(m->second.second, height[k]);
    }
    std::vector<double> energies, heights;
    for (const auto& [m, v] : largest) {
      energies.push_back(v.first);
      if (std::isfinite(v.second)) heights.push_back(v.second);
    }
    const double members = static_cast<double>(finished_.size());
    text += "<div class=\"row\">" + exceedance("kinetic energy, kJ", energies, members, s["energy"], 1e-3);
    if (!heights.empty()) text += exceedance("height of the centroid, m", heights, members, s["height"], 1);
    text += fmt::format(
        "</div><p><small>The curves are of all {:.0f} members that have finished; p50 and p95 are of the {} "
        "that "
        "cross.</small></p>",
        members, energies.size());
    for (const Json& b : details_.value("barriers", Json::array())) {
      if (b.value("line", "") != name) continue;
      text +=
          "<h3>Barrier</h3><table><tr><th scope=\"col\">rule</th><th scope=\"col\" "
          "class=\"text\">from</th><th "
          "scope=\"col\">energy, kJ</th><th "
          "scope=\"col\">height, "
          "m</th><th scope=\"col\" class=\"text\">factors</th></tr>";
      for (const Json& v : b["values"]) {
        std::string factors;
        for (const auto& [key, value] : v["factors"].items())
          factors += (factors.empty() ? "" : ", ") + key + " " + number(value);
        text += "<tr><td>" + io::xml_text(v.value("standard", "")) + "</td><td class=\"text\">" +
                io::xml_text(v.value("from", "")) + "</td><td>" + number(v["energy"], 1e-3) + "</td><td>" +
                number(v["height"]) + "</td><td class=\"text\">" + io::xml_text(factors) + "</td></tr>";
      }
      text += "</table><p><small>" + io::xml_text(b.value("note", "")) + "</small></p>";
    }
    return text;
  }

  /// How many members hit which pier or span.
  std::string struck_by_parts(const std::string& structure) const {
    std::string text;
    for (const Json& s : summary_.value("structures", Json::array()))
      if (s.value("name", "") == structure)
        for (const Json& part : s.value("struck", Json::array()))
          text += fmt::format("{}{} by {}", text.empty() ? " " : ", ", io::xml_text(part.value("name", "")),
                              part.value("members", 0L));
    return text.empty() ? text : text + ".";
  }

  std::string hits(const std::string& structure) const {
    const std::string at = "/hits/" + structure + "/";
    const auto member = file_.read<std::int64_t>(at + "member").values;
    std::string text = "<h2>Hits on " + io::xml_text(structure) + "</h2>";
    if (member.empty()) return text + "<p>None.</p>";
    const auto time = file_.read<double>(at + "time").values, mass = file_.read<double>(at + "mass").values,
               velocity = file_.read<double>(at + "velocity").values,
               point = file_.read<double>(at + "point").values;
    const std::vector<std::string> struck =
        file_.exists(at + "struck") ? file_.read_texts(at + "struck") : std::vector<std::string>();
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t k = 0; k < member.size(); ++k)
      order.emplace_back(
          -0.5 * mass[k] * Vec3(velocity[3 * k], velocity[3 * k + 1], velocity[3 * k + 2]).squaredNorm(), k);
    std::sort(order.begin(), order.end());
    std::vector<std::int64_t> distinct = member;
    std::sort(distinct.begin(), distinct.end());
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    text += fmt::format(
        "<p>{} hits by {} of {} members.{} The strongest, with their places in coordinates of the "
        "scene:</p><table><tr><th scope=\"col\">member</th>{}<th "
        "scope=\"col\">time, "
        "s</th><th scope=\"col\">mass, t</th><th scope=\"col\">speed, m/s</th><th scope=\"col\">energy of "
        "translation, kJ</th><th scope=\"col\">at, m</th></tr>",
        member.size(), distinct.size(), file_.dims("/members/index")[0], struck_by_parts(structure),
        struck.empty() ? "" : "<th scope=\"col\" class=\"text\">struck</th>");
    for (std::size_t q = 0; q < std::min<std::size_t>(12, order.size()); ++q) {
      const std::size_t k = order[q].second;
      text += fmt::format(
          "<tr><td>{}</td>{}<td>{:.2f}</td><td>{:.3g}</td><td>{:.3g}</td><td>{:.0f}</"
          "td><td>{:.1f},&nbsp;{:.1f},&nbsp;"
          "{:.1f}</td></tr>",
          member[k], struck.empty() ? "" : "<td class=\"text\">" + io::xml_text(struck[k]) + "</td>", time[k],
          mass[k] / 1e3, std::sqrt(-2 * order[q].first / mass[k]), -order[q].first / 1e3, point[3 * k],
          point[3 * k + 1], point[3 * k + 2]);
    }
    return text + "</table>";
  }

  /// P(class or worse) of each member, where the structure has several.
  static std::string members_of(const Json& f) {
    const Json members = f.value("members", Json::array());
    if (members.size() < 2) return "";
    std::string text =
        "<table><tr><th scope=\"col\">member, P per event</th><th scope=\"col\">slight or worse</th><th "
        "scope=\"col\">moderate or worse</th><th scope=\"col\">severe "
        "or worse</th><th scope=\"col\">lost</th></tr>";
    for (const Json& m : members) {
      text += "<tr><td>" + io::xml_text(m.value("name", "")) + "</td>";
      for (const Json& p : m["per_event"]) text += "<td>" + estimate(p) + "</td>";
      text += "</tr>";
    }
    return text + "</table>";
  }

  /// Runs that could not be made, and why the first of them.
  static std::string failures_of(const Json& f) {
    const Json faults = f.value("faults", Json::array());
    if (faults.empty()) return "";
    return fmt::format("{} failed and {} left out; the first: {}", faults.size(),
                       faults.size() == 1 ? "is" : "are", io::xml_text(faults.front().get<std::string>()));
  }

  static std::string fragility(const Json& f) {
    std::string text = "<h2>Damage of " + io::xml_text(f.value("structure", "")) + "</h2><p>" +
                       fmt::format("{} coupled runs. ", f["runs"].value("done", 0)) + failures_of(f) + "</p>";
    if (const Json doubts = f.value("doubts", Json::array()); !doubts.empty()) {
      text += "<ul>";
      for (const Json& line : doubts) text += "<li>" + io::xml_text(line.get<std::string>()) + "</li>";
      text += "</ul>";
    }
    if (f["runs"].value("done", 0) == 0) return text;
    text += "<table><tr><th scope=\"col\">class of the worst member</th><th scope=\"col\">P per event</th>";
    text += f.contains("per_year") ? "<th scope=\"col\">P per year</th></tr>" : "</tr>";
    constexpr std::array names{"none", "slight", "moderate", "severe", "lost"};
    for (std::size_t k = 0; k < f["per_event"].size(); ++k) {
      text += fmt::format("<tr><td>{}{}</td><td>{}</td>", names[std::min<std::size_t>(4, k + 1)],
                          k + 2 < names.size() ? " or worse" : "", estimate(f["per_event"][k]));
      if (f.contains("per_year") && k < f["per_year"].size())
        text += "<td>" + estimate(f["per_year"][k]) + "</td>";
      text += "</tr>";
    }
    text += "</table>" + members_of(f);
    text += curves_of(f);
    if (f.contains("next_run") && f["next_run"].is_object())
      text += "<p>One more run narrows most: " + io::xml_text(f["next_run"].value("text", "")) + ".</p>";
    return text;
  }

  /// P(class or worse) over the energy of the hit, of the members for which a curve was fitted.
  static std::string curves_of(const Json& f) {
    constexpr std::array names{"slight or worse", "moderate or worse", "severe or worse", "lost"},
        colours{"#d99a1c", "#ee7b30", "#c8323c", "#8a3d78"};
    std::string charts;
    std::set<std::size_t> shown;
    std::map<std::string, std::string> sharing;  // names of the members that share the curves of their kind
    const std::string own = "on this member";
    for (const Json& m : f.value("members", Json::array()))
      if (const std::string hits = m["curves"].front().value("hits", ""); hits != own)
        sharing[hits] += (sharing[hits].empty() ? "" : ", ") + m.value("name", "");
    std::set<std::string> drawn;
    for (const Json& m : f.value("members", Json::array())) {
      double low = std::numeric_limits<double>::infinity(), high = 0;
      std::string hits;
      for (const Json& c : m["curves"])
        if (c.value("fitted", false) && c.value("reached", 0) > 0)
          low = std::min(low, c["energy"].front().get<double>()),
          high = std::max(high, c["energy"].back().get<double>()), hits = c.value("hits", "");
      if (!(high > 0) || (hits != own && !drawn.insert(hits).second)) continue;
      const auto decade = [](double joules) { return std::log10(joules / 1e3); };
      Chart chart(fmt::format("energy of hits {}, kJ", hits),
                  "P(class or worse), " + (hits == own ? m.value("name", "") : sharing[hits]), decade(low),
                  decade(high), 0, 1, Chart::Axis::decades);
      for (const Json& c : m["curves"]) {
        if (!c.value("fitted", false) || c.value("reached", 0) == 0) continue;
        const std::size_t k = std::min<std::size_t>(3, static_cast<std::size_t>(c.value("class", 1) - 1));
        shown.insert(k);
        std::vector<std::pair<double, double>> value, lower, upper;
        for (std::size_t q = 0; q < c["energy"].size(); ++q) {
          const double e = decade(c["energy"][q].get<double>());
          value.emplace_back(e, c["probability"][q].get<double>()),
              lower.emplace_back(e, c["low"][q].get<double>()),
              upper.emplace_back(e, c["high"][q].get<double>());
        }
        chart.band(lower, upper, colours[k]);
        chart.curve(value, colours[k]);
      }
      charts += chart.svg();
    }
    if (shown.empty())
      return "<p>No curve over the energy of the hit: that takes runs that reach a class and runs that do "
             "not.</p>";
    std::string legend;
    for (const std::size_t k : shown)
      legend += fmt::format("<b><span style=\"background:{}\"></span>{}</b> ", colours[k], names[k]);
    const std::string few =
        sharing.empty() ? "" : " Members with few runs of their own share those of their kind.";
    return "<p>Curves over the energy of the hit, with their 95 % bands." + few +
           " A class that all runs reach, or none, has no curve.</p><p class=\"key\">" + legend +
           "</p><div class=\"row\">" + charts + "</div>";
  }

  std::string notes() const {
    std::string text = "<h2>How well this is known</h2><ul>";
    for (const char* key : {"intervals", "percentiles", "probability", "limits"})
      text += fmt::format("<li>{}: {}</li>", key, io::xml_text(details_.value(key, "")));
    for (const Json& w : details_.value("warnings", Json::array()))
      text += "<li>" + io::xml_text(w.get<std::string>()) + "</li>";
    return text + "</ul>";
  }

  const Ensemble& ensemble_;
  fs::path directory_;
  io::Hdf5File file_;
  Json summary_, details_;
  std::vector<Json> fragility_;      // of each structure for which it was computed
  std::set<std::int64_t> finished_;  // members that the figures are of
};

}  // namespace

fs::path write_report(const Ensemble& ensemble, const fs::path& directory) {
  const fs::path page = directory / "report.html";
  try {
    io::write_file(page, Page(ensemble, directory).text(), false);
  } catch (const nlohmann::json::exception& error) {
    throw io::bad_json(directory / "summary.json", error, "run talus ensemble again");
  }
  return page;
}

}  // namespace talus::ensemble
