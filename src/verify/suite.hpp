/// Verification suites: each case is a scene run through the public path (scene text, Simulation, Sink) and
/// compared with a reference that owes nothing to this program.
///
/// A case may compare several quantities; each comparison is one CaseResult. A miss is reported as a miss
/// with its figure.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/simulation.hpp"

namespace talus::verify {

/// How a scene is stepped.
struct Method {
  enum class Kind { accuracy, step, paper } kind = Kind::accuracy;
  double value = 1e-3;  // relative accuracy, or step [s]
  static Method by_accuracy(double a) { return {Kind::accuracy, a}; }
  static Method fixed_step(double h) { return {Kind::step, h}; }
  static Method paper(double h) { return {Kind::paper, h}; }
  std::string name() const;  // "talus by accuracy", "talus fixed step", "dda-1988"
  std::string text() const;  // the same with its value
  std::string keys() const;  // lines of [simulation]
};

struct Solutions {
  long newton = 0, interior_point = 0, above_tolerance = 0, halved = 0, convex = 0;
};

struct CaseResult {
  std::string suite, id, title, method, quantity, reference, source, note;
  double expected = 0, measured = 0, error = 0, tolerance = 0;
  std::optional<double> order;  // of convergence
  double cpu = 0, wall = 0;     // [s], all runs that the figure took
  double energy_defect = 0;     // worst |ledger residual| / largest energy in motion
  double momentum_defect =
      0;  // worst relative defect of the interface or of free motion, where one is defined
  double worst_penetration = 0;  // [m]
  long steps = 0;
  Solutions solutions;
  bool available = true;  // false: the program cannot be asked this yet; counts as falling short
  bool judged = true;     // false: reported for comparison only (the 1988 scheme's defects)
  bool passed = false;
};

/// One point of a work-precision curve.
struct CurvePoint {
  std::string case_id, title, method;
  double parameter = 0, error = 0, cpu = 0;
  bool failed = false;
};

/// What one run gave.
struct Outcome {
  std::unique_ptr<sim::Simulation> simulation;
  std::vector<sim::HistoryRow> rows;
  std::vector<sim::ContactRow> structure_contacts;
  sim::RunResult result;
  double cpu = 0, wall = 0;
  bool ok() const { return result.exit_code == 0; }
  const sim::HistoryRow& last() const { return rows.back(); }
  /// Sum of the mean forces of the last step on block `b` from partner `a` (coupling::Partner::id) [N].
  Vec3 force_on(int b, std::uint64_t partner) const;
};

/// Runs a scene given as text; input errors propagate, numerical failures are in `result`.
Outcome run_scene(const std::string& toml);

class CaseRun;
struct Case {
  std::string suite, id, title, source;
  bool quick = true;
  std::function<void(CaseRun&)> body;
};

/// What a case's body writes to.
class CaseRun {
 public:
  CaseRun(const Case& c, std::vector<CaseResult>& out, std::vector<CurvePoint>& curves, bool quick)
      : case_(c), out_(out), curves_(curves), quick_(quick) {}
  Outcome run(const std::string& toml);
  void method(const Method& m) {
    method_ = m.text();
    paper_ = m.kind == Method::Kind::paper;
    reset();
  }
  /// For structures: the integrator or the law that is shown.
  void method(const std::string& text) {
    method_ = text;
    paper_ = false;
    reset();
  }
  bool quick() const { return quick_; }
  void reset() { totals_ = {}; }
  /// |measured - expected| / |expected| against tolerance.
  CaseResult& relative(const std::string& quantity, const std::string& reference, double expected,
                       double measured, double tolerance);
  CaseResult& absolute(const std::string& quantity, const std::string& reference, double expected,
                       double measured, double tolerance);
  /// A statement that is true or not.
  CaseResult& holds(const std::string& quantity, const std::string& reference, bool truth);
  void unavailable(const std::string& why);
  void failed(const std::string& why);
  void point(const Method& m, double error, const Outcome& o);
  void point(const std::string& method, double parameter, double error, const Outcome& o);
  void momentum(double defect) { totals_.momentum_defect = std::max(totals_.momentum_defect, defect); }
  double cpu() const { return totals_.cpu; }

 private:
  CaseResult& add(const std::string& quantity, const std::string& reference);
  const Case& case_;
  std::vector<CaseResult>& out_;
  std::vector<CurvePoint>& curves_;
  CaseResult totals_;
  std::string method_ = "talus";
  bool paper_ = false, quick_ = false;
};

/// All cases in a fixed order.
const std::vector<Case>& all_cases();
std::vector<Case> sliding_cases(), turning_cases(), pile_cases(), spring_cases(), law_cases(),
    comparison_cases(), stability_cases(), elastic_cases(), concrete_cases(), coupling_cases(),
    cushion_cases(), impact_stress_cases(), invariant_cases(), calibration_cases();

struct Report {
  std::vector<CaseResult> results;
  std::vector<CurvePoint> curves;
  bool passed() const;
};
/// `suite` empty: all. `progress` gets every result as it comes.
Report run_suites(const std::string& suite, bool quick,
                  const std::function<void(const CaseResult&)>& progress = {}, const std::string& only = {});

std::string table_line(const CaseResult& r);
std::string json(const Report& report);
/// Log-log plot of error against CPU time, one curve per method.
std::string svg_plot(const std::string& title, const std::vector<CurvePoint>& points);
/// The same as one page that opens offline: the tables, and the plots within.
std::string html(const Report& report);
/// Writes verify.json, verify.html, and one SVG per case with curves.
void write_report(const Report& report, const std::string& directory);

}  // namespace talus::verify
