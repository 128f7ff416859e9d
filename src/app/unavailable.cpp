// Commands whose part of the program is not there yet: a clear error, never a silent nothing.
#include "app/commands.hpp"
#include "core/error.hpp"

namespace talus::app {
namespace {
[[noreturn]] void unavailable(const char* command) {
  Problem problem;
  problem.key = std::string("talus ") + command;
  problem.rule = "is not part of this build";
  problem.remedy = "see talus --help for what is";
  throw InputError(problem);
}
}  // namespace

int command_capacity(const Options&) { unavailable("capacity"); }

}  // namespace talus::app
