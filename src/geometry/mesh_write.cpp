#include <fmt/format.h>
#include <fmt/os.h>

#include <cstdint>
#include <cstring>

#include "core/text_file.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {
namespace {

template <class T>
void raw(fmt::memory_buffer& out, T x) {
  char b[sizeof(T)];
  std::memcpy(b, &x, sizeof(T));
  out.append(b, b + sizeof(T));
}

void obj(fmt::memory_buffer& out, const Mesh& mesh) {
  auto it = fmt::appender(out);
  for (const Vec3& v : mesh.vertices) fmt::format_to(it, "v {} {} {}\n", v.x(), v.y(), v.z());
  int group = -1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.group.empty() && mesh.group[t] != group)
      fmt::format_to(it, "g {}\n", mesh.group_names[group = mesh.group[t]]);
    const auto& c = mesh.triangles[t];
    fmt::format_to(it, "f {} {} {}\n", c[0] + 1, c[1] + 1, c[2] + 1);
  }
}

void stl(fmt::memory_buffer& out, const Mesh& mesh) {
  char header[80] = "Binary STL, metres";
  out.append(header, header + 80);
  raw(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 n = (b - a).cross(c - a).normalized();
    for (const Vec3& p : {n, a, b, c})
      for (int k = 0; k < 3; ++k) raw(out, static_cast<float>(p[k]));
    raw(out, std::uint16_t{0});
  }
}

void ply(fmt::memory_buffer& out, const Mesh& mesh) {
  fmt::format_to(
      fmt::appender(out),
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n"
      "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) raw(out, v[k]);
  for (const auto& t : mesh.triangles) {
    raw(out, std::uint8_t{3});
    for (int v : t) raw(out, static_cast<std::int32_t>(v));
  }
}

void off(fmt::memory_buffer& out, const Mesh& mesh) {
  auto it = fmt::appender(out);
  fmt::format_to(it, "OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& v : mesh.vertices) fmt::format_to(it, "{} {} {}\n", v.x(), v.y(), v.z());
  for (const auto& t : mesh.triangles) fmt::format_to(it, "3 {} {} {}\n", t[0], t[1], t[2]);
}

void vtu(fmt::memory_buffer& out, const Mesh& mesh) {
  auto it = fmt::appender(out);
  fmt::format_to(it,
                 "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
                 "byte_order=\"LittleEndian\">\n"
                 "<UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n"
                 "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n",
                 mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& v : mesh.vertices) fmt::format_to(it, "{} {} {}\n", v.x(), v.y(), v.z());
  fmt::format_to(
      it,
      "</DataArray></Points>\n<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\n");
  for (const auto& t : mesh.triangles) fmt::format_to(it, "{} {} {}\n", t[0], t[1], t[2]);
  fmt::format_to(it, "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n");
  for (std::size_t t = 1; t <= mesh.triangles.size(); ++t) fmt::format_to(it, "{}\n", 3 * t);
  fmt::format_to(it, "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) fmt::format_to(it, "5\n");
  fmt::format_to(it, "</DataArray></Cells>\n");
  if (!mesh.group.empty()) {
    fmt::format_to(it, "<CellData><DataArray type=\"Int32\" Name=\"block\" format=\"ascii\">\n");
    for (int g : mesh.group) fmt::format_to(it, "{}\n", g + 1);
    fmt::format_to(it, "</DataArray></CellData>\n");
  }
  fmt::format_to(it, "</Piece></UnstructuredGrid></VTKFile>\n");
}

}  // namespace

void write_mesh(const std::string& path, const Mesh& mesh) {
  const auto dot = path.find_last_of('.');
  std::string e = dot == std::string::npos ? "" : path.substr(dot + 1);
  for (char& c : e) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  fmt::memory_buffer out;
  if (e == "obj")
    obj(out, mesh);
  else if (e == "stl")
    stl(out, mesh);
  else if (e == "ply")
    ply(out, mesh);
  else if (e == "off")
    off(out, mesh);
  else if (e == "vtu")
    vtu(out, mesh);
  else
    throw InputError(Problem{.file = path,
                             .key = "file",
                             .value = e,
                             .rule = "not a mesh format that is written",
                             .remedy = "use .obj, .stl, .ply, .off or .vtu"});
  write_bytes(path, {out.data(), out.size()});
}

}  // namespace talus::geometry
