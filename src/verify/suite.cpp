#include "verify/suite.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "io/files.hpp"
#include "scene/scene.hpp"
#include "sim/world.hpp"

namespace talus::verify {
namespace {

class Keeper : public sim::Sink {
 public:
  explicit Keeper(Outcome& o) : o_(o) {}
  void history(const sim::HistoryRow& row) override { o_.rows.push_back(row); }
  void contacts(std::span<const sim::ContactRow> rows) override {
    o_.structure_contacts.insert(o_.structure_contacts.end(), rows.begin(), rows.end());
  }

 private:
  Outcome& o_;
};

double cpu_now() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

std::string Method::name() const {
  return kind == Kind::accuracy ? "talus by accuracy" : kind == Kind::step ? "talus fixed step" : "dda-1988";
}

std::string Method::text() const {
  if (kind == Kind::accuracy) return fmt::format("talus, accuracy {:g}", value);
  if (kind == Kind::step) return fmt::format("talus, step {:g} s", value);
  return fmt::format("dda-1988, step {:g} s", value);
}

std::string Method::keys() const {
  if (kind == Kind::accuracy) return fmt::format("accuracy = {:.17g}\n", value);
  return fmt::format("step = \"{:.17g} s\"\n{}", value, kind == Kind::paper ? "method = \"dda-1988\"\n" : "");
}

Vec3 Outcome::force_on(int b, std::uint64_t partner) const {
  Vec3 f = Vec3::Zero();
  for (const coupling::ContactMemory& m :
       simulation->world().system->state().contacts[static_cast<std::size_t>(simulation->world().placed(b))])
    if (m.partner == partner) f += m.force;
  return f;
}

Outcome run_scene(const std::string& toml) {
  Outcome o;
  const double start = cpu_now();
  const auto wall = std::chrono::steady_clock::now();
  o.simulation = std::make_unique<sim::Simulation>(scene::read_scene_text(toml, "/verify.toml"));
  Keeper keeper(o);
  o.result = o.simulation->run(keeper);
  o.cpu = cpu_now() - start;
  o.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  return o;
}

Outcome CaseRun::run(const std::string& toml) {
  Outcome o = run_scene(toml);
  totals_.cpu += o.cpu;
  totals_.wall += o.wall;
  const sim::RunCounters n = o.simulation->world().counters();
  totals_.steps += n.steps;
  totals_.worst_penetration = std::max(totals_.worst_penetration, n.worst_penetration);
  totals_.solutions.newton += n.newton_method;
  totals_.solutions.interior_point += n.interior_point;
  totals_.solutions.above_tolerance += n.above_tolerance;
  totals_.solutions.halved += n.halved;
  totals_.solutions.convex += n.convex;
  if (o.result.audit_made)
    totals_.momentum_defect = std::max(
        {totals_.momentum_defect, o.result.audit.worst_force_imbalance, o.result.audit.impulse_defect});
  double scale = 0, worst = 0;
  for (const sim::HistoryRow& r : o.rows) {
    scale = std::max({scale, r.ledger.kinetic, std::abs(r.ledger.potential - o.rows.front().ledger.potential),
                      r.ledger.strain});
    worst = std::max(worst, std::abs(r.ledger.residual));
  }
  if (scale > 0) totals_.energy_defect = std::max(totals_.energy_defect, worst / scale);
  if (!o.ok()) totals_.note = o.result.message;
  return o;
}

CaseResult& CaseRun::add(const std::string& quantity, const std::string& reference) {
  CaseResult r = totals_;
  r.suite = case_.suite;
  r.id = case_.id;
  r.title = case_.title;
  r.source = case_.source;
  r.method = method_;
  r.quantity = quantity;
  r.reference = reference;
  r.judged = !paper_;
  out_.push_back(std::move(r));
  return out_.back();
}

CaseResult& CaseRun::relative(const std::string& quantity, const std::string& reference, double expected,
                              double measured, double tolerance) {
  CaseResult& r = add(quantity, reference);
  r.expected = expected;
  r.measured = measured;
  r.error = std::abs(measured - expected) / std::abs(expected);
  r.tolerance = tolerance;
  // A figure for which Coulomb's law was replaced by the convex problem does not count.
  r.passed = r.error <= tolerance && (paper_ || r.solutions.convex == 0);
  return r;
}

CaseResult& CaseRun::absolute(const std::string& quantity, const std::string& reference, double expected,
                              double measured, double tolerance) {
  CaseResult& r = relative(quantity, reference, expected, measured, tolerance);
  r.error = std::abs(measured - expected);
  r.passed = r.error <= tolerance && (paper_ || r.solutions.convex == 0);
  return r;
}

CaseResult& CaseRun::holds(const std::string& quantity, const std::string& reference, bool truth) {
  return absolute(quantity, reference, 1, truth ? 1 : 0, 0);
}

void CaseRun::unavailable(const std::string& why) {
  CaseResult& r = add("not available", why);
  r.available = r.passed = false;
  r.note = why;
}

void CaseRun::failed(const std::string& why) {
  CaseResult& r = add("run", "runs to its end");
  r.expected = 1;
  r.error = 1;
  r.note = why;
}

void CaseRun::point(const Method& m, double error, const Outcome& o) { point(m.name(), m.value, error, o); }

void CaseRun::point(const std::string& method, double parameter, double error, const Outcome& o) {
  curves_.push_back(
      {case_.id, case_.title, method, parameter, error, o.cpu, !o.ok() || !std::isfinite(error)});
}

const std::vector<Case>& all_cases() {
  static const std::vector<Case> cases = [] {
    std::vector<Case> all;
    for (const auto& group :
         {sliding_cases, turning_cases, pile_cases, spring_cases, law_cases, comparison_cases,
          stability_cases, elastic_cases, concrete_cases, coupling_cases, cushion_cases, impact_stress_cases,
          invariant_cases, calibration_cases})
      for (Case& c : group()) all.push_back(std::move(c));
    return all;
  }();
  return cases;
}

bool Report::passed() const {
  return std::all_of(results.begin(), results.end(),
                     [](const CaseResult& r) { return r.passed || !r.judged; });
}

Report run_suites(const std::string& suite, bool quick,
                  const std::function<void(const CaseResult&)>& progress, const std::string& only) {
  Report report;
  for (const Case& c : all_cases()) {
    if (!suite.empty() && c.suite != suite) continue;
    if (!only.empty() && c.id != only) continue;
    if (quick && !c.quick) continue;
    const std::size_t before = report.results.size();
    CaseRun run(c, report.results, report.curves, quick);
    try {
      c.body(run);
    } catch (const std::exception& e) { run.failed(e.what()); }
    if (progress)
      for (std::size_t i = before; i < report.results.size(); ++i) progress(report.results[i]);
  }
  return report;
}

std::string table_line(const CaseResult& r) {
  const char* verdict = !r.available ? "absent" : r.passed ? "pass" : r.judged ? "SHORT" : "differs";
  std::string line =
      fmt::format("{:<7} {:<6} {:<24} {:<44} {:>14.8g} {:>14.8g} {:>9.2e} {:>8.1e} {:>8.3f}", verdict, r.id,
                  r.method, r.quantity.substr(0, 44), r.expected, r.measured, r.error, r.tolerance, r.cpu);
  if (r.order) line += fmt::format("  order {:.2f}", *r.order);
  if (r.solutions.convex > 0 && r.judged)
    line += fmt::format("  convex problem instead of Coulomb's {} times", r.solutions.convex);
  if (!r.note.empty()) line += "  " + r.note.substr(0, 400);
  return line;
}

std::string json(const Report& report) {
  nlohmann::ordered_json out;
  out["schema"] = 1;
  out["passed"] = report.passed();
  out["results"] = nlohmann::ordered_json::array();
  const auto finite = [](double x) -> nlohmann::ordered_json {
    return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr);
  };
  for (const CaseResult& r : report.results) {
    nlohmann::ordered_json j;
    j["suite"] = r.suite;
    j["id"] = r.id;
    j["title"] = r.title;
    j["method"] = r.method;
    j["quantity"] = r.quantity;
    j["reference"] = r.reference;
    j["source"] = r.source;
    j["expected"] = finite(r.expected);
    j["measured"] = finite(r.measured);
    j["error"] = finite(r.error);
    j["tolerance"] = finite(r.tolerance);
    j["order"] = r.order ? finite(*r.order) : nullptr;
    j["cpu_seconds"] = r.cpu;
    j["wall_seconds"] = r.wall;
    j["energy_defect"] = finite(r.energy_defect);
    j["momentum_defect"] = finite(r.momentum_defect);
    j["worst_penetration"] = finite(r.worst_penetration);
    j["steps"] = r.steps;
    j["solutions"] = {{"newton", r.solutions.newton},
                      {"interior_point", r.solutions.interior_point},
                      {"above_tolerance", r.solutions.above_tolerance},
                      {"halved", r.solutions.halved},
                      {"convex", r.solutions.convex}};
    j["available"] = r.available;
    j["judged"] = r.judged;
    j["passed"] = r.passed;
    j["note"] = r.note;
    out["results"].push_back(std::move(j));
  }
  out["curves"] = nlohmann::ordered_json::array();
  for (const CurvePoint& p : report.curves)
    out["curves"].push_back({{"id", p.case_id},
                             {"title", p.title},
                             {"method", p.method},
                             {"parameter", p.parameter},
                             {"error", finite(p.error)},
                             {"cpu_seconds", p.cpu},
                             {"failed", p.failed}});
  return out.dump(1) + "\n";
}

void write_report(const Report& report, const std::string& directory) {
  const std::filesystem::path to = directory;
  std::filesystem::create_directories(to);
  io::write_file(to / "verify.json", json(report), false);
  io::write_file(to / "verify.html", html(report), false);
  std::vector<std::string> done;
  for (const CurvePoint& p : report.curves) {
    if (std::find(done.begin(), done.end(), p.case_id) != done.end()) continue;
    done.push_back(p.case_id);
    std::vector<CurvePoint> mine;
    for (const CurvePoint& q : report.curves)
      if (q.case_id == p.case_id) mine.push_back(q);
    io::write_file(to / (p.case_id + ".svg"), svg_plot(p.title, mine), false);
  }
}

}  // namespace talus::verify
