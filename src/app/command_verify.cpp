// talus verify: the suites, a line per comparison, verify.json and plots.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/signals.hpp"
#include "core/error.hpp"
#include "verify/structure_text.hpp"
#include "verify/suite.hpp"

namespace talus::app {
namespace {

/// Suites take minutes: a directory that cannot be written is refused before them.
void make_writable(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!error && access(directory.c_str(), W_OK) != 0) error = {errno, std::generic_category()};
  if (!error) return;
  Problem problem;
  problem.key = "output directory";
  problem.value = directory;
  problem.rule = "cannot be written: " + error.message();
  problem.remedy = "name another directory with -o";
  throw InputError(problem);
}

}  // namespace

int command_verify(const Options& options) {
  // SUITE or SUITE/CASE.
  std::string suite = options.input, only;
  if (const auto slash = suite.find('/'); slash != std::string::npos) {
    only = suite.substr(slash + 1);
    suite.resize(slash);
  }
  const bool known = suite.empty() || std::ranges::find(verify_suites, suite) != std::end(verify_suites);
  bool found = only.empty();
  for (const verify::Case& c : verify::all_cases()) found = found || (c.suite == suite && c.id == only);
  if (!known || !found) {
    Problem problem;
    problem.key = "SUITE";
    problem.value = options.input;
    problem.rule = known ? "names no case of its suite"
                         : "must be dda, fem, coupling, stability or invariants, or SUITE/CASE";
    problem.remedy = "leave it out to run all";
    throw InputError(problem);
  }
  if (!options.output.empty()) make_writable(options.output);
  before_end(verify::remove_temporary);
  fmt::print("{:<7} {:<6} {:<24} {:<44} {:>14} {:>14} {:>9} {:>8} {:>8}\n", "", "case", "method", "quantity",
             "expected", "measured", "error", "allowed", "CPU s");
  const verify::Report report = verify::run_suites(
      suite, options.quick,
      [](const verify::CaseResult& r) {
        fmt::print("{}\n", verify::table_line(r));
        std::fflush(stdout);
      },
      only);
  if (report.results.empty()) {
    Problem problem;
    problem.key = "--quick";
    problem.value = options.input;
    problem.rule = "leaves nothing of it: none of these cases has a quick version";
    problem.remedy = "run it without --quick";
    throw InputError(problem);
  }
  int passed = 0, fell_short = 0, absent = 0, compared = 0;
  for (const verify::CaseResult& r : report.results)
    ++(!r.available ? absent : r.passed ? passed : r.judged ? fell_short : compared);
  fmt::print("{} passed, {} fell short, {} not available, {} shown for comparison\n", passed, fell_short,
             absent, compared);
  if (!options.output.empty()) {
    verify::write_report(report, options.output);
    fmt::print("wrote {0}/verify.html and verify.json{1}\n", options.output,
               report.curves.empty() ? "" : ", and the plots");
  }
  return report.passed() ? 0 : 1;
}

}  // namespace talus::app
