// /fields: a group for each frame.
#include <fmt/format.h>

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
  last = {path, std::string(bytes), dims};
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

void FieldWriter::structure(const Structure::Snapshot& s, std::size_t i, XdmfFrame& frame) {
  XdmfFrame::Part part;
  part.name = safe_name(header_.structures[i].name);
  part.nodes = s.nodes.size();
  part.hexes = s.hexes.size();
  const std::string g = frame.group + "/structures/" + part.name;
  put(g, "nodes", flat(s.nodes), {s.nodes.size(), 3}, "m", "reference positions");
  put(g, "hexes", flat(s.hexes), {s.hexes.size(), 8}, "1", "live cells, VTK order");
  const auto nodal = [&](const char* name, const std::vector<Vec3>& v, const char* unit) {
    if (v.size() != s.nodes.size() || v.empty()) return false;
    const std::vector<double> d = flat(v);
    put(g, name, std::vector<float>(d.begin(), d.end()), {v.size(), 3}, unit, name);
    return true;
  };
  const auto cell = [&](const char* name, const std::vector<double>& v, const char* unit) {
    if (v.size() != s.hexes.size() || v.empty()) return false;
    put(g, name, std::vector<float>(v.begin(), v.end()), {v.size()}, unit, name);
    return true;
  };
  part.displacement = nodal("displacement", s.displacement, "m");
  part.velocity = nodal("velocity", s.velocity, "m/s");
  part.damage_tension = cell("damage_tension", s.damage_tension, "1");
  part.damage_compression = cell("damage_compression", s.damage_compression, "1");
  part.stress = cell("stress_von_mises", s.stress_von_mises, "Pa");
  part.crack_width = cell("crack_width", s.crack_width, "m");
  if (!s.bars.empty()) {
    put(g, "bars", flat(s.bars), {s.bars.size(), 2}, "1", "reinforcement: rows of bar_points");
    const std::vector<double> p = flat(s.bar_points);
    put(g, "bar_points", std::vector<float>(p.begin(), p.end()), {s.bar_points.size(), 3}, "m",
        "scene coordinates");
    if (s.bar_strain.size() == s.bars.size())
      put(g, "bar_strain", std::vector<float>(s.bar_strain.begin(), s.bar_strain.end()), {s.bars.size()}, "1",
          "axial strain");
    if (s.bar_stress.size() == s.bars.size())
      put(g, "bar_stress", std::vector<float>(s.bar_stress.begin(), s.bar_stress.end()), {s.bars.size()},
          "Pa", "axial stress");
    if (s.bar_state.size() == s.bars.size())
      put(g, "bar_state", std::vector<float>(s.bar_state.begin(), s.bar_state.end()), {s.bars.size()}, "1",
          "0 elastic, 1 has yielded, 2 broken");
  }
  frame.structures.push_back(std::move(part));
}

}  // namespace talus::io
