#include "io/vtu.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <utility>

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

using Put = std::function<void(std::string_view)>;

template <class T>
std::string_view bytes_of(const std::vector<T>& list) {
  return {reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T)};
}

/// Collects arrays for the appended section while the XML before it refers to their offsets.
class VtuFile {
 public:
  /// `write` puts `count` numbers when the file is saved.
  template <class T>
  std::string array(const std::string& name, std::size_t count, std::function<void(const Put&)> write,
                    std::size_t components = 1) {
    const std::string xml = fmt::format(
        "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        vtk_type<T>(), name, components, offset_);
    const std::uint64_t bytes = count * sizeof(T);
    appended_.push_back({bytes, std::move(write)});
    offset_ += sizeof bytes + bytes;
    return xml;
  }
  template <class T>
  std::string array(const std::string& name, std::vector<T> values, std::size_t components = 1) {
    const std::size_t count = values.size();
    return array<T>(
        name, count, [values = std::move(values)](const Put& put) { put(bytes_of(values)); }, components);
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
    const auto write = [&](const Put& put) {
      put(head);
      for (const Appended& a : appended_) {
        put({reinterpret_cast<const char*>(&a.bytes), sizeof a.bytes});
        a.write(put);
      }
      put("\n  </AppendedData>\n</VTKFile>\n");
    };
    write_file(path, write, false);
  }

 private:
  struct Appended {
    std::uint64_t bytes;
    std::function<void(const Put&)> write;
  };
  std::vector<Appended> appended_;
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

/// Cells of one kind, each with `nodes` of them, whose numbers come in parts.
std::string uniform_cells(
    VtuFile& file, std::size_t count, std::size_t nodes, std::uint8_t type,
    const std::function<void(const std::function<void(std::span<const int>)>&)>& parts) {
  const auto connectivity = [parts](const Put& put) {
    std::vector<std::int64_t> numbers;
    parts([&](std::span<const int> part) {
      numbers.assign(part.begin(), part.end());
      put(bytes_of(numbers));
    });
  };
  const auto offsets = [count, nodes](const Put& put) {
    std::vector<std::int64_t> numbers;
    for (std::size_t i = 1; i <= count; ++i) {
      numbers.push_back(static_cast<std::int64_t>(nodes * i));
      if (i < count && numbers.size() < 4096) continue;
      put(bytes_of(numbers));
      numbers.clear();
    }
  };
  std::string xml = file.array<std::int64_t>("connectivity", nodes * count, connectivity);
  xml += file.array<std::int64_t>("offsets", count, offsets);
  xml += file.array("types", std::vector<std::uint8_t>(count, type));
  return xml;
}

/// Numbers of cells of a structure, or of its bars.
std::string cells_of(VtuFile& file, const std::filesystem::path& journal, const StructureField& s,
                     std::size_t column, std::uint8_t type) {
  const auto parts = [&journal, &s, column](const std::function<void(std::span<const int>)>& take) {
    std::vector<int> numbers;
    read_column(journal, s, column, [&](std::string_view bytes) {
      numbers.resize(bytes.size() / sizeof(int));
      std::memcpy(numbers.data(), bytes.data(), bytes.size());
      take(numbers);
    });
  };
  return uniform_cells(file, s.rows[column], field_columns[column].width, type, parts);
}

/// A column of the journal as it is; nothing if it is not there.
template <class T>
std::string array_of(VtuFile& file, const std::string& name, const std::filesystem::path& journal,
                     const StructureField& s, std::size_t column) {
  if (s.rows[column] != s.count(field_columns[column].of)) return {};
  const auto copy = [&journal, &s, column](const Put& put) { read_column(journal, s, column, put); };
  return file.array<T>(name, s.rows[column] * field_columns[column].width, copy, field_columns[column].width);
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

void write_structure_vtu(const std::filesystem::path& path, const std::filesystem::path& journal,
                         const StructureField& s) {
  VtuFile file;
  const std::string points = array_of<double>(file, "Points", journal, s, nodes_column),
                    cells = cells_of(file, journal, s, hexes_column, vtk_hexahedron);
  std::string point_data, cell_data;
  for (std::size_t c = shape_columns; c < points_column; ++c)
    (field_columns[c].of == ColumnOf::node ? point_data : cell_data) +=
        array_of<float>(file, field_columns[c].name, journal, s, c);
  file.save(path, s.count(ColumnOf::node), s.count(ColumnOf::cell), point_data, cell_data, points, cells);
}

void write_bars_vtu(const std::filesystem::path& path, const std::filesystem::path& journal,
                    const StructureField& s) {
  VtuFile file;
  const std::string points = array_of<double>(file, "Points", journal, s, points_column),
                    cells = cells_of(file, journal, s, bars_column, vtk_line);
  std::string data;
  for (std::size_t c = points_column + 1; c < column_count; ++c)
    data += array_of<float>(file, field_columns[c].name + sizeof("bar_") - 1, journal, s, c);
  file.save(path, s.count(ColumnOf::point), s.count(ColumnOf::bar), {}, data, points, cells);
}

void write_surface_vtu(const std::filesystem::path& path, const TriangleSurface& surface) {
  VtuFile file;
  const std::string points = file.array("Points", flat<double>(surface.vertices), 3);
  const auto corners = [&](const auto& take) {
    if (!surface.triangles.empty()) take({surface.triangles[0].data(), 3 * surface.triangles.size()});
  };
  const std::string cells = uniform_cells(file, surface.triangles.size(), 3, vtk_triangle, corners);
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
