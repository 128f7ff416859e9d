#include "io/block_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "geometry/block_output.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"
#include "io/results.hpp"
#include "sim/frame.hpp"

namespace talus::io {
namespace {

std::size_t history_row(const std::filesystem::path& file, const std::vector<double>& time,
                        const std::string& when) {
  if (time.empty()) throw bad_file(file, "/history/time", "has no rows", "run the scene again");
  if (when.empty()) return 0;
  if (when == "end") return time.size() - 1;
  double t = 0;
  const auto [end, status] = std::from_chars(when.data(), when.data() + when.size(), t);
  if (status != std::errc{} || end != when.data() + when.size())
    throw bad_file(file, "@" + when, "is no time", "write @12.5 (seconds) or @end");
  const double rounding = 1e-6 * (time.back() - time.front());
  if (!(t >= time.front() - rounding && t <= time.back() + rounding))
    throw bad_file(file, "@" + when, "is not a time of the run",
                   fmt::format("name one from {:g} to {:g} s, or @end", time.front(), time.back()));
  const auto nearest = std::min_element(
      time.begin(), time.end(), [&](double a, double b) { return std::abs(a - t) < std::abs(b - t); });
  return static_cast<std::size_t>(nearest - time.begin());
}

}  // namespace

geometry::Mesh read_blocks(const std::filesystem::path& results, const std::string& when) {
  const Hdf5File file = Hdf5File::open(results);
  const std::string g = "/geometry/blocks/";
  for (const std::string& path : {g + "triangles", std::string("/history/blocks/position")})
    if (!file.exists(path))
      throw bad_file(results, path, "there are no blocks in it",
                     "name a results.h5 of a run, or a file that `talus convert` has written");
  const auto vertices = file.read<double>(g + "vertices").values,
             time = file.read<double>("/history/time").values;
  const auto triangles = file.read<std::int32_t>(g + "triangles").values;
  const auto first_vertex = file.read<std::int64_t>(g + "vertex_offset").values,
             first_triangle = file.read<std::int64_t>(g + "triangle_offset").values;
  const std::size_t row = history_row(results, time, when);
  const auto position = file.read_rows<double>("/history/blocks/position", row, 1).values,
             orientation = file.read_rows<double>("/history/blocks/orientation", row, 1).values;
  geometry::Mesh mesh;
  mesh.group_names = file.read_texts("/history/blocks/name");
  for (std::size_t b = 0; b + 1 < first_vertex.size(); ++b) {
    const Vec3 c(position[3 * b], position[3 * b + 1], position[3 * b + 2]);
    if (!c.allFinite()) continue;
    const Quat q(orientation[4 * b], orientation[4 * b + 1], orientation[4 * b + 2], orientation[4 * b + 3]);
    const auto shift = static_cast<std::int64_t>(mesh.vertices.size()) - first_vertex[b];
    for (auto v = static_cast<std::size_t>(first_vertex[b]);
         v < static_cast<std::size_t>(first_vertex[b + 1]); ++v)
      mesh.vertices.push_back(c + q * Vec3(vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]));
    for (auto t = static_cast<std::size_t>(first_triangle[b]);
         t < static_cast<std::size_t>(first_triangle[b + 1]); ++t) {
      std::array<int, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) corners[k] = static_cast<int>(triangles[3 * t + k] + shift);
      mesh.triangles.push_back(corners);
      mesh.group.push_back(static_cast<int>(b));
    }
  }
  return mesh;
}

void write_blocks(const std::filesystem::path& path, const std::string& mesh_file) {
  sim::RunHeader header;
  std::vector<double> position, orientation;
  for (geometry::NamedBlock& b : geometry::read_block_system(mesh_file)) {
    position.insert(position.end(), b.centroid.data(), b.centroid.data() + 3);
    orientation.insert(orientation.end(), {1.0, 0.0, 0.0, 0.0});
    header.blocks.push_back({b.name, 0, b.volume, false, false, std::move(b.body)});
  }
  const std::size_t n = header.blocks.size();
  PartFile part(path);
  Hdf5File file = Hdf5File::create(part.path());
  write_geometry(file, header);
  file.write<double>("/history/time", std::vector<double>{0}, {1}, "s", "time");
  file.write<double>("/history/blocks/position", position, {1, n, 3}, "m", "centroid");
  file.write<double>("/history/blocks/orientation", orientation, {1, n, 4}, "1",
                     "quaternion w, x, y, z, body to world");
  file.close();
  part.swap_in();
}

}  // namespace talus::io
