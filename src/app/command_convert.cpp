#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "app/commands.hpp"
#include "app/tell.hpp"
#include "core/error.hpp"
#include "core/solid_mesh.hpp"
#include "geometry/mesh.hpp"
#include "geometry/raster.hpp"
#include "geometry/terrain.hpp"
#include "io/block_files.hpp"
#include "io/convert.hpp"
#include "io/files.hpp"
#include "io/gis_files.hpp"

namespace talus::app {

namespace {

bool is_hdf5(const std::string& path) { return path.ends_with(".h5") || path.ends_with(".hdf5"); }

bool is_raster(const std::string& path) {
  return path.ends_with(".asc") || path.ends_with(".tif") || path.ends_with(".tiff");
}

/// A grid as the terrain that a scene would make of it.
void raster_to_mesh(const std::string& in, const std::string& out) {
  const geometry::Terrain terrain = geometry::load_terrain(in);
  for (const Problem& warning : terrain.warnings) tell("{}\n", warning.str());
  geometry::Mesh mesh;
  mesh.vertices = terrain.surface.vertices;
  mesh.triangles = terrain.surface.triangles;
  geometry::write_mesh(out, mesh);
}

void convert_grid(const std::string& in, const std::string& out) {
  std::vector<Problem> warnings;
  geometry::convert_raster(in, out, warnings);
  for (const Problem& warning : warnings) tell("{}\n", warning.str());
}

/// "/maps/kinetic@2.5": the map of a quantity with cells of 2.5 m.
geometry::Raster map_of(const std::string& file, const std::string& part) {
  const std::size_t from = part.rfind('/') + 1, mark = part.find('@', from);
  double cell = 0;
  if (mark != std::string::npos) {
    const char* const end = part.data() + part.size();
    const auto [stop, status] = std::from_chars(part.data() + mark + 1, end, cell);
    if (status != std::errc{} || stop != end || !(cell > 0) || !std::isfinite(cell))
      throw io::bad_file(file, part, "the cell's size is no length",
                         "write /maps/kinetic@2.5 (metres), or leave it out");
  }
  return io::results_map(file, part.substr(from, mark == std::string::npos ? mark : mark - from), cell);
}

/// A mesh of volume cells as another such file, or its outside as a surface.
void convert_solid(const std::string& in, const std::string& out) {
  const SolidMesh solid = read_solid_mesh(in);
  if (solid.hexes.empty() && solid.tets.empty())
    throw InputError(Problem{.file = in,
                             .line = 0,
                             .column = 0,
                             .key = "mesh",
                             .value = "",
                             .rule = "the mesh has no hexahedra and no tetrahedra",
                             .remedy = "mesh the volume, and save all elements"});
  if (is_solid_mesh_file(out)) return io::write_file(out, solid_mesh_text(out, solid));
  geometry::Mesh mesh;
  std::vector<int> vertex(solid.nodes.size(), -1);
  for (std::array<int, 3> triangle : outer_triangles(solid)) {
    for (int& n : triangle) {
      if (vertex[n] < 0)
        vertex[n] = static_cast<int>(mesh.vertices.size()), mesh.vertices.push_back(solid.nodes[n]);
      n = vertex[n];
    }
    mesh.triangles.push_back(triangle);
  }
  geometry::write_mesh(out, mesh);
}

/// Tells what was changed and what is still wrong.
int repair_mesh(const std::string& in, const std::string& out) {
  geometry::RepairReport report;
  const geometry::Mesh mesh = geometry::repair(geometry::read_mesh(in), report);
  geometry::write_mesh(out, mesh);
  fmt::print("{} vertices welded, {} triangles dropped, {} turned{}, {} holes filled with {} triangles\n{}\n",
             report.vertices_welded, report.triangles_dropped, report.triangles_turned,
             report.turned_inside_out ? " (the surface was inside out)" : "", report.holes_filled,
             report.triangles_added, out);
  for (const Problem& problem : report.remaining) tell("{}\n", problem.str());
  return report.remaining.empty() ? done : fell_short;
}

}  // namespace

int command_convert(const Options& options) {
  const std::string &in = options.input, &out = options.output;
  const auto [file, given_part] = io::file_and_part(in);
  const std::string part = given_part.value_or("");
  constexpr std::string_view blocks = "/geometry/blocks";
  if (options.repair && !(geometry::is_mesh_file(in) && geometry::is_mesh_file(out)))
    throw InputError(Problem{.file = in,
                             .line = 0,
                             .column = 0,
                             .key = "--repair",
                             .value = out,
                             .rule = "repairs surface meshes only",
                             .remedy = "give IN and OUT as STL, OBJ, PLY, OFF or VTU"});
  std::error_code missing;
  if (std::filesystem::equivalent(file, out, missing))
    throw InputError(Problem{.file = in,
                             .line = 0,
                             .column = 0,
                             .key = "OUT",
                             .value = out,
                             .rule = "is the file that is read",
                             .remedy = "name another one: the original stays as it is"});
  if (options.repair) return repair_mesh(in, out);
  if (is_hdf5(file) && geometry::is_mesh_file(out) && part.starts_with(blocks) &&
      (part.size() == blocks.size() || part[blocks.size()] == '@'))
    geometry::write_mesh(
        out, io::read_blocks(file, part.size() > blocks.size() ? part.substr(blocks.size() + 1) : ""));
  else if (geometry::is_mesh_file(in) && is_hdf5(out))
    io::write_blocks(out, in);
  else if (geometry::is_mesh_file(in))
    geometry::write_mesh(out, geometry::read_mesh(in));
  else if (is_solid_mesh_file(in) && (is_solid_mesh_file(out) || geometry::is_mesh_file(out)))
    convert_solid(in, out);
  else if (is_hdf5(file) && is_raster(out) && part.starts_with("/maps/"))
    geometry::write_raster(out, map_of(file, part));
  else if (is_hdf5(file) && out.ends_with(".geojson") && (part.empty() || part == "/history/blocks"))
    io::write_file(out, io::tracks_geojson(file));
  else if (is_raster(in) && is_raster(out))
    convert_grid(in, out);
  else if (is_raster(in) && geometry::is_mesh_file(out))
    raster_to_mesh(in, out);
  else
    io::convert(in, out);
  fmt::print("{}\n", out);
  return done;
}

}  // namespace talus::app
