#include <fmt/format.h>

#include "app/commands.hpp"
#include "contact/tolerances.hpp"
#include "core/error.hpp"
#include "scene/keys.hpp"

namespace talus::app {

int command_explain(const Options& options) {
  if (options.tolerances) {
    fmt::print("{}", contact::tolerances_markdown());
    return done;
  }
  if (options.all) {
    if (options.markdown) {
      fmt::print("{}", scene::scene_markdown());
      return done;
    }
    for (const scene::Key& key : scene::keys()) fmt::print("{:<44} {}\n", key.path, scene::type_text(key));
    return done;
  }
  if (options.input.empty()) {
    Problem problem;
    problem.key = "talus explain";
    problem.rule = "needs a key";
    problem.remedy = "talus explain block.size, or talus explain --all";
    throw InputError(problem);
  }
  fmt::print("{}", scene::explain(options.input));
  return done;
}

}  // namespace talus::app
