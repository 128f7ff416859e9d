#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/mesh.hpp"
#include "io/block_files.hpp"
#include "io/convert.hpp"

namespace talus::app {

namespace {

bool is_hdf5(const std::string& path) { return path.ends_with(".h5") || path.ends_with(".hdf5"); }

}  // namespace

int command_convert(const Options& options) {
  const std::string &in = options.input, &out = options.output;
  const std::size_t hash = in.find('#');
  const std::string file = in.substr(0, hash), part = hash == std::string::npos ? "" : in.substr(hash + 1);
  constexpr std::string_view blocks = "/geometry/blocks";
  if (is_hdf5(file) && geometry::is_mesh_file(out) && part.starts_with(blocks) && (part.size() == blocks.size() || part[blocks.size()] == '@'))
    geometry::write_mesh(out, io::read_blocks(file, part.size() > blocks.size() ? part.substr(blocks.size() + 1) : ""));
  else if (geometry::is_mesh_file(in) && is_hdf5(out)) io::write_blocks(out, in);
  else if (geometry::is_mesh_file(in)) geometry::write_mesh(out, geometry::read_mesh(in));
  else io::convert(in, out);
  fmt::print("{}\n", out);
  return done;
}

}  // namespace talus::app
