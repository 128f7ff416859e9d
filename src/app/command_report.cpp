#include <filesystem>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "ensemble/report.hpp"
#include "ensemble/results.hpp"
#include "io/files.hpp"
#include "io/report.hpp"

namespace talus::app {

int command_report(const Options& options) {
  io::require_idle(options.input);
  const std::filesystem::path directory = options.input;
  if (std::filesystem::exists(directory / "ensemble.h5") ||
      std::filesystem::is_directory(directory / "journal")) {
    ensemble::require_finished(directory);
    const ensemble::Ensemble ensemble((directory / "scene.toml").string(), {});
    fmt::print("{}\n", ensemble::write_report(ensemble, directory).string());
    return done;
  }
  fmt::print("{}\n", io::write_report(directory).string());
  return done;
}

}  // namespace talus::app
