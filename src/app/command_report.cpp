#include <fmt/format.h>

#include "app/commands.hpp"
#include "io/report.hpp"

namespace talus::app {

int command_report(const Options& options) {
  fmt::print("{}\n", io::write_report(options.input).string());
  return done;
}

}  // namespace talus::app
