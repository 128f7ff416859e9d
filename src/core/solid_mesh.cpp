#include "core/solid_mesh.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "core/solid_mesh_file.hpp"

namespace talus {
namespace solid_mesh {

long whole(const Reader& in, double x) {
  if (!(std::abs(x) < 9e15))
    in.fail(fmt::format("{:g}", x), "a whole number is expected here", "write the file again");
  return static_cast<long>(x);
}

void add_node(const Reader& in, Draft& mesh, long tag, const Vec3& x) {
  if (!x.allFinite()) in.fail(in.text(), "coordinates must be finite numbers", "correct the node");
  const auto [at, fresh] = mesh.number.try_emplace(tag, static_cast<int>(mesh.nodes.size()));
  if (!fresh && mesh.nodes[static_cast<std::size_t>(at->second)] != x)
    in.fail(in.text(), fmt::format("node {} was given another place above", tag),
            "number the nodes of all parts through, or save one part to a file");
  if (!fresh) return;
  mesh.nodes.push_back(x);
}

std::string upper(std::string s) {
  for (char& c : s) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return s;
}

void refuse_group(const std::string& path, const std::string& name, const std::string& rule) {
  Problem p;
  p.file = path;
  p.key = "group";
  p.value = name;
  p.rule = rule;
  p.remedy = "rename the group in the mesh that is converted";
  throw InputError(p);
}

namespace {

std::string ending(const std::string& path) {
  return upper(std::filesystem::path(path).extension().string());
}

[[noreturn]] void unknown_ending(const std::string& path) {
  Problem p;
  p.file = path;
  p.rule = "volume meshes are Gmsh .msh and Abaqus/CalculiX .inp";
  p.remedy = "export the mesh in one of these formats";
  throw InputError(p);
}

}  // namespace
}  // namespace solid_mesh

bool is_solid_mesh_file(const std::string& path) {
  const std::string end = solid_mesh::ending(path);
  return end == ".MSH" || end == ".INP";
}

SolidMesh read_solid_mesh(const std::string& path) {
  const std::string end = solid_mesh::ending(path);
  if (end == ".MSH") return solid_mesh::read_gmsh(path);
  if (end == ".INP") return solid_mesh::read_abaqus(path);
  solid_mesh::unknown_ending(path);
}

std::string solid_mesh_text(const std::string& path, const SolidMesh& mesh) {
  const std::string end = solid_mesh::ending(path);
  if (end == ".MSH") return solid_mesh::gmsh_text(path, mesh);
  if (end == ".INP") return solid_mesh::abaqus_text(path, mesh);
  solid_mesh::unknown_ending(path);
}

std::vector<std::array<int, 3>> outer_triangles(const SolidMesh& mesh) {
  static constexpr int hex_face[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                         {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  static constexpr int tet_face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  std::map<std::vector<int>, int> shared;  // sorted nodes of a face -> cells that have it
  const auto each_face = [&mesh](const auto& visit) {
    for (const auto& hex : mesh.hexes)
      for (const auto& f : hex_face) visit(std::vector<int>{hex[f[0]], hex[f[1]], hex[f[2]], hex[f[3]]});
    for (const auto& tet : mesh.tets)
      for (const auto& f : tet_face) visit(std::vector<int>{tet[f[0]], tet[f[1]], tet[f[2]]});
  };
  const auto key = [](std::vector<int> face) {
    std::sort(face.begin(), face.end());
    return face;
  };
  each_face([&](const std::vector<int>& face) { ++shared[key(face)]; });
  std::vector<std::array<int, 3>> triangles;
  each_face([&](const std::vector<int>& face) {
    if (shared[key(face)] != 1) return;
    triangles.push_back({face[0], face[1], face[2]});
    if (face.size() == 4) triangles.push_back({face[0], face[2], face[3]});
  });
  return triangles;
}

}  // namespace talus
