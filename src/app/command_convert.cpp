#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/mesh.hpp"
#include "io/convert.hpp"

namespace talus::app {

int command_convert(const Options& options) {
  // Surface meshes are geometry's, everything else is a part of a results file.
  if (geometry::is_mesh_file(options.input) && options.input.find('#') == std::string::npos) geometry::write_mesh(options.output, geometry::read_mesh(options.input));
  else io::convert(options.input, options.output);
  fmt::print("{}\n", options.output);
  return done;
}

}  // namespace talus::app
