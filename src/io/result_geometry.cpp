// /geometry, names, materials and the plan.
#include "io/files.hpp"
#include "io/result_writers.hpp"
#include "io/results.hpp"

namespace talus::io {

std::vector<double> flat(const std::vector<Vec3>& v) {
  std::vector<double> out;
  out.reserve(3 * v.size());
  for (const Vec3& p : v) out.insert(out.end(), p.data(), p.data() + 3);
  return out;
}

void write_geometry(Hdf5File& file, const sim::RunHeader& h) {
  std::vector<double> vertices, mass, volume;
  std::vector<std::int64_t> vertex_offset{0}, face_vertices, face_offset{0}, block_face_offset{0};
  std::vector<std::int32_t> triangles;
  std::vector<std::int64_t> triangle_offset{0};
  std::vector<std::uint8_t> fixed, fragment;
  std::vector<std::string> names;
  for (const auto& b : h.blocks) {
    const std::int64_t first = vertex_offset.back();
    const std::vector<double> v = flat(b.shape.vertices);
    vertices.insert(vertices.end(), v.begin(), v.end());
    for (int f = 0; f < b.shape.faces(); ++f) {
      for (int k = b.shape.face_offset[static_cast<std::size_t>(f)];
           k < b.shape.face_offset[static_cast<std::size_t>(f) + 1]; ++k)
        face_vertices.push_back(first + b.shape.face_vertices[static_cast<std::size_t>(k)]);
      face_offset.push_back(static_cast<std::int64_t>(face_vertices.size()));
    }
    for (const auto& t : b.shape.triangles)
      for (const int v : t) triangles.push_back(static_cast<std::int32_t>(first) + v);
    triangle_offset.push_back(static_cast<std::int64_t>(triangles.size() / 3));
    vertex_offset.push_back(first + static_cast<std::int64_t>(b.shape.vertices.size()));
    block_face_offset.push_back(static_cast<std::int64_t>(face_offset.size()) - 1);
    names.push_back(b.name);
    mass.push_back(b.mass);
    volume.push_back(b.volume);
    fixed.push_back(b.fixed);
    fragment.push_back(b.fragment);
  }
  const std::string g = "/geometry/blocks/";
  const auto ints = [&](const std::string& path, const std::vector<std::int64_t>& v,
                        const char* description) {
    file.write<std::int64_t>(path, v, {v.size()}, "1", description);
  };
  file.write<double>(g + "vertices", vertices, {vertices.size() / 3, 3}, "m",
                     "vertices of all blocks in body axes about the centroid");
  ints(g + "vertex_offset", vertex_offset,
       "vertices of block b: rows vertex_offset[b] to vertex_offset[b + 1]");
  ints(g + "face_vertices", face_vertices,
       "rows of vertices, face by face, counter-clockwise seen from outside");
  ints(g + "face_offset", face_offset, "face f: face_vertices[face_offset[f] : face_offset[f + 1]]");
  ints(g + "block_face_offset", block_face_offset,
       "faces of block b: block_face_offset[b] to block_face_offset[b + 1]");
  file.write<std::int32_t>(g + "triangles", triangles, {triangles.size() / 3, 3}, "1",
                           "triangulation of the faces: rows of vertices, outward");
  ints(g + "triangle_offset", triangle_offset,
       "triangles of block b: triangle_offset[b] to triangle_offset[b + 1]");
  file.write<double>(g + "volume", volume, {volume.size()}, "m^3", "volume");
  file.write<std::uint8_t>(g + "fixed", fixed, {fixed.size()}, "1", "1: the block does not move");
  file.write<std::uint8_t>(g + "fragment", fragment, {fragment.size()}, "1",
                           "1: came off a structure during the run");
  file.write("/history/blocks/name", names,
             "names in the order of the scene, then the rock mass, then fragments");
  file.write<double>("/history/blocks/mass", mass, {mass.size()}, "kg", "mass");

  file.write<double>(
      "/geometry/map_origin", std::vector<double>(h.map_origin.data(), h.map_origin.data() + 3), {3}, "m",
      "map coordinates of the scene's origin, in the system that the attribute crs of the file names");
  if (!h.terrain.triangles.empty()) {
    file.write<double>("/geometry/terrain/vertices", flat(h.terrain.vertices), {h.terrain.vertices.size(), 3},
                       "m", "scene coordinates");
    file.write<std::int32_t>("/geometry/terrain/triangles", flat(h.terrain.triangles),
                             {h.terrain.triangles.size(), 3}, "1", "rows of vertices, outward");
  }
  std::vector<double> planes;
  for (const Plane& p : h.planes) {
    planes.insert(planes.end(), p.point.data(), p.point.data() + 3);
    planes.insert(planes.end(), p.normal.data(), p.normal.data() + 3);
  }
  if (!h.planes.empty())
    file.write<double>("/geometry/planes", planes, {h.planes.size(), 6}, "m, 1",
                       "a point of each plane and its outward unit normal");
  std::vector<std::string> structures;
  for (const auto& s : h.structures) {
    structures.push_back(s.name);
    const std::string p = "/history/structures/" + safe_name(s.name) + "/";
    file.write(p + "probe_name", s.probes, "names of the probes");
    if (!s.members.empty()) {
      std::vector<std::string> names, spans;
      std::vector<double> stations, frame, shear;
      for (const Member& m : s.members) {
        names.push_back(m.name);
        stations.insert(stations.end(), m.stations.begin(), m.stations.end());
        for (const Vec3* v : {&m.base, &m.axis_x, &m.axis_y})
          frame.insert(frame.end(), v->data(), v->data() + 3);
        spans.push_back(m.span ? "span" : "pier");
        for (const auto& r : {m.shear_design, m.shear_mean}) shear.insert(shear.end(), r.begin(), r.end());
      }
      file.write(p + "members/name", names, "names of the members");
      file.write(p + "members/kind", spans, "pier (columns and boxes too) or span (of a deck)");
      file.write<double>(p + "members/station", stations, {names.size(), s.members[0].stations.size()}, "m",
                         "distance of the sections from the base");
      file.write<double>(p + "members/frame", frame, {names.size(), 3, 3}, "m, 1, 1",
                         "rows: centre of the base, axis_x, axis_y; the member runs along axis_x x axis_y");
      file.write<double>(
          p + "members/shear_resistance", shear, {names.size(), 2, 2}, "N",
          "EN 1992-1-1 6.2: rows design (accidental), mean strengths; columns along axis_x, axis_y");
    }
    file.write<double>(p + "probe_position", flat(s.probe_at), {s.probe_at.size(), 3}, "m",
                       "position of the probes at t = 0");
  }
  file.write("/geometry/structures/name", structures, "names of the structures in the order of the scene");
  file.write("/plan", h.plan, "what was computed and what was left out");
  file.write("/materials", h.materials, "names of the materials");
}

}  // namespace talus::io
