#include "io/vtu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "io/files.hpp"
#include "io/xml.hpp"

namespace talus::io {
namespace {

constexpr std::uint8_t vtk_triangle = 5, vtk_line = 3, vtk_hexahedron = 12, vtk_polyhedron = 42;

template <class T>
constexpr const char* vtk_type();
template <>
constexpr const char* vtk_type<double>() {
  return "Float64";
}
template <>
constexpr const char* vtk_type<float>() {
  return "Float32";
}
template <>
constexpr const char* vtk_type<std::int32_t>() {
  return "Int32";
}
template <>
constexpr const char* vtk_type<std::int64_t>() {
  return "Int64";
}
template <>
constexpr const char* vtk_type<std::uint8_t>() {
  return "UInt8";
}

/// Collects arrays into the appended section while the XML before it refers to their offsets.
class VtuFile {
 public:
  template <class T>
  std::string array(const std::string& name, const std::vector<T>& values, int components = 1) {
    const std::string xml = fmt::format(
        "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        vtk_type<T>(), name, components, offset_);
    const std::uint64_t bytes = values.size() * sizeof(T);
    appended_.emplace_back(reinterpret_cast<const char*>(&bytes), sizeof bytes);
    appended_.emplace_back(reinterpret_cast<const char*>(values.data()), bytes);
    offset_ += sizeof bytes + bytes;
    return xml;
  }
  void save(const std::filesystem::path& path, std::size_t points, std::size_t cells,
            const std::string& point_data, const std::string& cell_data, const std::string& point_array,
            const std::string& cell_arrays) const {
    const std::string head = fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        "  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n"
        "      <PointData>\n{}      </PointData>\n      <CellData>\n{}      </CellData>\n"
        "      <Points>\n{}      </Points>\n      <Cells>\n{}      </Cells>\n"
        "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_",
        points, cells, point_data, cell_data, point_array, cell_arrays);
    std::vector<std::string_view> pieces{head};
    pieces.insert(pieces.end(), appended_.begin(), appended_.end());
    pieces.push_back("\n  </AppendedData>\n</VTKFile>\n");
    write_file(path, pieces, false);
  }

 private:
  std::vector<std::string> appended_;  // each array and its length: a large surface is not copied as it grows
  std::uint64_t offset_ = 0;
};

template <class T>
std::vector<T> flat(std::span<const Vec3> v) {
  std::vector<T> out;
  out.reserve(3 * v.size());
  for (const Vec3& p : v)
    for (int k = 0; k < 3; ++k) out.push_back(static_cast<T>(p[k]));
  return out;
}
std::vector<float> narrow(const std::vector<double>& v) { return {v.begin(), v.end()}; }

/// Cells of one kind with a fixed number of nodes.
template <std::size_t N>
std::string uniform_cells(VtuFile& file, const std::vector<std::array<int, N>>& cells, std::uint8_t type) {
  std::vector<std::int64_t> numbers;
  numbers.reserve(N * cells.size());
  for (const auto& c : cells) numbers.insert(numbers.end(), c.begin(), c.end());
  const std::string connectivity = file.array("connectivity", numbers);
  numbers.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) numbers[i] = static_cast<std::int64_t>(N * (i + 1));
  return connectivity + file.array("offsets", numbers) +
         file.array("types", std::vector<std::uint8_t>(cells.size(), type));
}

}  // namespace

void write_blocks_vtu(const std::filesystem::path& path, std::span<const sim::RunHeader::BlockInfo> blocks,
                      std::span<const Pose> poses, std::span<const Vec3> start, const sim::HistoryRow* row) {
  VtuFile file;
  const std::size_t n = std::min(blocks.size(), poses.size());
  std::vector<Vec3> points;
  std::vector<std::int64_t> connectivity, offsets, faces, face_offsets;
  std::vector<std::int32_t> index;
  std::vector<Vec3> displacement, velocity;
  std::vector<float> speed, kinetic;
  for (std::size_t i = 0; i < n; ++i) {
    if (!poses[i].c.allFinite()) continue;
    const Polyhedron& shape = blocks[i].shape;
    const auto first = static_cast<std::int64_t>(points.size());
    for (const Vec3& X : shape.vertices) points.push_back(poses[i].world(X));
    for (std::size_t k = 0; k < shape.vertices.size(); ++k)
      connectivity.push_back(first + static_cast<std::int64_t>(k));
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
    faces.push_back(shape.faces());
    for (int f = 0; f < shape.faces(); ++f) {
      const int a = shape.face_offset[static_cast<std::size_t>(f)],
                b = shape.face_offset[static_cast<std::size_t>(f) + 1];
      faces.push_back(b - a);
      for (int k = a; k < b; ++k) faces.push_back(first + shape.face_vertices[static_cast<std::size_t>(k)]);
    }
    face_offsets.push_back(static_cast<std::int64_t>(faces.size()));
    index.push_back(static_cast<std::int32_t>(i));
    displacement.push_back(i < start.size() ? Vec3(poses[i].c - start[i]) : Vec3::Zero());
    const bool known = row != nullptr && i < row->velocity.size();
    velocity.push_back(known ? row->velocity[i] : Vec3::Zero());
    speed.push_back(static_cast<float>(velocity.back().norm()));
    kinetic.push_back(known ? static_cast<float>(row->kinetic_translational[i] + row->kinetic_rotational[i])
                            : 0.0F);
  }
  const std::string point_array = file.array("Points", flat<double>(points), 3);
  const std::string cells = file.array("connectivity", connectivity) + file.array("offsets", offsets) +
                            file.array("types", std::vector<std::uint8_t>(offsets.size(), vtk_polyhedron)) +
                            file.array("faces", faces) + file.array("faceoffsets", face_offsets);
  std::string data = file.array("block", index) + file.array("displacement", flat<float>(displacement), 3);
  if (row != nullptr)
    data += file.array("velocity", flat<float>(velocity), 3) + file.array("speed", speed) +
            file.array("kinetic_energy", kinetic);
  file.save(path, points.size(), offsets.size(), {}, data, point_array, cells);
}

void write_structure_vtu(const std::filesystem::path& path, const Structure::Snapshot& s) {
  VtuFile file;
  const std::string points = file.array("Points", flat<double>(s.nodes), 3);
  const std::string cells = uniform_cells(file, s.hexes, vtk_hexahedron);
  std::string point_data, cell_data;
  if (s.displacement.size() == s.nodes.size())
    point_data += file.array("displacement", flat<float>(s.displacement), 3);
  if (s.velocity.size() == s.nodes.size()) point_data += file.array("velocity", flat<float>(s.velocity), 3);
  const auto cell = [&](const char* name, const std::vector<double>& v) {
    if (v.size() == s.hexes.size()) cell_data += file.array(name, narrow(v));
  };
  cell("damage_tension", s.damage_tension);
  cell("damage_compression", s.damage_compression);
  cell("stress_von_mises", s.stress_von_mises);
  cell("crack_width", s.crack_width);
  file.save(path, s.nodes.size(), s.hexes.size(), point_data, cell_data, points, cells);
}

void write_bars_vtu(const std::filesystem::path& path, const Structure::Snapshot& s) {
  VtuFile file;
  const std::string points = file.array("Points", flat<double>(s.bar_points), 3);
  const std::string cells = uniform_cells(file, s.bars, vtk_line);
  std::string data;
  const auto segment = [&](const char* name, const std::vector<double>& v) {
    if (v.size() == s.bars.size()) data += file.array(name, narrow(v));
  };
  segment("strain", s.bar_strain);
  segment("stress", s.bar_stress);
  segment("state", s.bar_state);
  file.save(path, s.bar_points.size(), s.bars.size(), {}, data, points, cells);
}

void write_surface_vtu(const std::filesystem::path& path, const TriangleSurface& surface) {
  VtuFile file;
  const std::string points = file.array("Points", flat<double>(surface.vertices), 3);
  const std::string cells = uniform_cells(file, surface.triangles, vtk_triangle);
  std::vector<float> height;
  for (const Vec3& v : surface.vertices) height.push_back(static_cast<float>(v.z()));
  file.save(path, surface.vertices.size(), surface.triangles.size(), file.array("height", height), {}, points,
            cells);
}

std::string pvd_text(std::span<const PvdEntry> entries) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  "
      "<Collection>\n";
  for (const PvdEntry& e : entries)
    text += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" name=\"{}\" file=\"{}\"/>\n", e.time,
                        e.part, xml_text(e.name), xml_text(e.file));
  return text + "  </Collection>\n</VTKFile>\n";
}

}  // namespace talus::io
