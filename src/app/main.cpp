// talus: reads the command line, calls one command, turns failures into exit codes.
#include <fcntl.h>
#include <malloc.h>
#include <algorithm>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <map>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/signals.hpp"
#include "app/tell.hpp"
#include "app/together.hpp"
#include "core/suggest.hpp"
#include "io/files.hpp"

namespace talus::app {
namespace {

int dispatch(const CLI::App& cli, const Options& options) {
  static const std::map<std::string, int (*)(const Options&)> commands{
      {"run", command_run},           {"check", command_check},        {"cut", command_cut},
      {"impact", command_impact},     {"capacity", command_capacity},  {"verify", command_verify},
      {"formulas", command_formulas}, {"report", command_report},      {"convert", command_convert},
      {"explain", command_explain},   {"ensemble", command_ensemble},  {"fragility", command_fragility},
      {"compare", command_compare},   {"calibrate", command_calibrate}};
  const auto called = cli.get_subcommands();
  const std::string name = called.empty() ? std::string() : called.front()->get_name();
  const auto found = commands.find(name);
  if (found == commands.end()) {
    tell("{}", cli.help());
    return bad_input;
  }
  require_one_rank(name);
  return found->second(options);
}

/// Arrays of megabytes are allocated in the heap from the start, which is not trimmed in between and grows by
/// megabytes: pages once mapped serve the next array. glibc comes to the same two thresholds by itself, one
/// freed array at a time.
void keep_pages() {
#ifdef __GLIBC__
  constexpr int mebibyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * mebibyte);
  mallopt(M_TRIM_THRESHOLD, 64 * mebibyte);
  mallopt(M_TOP_PAD, 4 * mebibyte);
#endif
}

/// Of the three standard streams those that are closed: else the next file takes their number, and words end
/// in it.
void open_closed_streams() {
  for (int fd = 0; fd <= 2; ++fd)
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", fd == 0 ? O_RDONLY : O_WRONLY) < 0) std::abort();
}

/// What was printed stands in a buffer until here: a full disk under `talus check SCENE > plan.txt` shows
/// now.
void flush_output() {
  if (std::fflush(stdout) != 0)
    throw std::system_error(errno, std::generic_category(), "the standard output cannot be written");
}

/// What to say of a first word that is no command; empty if it is one, or an option.
std::string unknown_command(const CLI::App& cli, const std::string& word) {
  if (word.empty() || word.starts_with('-')) return {};
  std::vector<std::string> names;
  for (const CLI::App* command : cli.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  if (std::find(names.begin(), names.end(), word) != names.end()) return {};
  const std::string near = nearest_name(word, names);
  return fmt::format("there is no command \"{}\"; {}", word,
                     !near.empty() ? fmt::format("did you mean \"{}\"?", near)
                     : word.ends_with(".toml")
                         ? fmt::format("a command comes before the scene, for example talus run {}", word)
                         : fmt::format("the commands are {}", fmt::join(names, ", ")));
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
    const std::string unknown = unknown_command(*cli, argc > 1 ? argv[1] : "");
    tell("talus: error: {}; see talus --help\n", unknown.empty() ? error.what() : unknown);
    return bad_input;
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
  app::open_closed_streams();
  app::keep_pages();
  app::watch_signals();
  std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is a write error with a message, not a death
  std::string text;
  int code = app::numerical_failure;
  try {
    app::start_together();
    const int ended = app::run(argc, argv);
    app::flush_output();
    return app::end_together("", ended, false);
  } catch (const InputError& error) {
    for (const Problem& problem : error.problems()) text += problem.str() + "\n";
    const auto& all = error.problems();
    const auto errors = std::count_if(
        all.begin(), all.end(), [](const Problem& p) { return p.severity == Problem::Severity::error; });
    const auto warnings = static_cast<std::ptrdiff_t>(all.size()) - errors;
    if (all.size() > 1)
      text +=
          fmt::format("{} error{}{}; nothing was written\n", errors, errors == 1 ? "" : "s",
                      warnings == 0 ? "" : fmt::format(", {} warning{}", warnings, warnings == 1 ? "" : "s"));
    code = app::bad_input;
  } catch (const NumericalFailure& error) {
    text = fmt::format("talus: {}", error.what());
  } catch (const io::WriteError& error) {
    const std::string_view command = argc > 1 ? argv[1] : "";
    const bool resumes = command == "run" || command == "impact" || command == "ensemble";
    text = fmt::format(
        "talus: {}; {}", error.what(),
        resumes ? "when it can be written again, go on with --resume" : "make room, or name another place");
  } catch (const std::system_error& error) {  // of the standard output
    text = fmt::format("talus: cannot go on: {}", error.what());
  } catch (const std::bad_alloc&) {
    text = "talus: not enough memory; talus check reports how much the scene needs";
  } catch (const std::exception& error) { text = fmt::format("talus: internal error: {}", error.what()); }
  return app::end_together(text, code, true);
}
