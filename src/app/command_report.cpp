#include <fmt/format.h>

#include "app/commands.hpp"
#include "io/files.hpp"
#include "io/report.hpp"

namespace talus::app {

int command_report(const Options& options) {
  io::require_idle(options.input);
  fmt::print("{}\n", io::write_report(options.input).string());
  return done;
}

}  // namespace talus::app
