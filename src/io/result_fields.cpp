// /fields: a group for each frame.
#include <fmt/format.h>

#include <cstring>
#include <iterator>
#include <stdexcept>

#include "io/files.hpp"
#include "io/result_writers.hpp"

namespace talus::io {

void FieldWriter::add(const FieldRow& f) {
  XdmfFrame frame;
  frame.time = f.time;
  frame.group = fmt::format("/fields/{:06}", frames_.size());
  file_.group(frame.group);
  file_.attribute(frame.group, "time", f.time);
  blocks(f, frame);
  for (std::size_t i = 0; i < f.structures.size() && i < header_.structures.size(); ++i)
    structure(f.structures[i], i, frame);
  frames_.push_back(std::move(frame));
}

template <class T>
void FieldWriter::put(const std::string& group, const std::string& name, const std::vector<T>& values,
                      const Dims& dims, const char* unit, const char* description) {
  const std::string path = group + "/" + name;
  const std::string key = path.substr(path.find('/', 8));  // without "/fields/NNNNNN"
  Last& last = last_[key];
  const std::string_view bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  if (!last.path.empty() && last.bytes == bytes && last.dims == dims) {
    file_.hard_link(last.path, path);
    return;
  }
  file_.write<T>(path, values, dims, unit, description);
  last = {path, std::string(bytes), dims, 0};
}

void FieldWriter::blocks(const FieldRow& f, XdmfFrame& frame) {
  std::vector<double> points;
  std::vector<std::int32_t> topology, owner;
  for (std::size_t i = 0; i < f.poses.size() && i < header_.blocks.size(); ++i) {
    const Polyhedron& s = header_.blocks[i].shape;
    const auto first = static_cast<std::int32_t>(points.size() / 3);
    for (const Vec3& X : s.vertices) {
      const Vec3 x = f.poses[i].world(X);
      points.insert(points.end(), x.data(), x.data() + 3);
    }
    for (int face = 0; face < s.faces(); ++face) {
      const int a = s.face_offset[static_cast<std::size_t>(face)],
                b = s.face_offset[static_cast<std::size_t>(face) + 1];
      topology.push_back(3);  // a polygon of XDMF
      topology.push_back(b - a);
      for (int k = a; k < b; ++k) topology.push_back(first + s.face_vertices[static_cast<std::size_t>(k)]);
      owner.push_back(static_cast<std::int32_t>(i));
    }
  }
  frame.points = points.size() / 3;
  frame.polygons = owner.size();
  frame.topology = topology.size();
  if (owner.empty()) return;
  const std::string g = frame.group + "/blocks";
  put(g, "points", points, {frame.points, 3}, "m", "vertices of the blocks, scene coordinates");
  put(g, "topology", topology, {topology.size()}, "1", "XDMF mixed topology of polygons");
  put(g, "face_block", owner, {owner.size()}, "1", "block of each polygon");
}

void FieldWriter::structure(const StructureField& s, std::size_t i, XdmfFrame& frame) {
  XdmfFrame::Part part;
  part.name = safe_name(header_.structures[i].name);
  part.nodes = s.count(ColumnOf::node);
  part.hexes = s.count(ColumnOf::cell);
  const std::string g = frame.group + "/structures/" + part.name;
  for (std::size_t c = 0; c < column_count; ++c)
    if (s.has(c) || c == nodes_column || c == hexes_column) column(g, s, c);
  bool* const there[] = {&part.displacement,       &part.velocity, &part.damage_tension,
                         &part.damage_compression, &part.stress,   &part.crack_width};
  for (std::size_t c = 0; c < std::size(there); ++c) *there[c] = s.has(shape_columns + c);
  frame.structures.push_back(std::move(part));
}

void FieldWriter::column(const std::string& group, const StructureField& s, std::size_t c) {
  const FieldColumn& of = field_columns[c];
  const std::string path = group + "/" + of.name;
  Last& last = last_[path.substr(path.find('/', 8))];  // without "/fields/NNNNNN"
  const std::size_t rows = s.rows[c];
  const Dims dims = of.width == 1 ? Dims{rows} : Dims{rows, of.width};
  if (!last.path.empty() && last.crc == s.crc[c] && last.dims == dims) {
    file_.hard_link(last.path, path);
    return;
  }
  const auto write = [&]<class T>(T) {
    std::vector<T> values;
    const auto parts = [&](const std::function<void(std::span<const T>)>& take) {
      read_column(journal_, s, c, [&](std::string_view bytes) {
        values.resize(bytes.size() / sizeof(T));
        std::memcpy(values.data(), bytes.data(), bytes.size());
        take(values);
      });
    };
    file_.write_parts<T>(path, dims, parts, of.unit, of.description);
  };
  if (of.type == ColumnType::f64)
    write(double{});
  else if (of.type == ColumnType::f32)
    write(float{});
  else
    write(std::int32_t{});
  last = {path, {}, dims, s.crc[c]};
}

}  // namespace talus::io
