// verify.html: the table and the plots of a verification as one file that opens offline, dark or light as the
// reader's system is.
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "verify/suite.hpp"

namespace talus::verify {
namespace {

constexpr const char* style =
    ":root{color-scheme:light "
    "dark;--ink:#1d2127;--dim:#69727d;--back:#fff;--line:#d9dee4;--good:#217a45;--bad:#b3261e}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e8ebef;--dim:#9aa4b0;--back:#14171b;--line:#333a42;--"
    "good:#5fc98a;--bad:#ff8a80}}"
    "body{font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--back);margin:0 "
    "auto;max-width:1200px;padding:16px}"
    "h1{font-size:22px}h2{font-size:17px;margin:28px 0 8px}p{margin:4px "
    "0;color:var(--dim)}.wide{overflow-x:auto}"
    "table{border-collapse:collapse;font-size:13px;width:100%}th,td{text-align:left;padding:3px "
    "8px;border-bottom:1px solid var(--line);vertical-align:top}"
    "td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}.pass{color:var(--good)}."
    "short,.absent{color:var(--bad);font-weight:600}.differs{color:var(--dim)}"
    ".plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,480px),1fr));gap:12px}.plots "
    "svg{width:100%;height:auto;border-radius:6px}";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

const char* verdict(const CaseResult& r) {
  return !r.available ? "absent" : r.passed ? "pass" : r.judged ? "short" : "differs";
}

std::string number(double x, const char* format) {
  return std::isfinite(x) ? fmt::format(fmt::runtime(format), x) : std::string("&ndash;");
}

}  // namespace

std::string html(const Report& report) {
  std::map<std::string, int> count;
  std::vector<std::string> suites;
  for (const CaseResult& r : report.results) {
    ++count[verdict(r)];
    if (suites.empty() || suites.back() != r.suite) suites.push_back(r.suite);
  }
  std::string s = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>Talus "
      "verification</title><style>{}</style>\n<main><h1>Verification</h1>\n",
      style);
  s += fmt::format(
      "<p><b class=\"{}\">{}</b>: {} comparisons passed, {} fell short, {} not available, {} shown for "
      "comparison only.</p>\n",
      report.passed() ? "pass" : "short", report.passed() ? "Passed" : "Fell short", count["pass"],
      count["short"], count["absent"], count["differs"]);
  s += "<p>Every case is a scene run through the public path; errors are against closed forms or published "
       "values, never against a finer run where those exist.</p>\n";
  for (const std::string& suite : suites) {
    s += fmt::format(
        "<h2>{}</h2>\n<div "
        "class=\"wide\"><table><tr><th>result<th>case<th>quantity<th>method<th>expected<th>measured<th>error<"
        "th>"
        "allowed<th>order<th>CPU s<th>energy defect<th>reference</tr>\n",
        escaped(suite));
    for (const CaseResult& r : report.results) {
      if (r.suite != suite) continue;
      s += fmt::format(
          "<tr><td class=\"{0}\">{0}<td title=\"{1}\">{2}<td>{3}<td>{4}<td class=\"n\">{5}<td "
          "class=\"n\">{6}<td class=\"n\">{7}<td class=\"n\">{8}<td class=\"n\">{9}<td class=\"n\">{10}<td "
          "class=\"n\">{11}<td>{12}{13}</tr>\n",
          verdict(r), escaped(r.title), escaped(r.id), escaped(r.quantity), escaped(r.method),
          number(r.expected, "{:.8g}"), number(r.measured, "{:.8g}"), number(r.error, "{:.2e}"),
          number(r.tolerance, "{:.0e}"), r.order ? number(*r.order, "{:.2f}") : "", number(r.cpu, "{:.3g}"),
          number(r.energy_defect, "{:.1e}"), escaped(r.reference),
          r.note.empty() ? "" : "; " + escaped(r.note));
    }
    s += "</table></div>\n";
  }
  std::vector<std::string> drawn;
  for (const CurvePoint& p : report.curves) {
    if (!drawn.empty() && drawn.back() == p.case_id) continue;
    if (drawn.empty()) s += "<h2>Error against CPU time</h2>\n<div class=\"plots\">\n";
    drawn.push_back(p.case_id);
    std::vector<CurvePoint> own;
    for (const CurvePoint& q : report.curves)
      if (q.case_id == p.case_id) own.push_back(q);
    s += svg_plot(escaped(p.title), own);
  }
  return s + (drawn.empty() ? "" : "</div>\n") + "</main></html>\n";
}

}  // namespace talus::verify
