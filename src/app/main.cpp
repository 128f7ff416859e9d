// talus: reads the command line, calls one command, turns failures into exit codes.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <map>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "io/files.hpp"

namespace talus::app {
namespace {

int complain(const std::string& text, int code) {
  std::fflush(stdout);
  fmt::print(stderr, "{}{}", text, text.empty() || text.back() != '\n' ? "\n" : "");
  return code;
}

/// Several ranks would all write the same files.
void one_rank_only() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    const char* ranks = std::getenv(name);
    if (!ranks || std::atoi(ranks) <= 1) continue;
    Problem problem;
    problem.key = name;
    problem.value = ranks;
    problem.rule = "talus runs on one rank; structures are not divided over ranks";
    problem.remedy = "start it without mpirun, or with mpirun -n 1";
    throw InputError(problem);
  }
}

int dispatch(const CLI::App& cli, const Options& options) {
  static const std::map<std::string, int (*)(const Options&)> commands{
      {"run", command_run},         {"check", command_check},   {"cut", command_cut},         {"impact", command_impact},
      {"capacity", command_capacity}, {"verify", command_verify}, {"formulas", command_formulas}, {"report", command_report},
      {"convert", command_convert}, {"explain", command_explain}};
  one_rank_only();
  const auto called = cli.get_subcommands();
  const std::string name = called.empty() ? std::string() : called.front()->get_name();
  if (name == "ensemble") {
    Problem problem;
    problem.key = "talus ensemble";
    problem.rule = "is planned, not yet there";
    problem.remedy = "run the members one by one with talus run --set";
    throw InputError(problem);
  }
  const auto found = commands.find(name);
  if (found == commands.end()) return complain(cli.help(), bad_input);
  return found->second(options);
}

int run(int argc, char** argv) {
  Options options;
  const auto cli = make_cli(options);
  try {
    cli->parse(argc, argv);
  } catch (const CLI::CallForVersion&) {
    fmt::print("talus {}\n", TALUS_VERSION);
    return done;
  } catch (const CLI::CallForHelp&) {
    const auto called = cli->get_subcommands();
    fmt::print("{}", called.empty() ? cli->help() : called.front()->help());
    return done;
  } catch (const CLI::CallForAllHelp&) {
    fmt::print("{}", cli->help("", CLI::AppFormatMode::All));
    return done;
  } catch (const CLI::ParseError& error) {
    return complain(fmt::format("talus: error: {}; see talus --help", error.what()), bad_input);
  }
  if (options.man) {
    fmt::print("{}", man_page(*cli));
    return done;
  }
  if (const auto* shell = cli->get_option("--completion"); shell->count() > 0) {
    fmt::print("{}", completion(*cli, shell->as<std::string>()));
    return done;
  }
  return dispatch(*cli, options);
}

}  // namespace
}  // namespace talus::app

int main(int argc, char** argv) {
  using namespace talus;
  std::signal(SIGXFSZ, SIG_IGN);   // a file-size limit is a write error with a message, not a death
  try {
    return app::run(argc, argv);
  } catch (const InputError& error) {
    std::string text;
    for (const Problem& problem : error.problems()) text += problem.str() + "\n";
    const auto n = error.problems().size();
    if (n > 1) text += fmt::format("{} problems; nothing was written\n", n);
    return app::complain(text, app::bad_input);
  } catch (const NumericalFailure& error) {
    return app::complain(fmt::format("talus: {}", error.what()), app::numerical_failure);
  } catch (const io::WriteError& error) {
    return app::complain(fmt::format("talus: {}; when it can be written again, go on with --resume", error.what()), app::numerical_failure);
  } catch (const std::bad_alloc&) {
    return app::complain("talus: not enough memory; talus check tells how much the scene needs", app::numerical_failure);
  } catch (const std::exception& error) {
    return app::complain(fmt::format("talus: internal error: {}", error.what()), app::numerical_failure);
  }
}
