// Gmsh .msh: reads 2.2 and 4.1 (ASCII), writes 2.2.
#include <algorithm>
#include <iterator>

#include "core/solid_mesh_file.hpp"

namespace talus::solid_mesh {
namespace {

/// Takes one Gmsh element; what carries no volume only names groups.
void add_gmsh_element(const Reader& in, Draft& mesh, int type, const std::vector<long>& tags,
                      std::size_t first, const std::vector<std::string>& groups) {
  static const std::map<int, int> count{{15, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 4}, {5, 8}};
  const auto known = count.find(type);
  if (known == count.end()) {
    static const std::map<int, std::string> names{{6, "prism"},
                                                  {7, "pyramid"},
                                                  {8, "second-order line"},
                                                  {9, "second-order triangle"},
                                                  {10, "second-order quadrangle"},
                                                  {11, "second-order tetrahedron"},
                                                  {12, "second-order hexahedron"},
                                                  {16, "second-order quadrangle"},
                                                  {17, "second-order hexahedron"}};
    const auto name = names.find(type);
    in.fail(fmt::format("element type {}{}", type, name == names.end() ? "" : " (" + name->second + ")"),
            "only first-order hexahedra and tetrahedra are supported",
            "mesh with Mesh.ElementOrder = 1 and hexahedra (Recombine) or tetrahedra alone");
  }
  if (tags.size() < first + known->second)
    in.fail(in.text(), "too few nodes for the element", "write the file again");
  std::vector<int> node;
  for (int i = 0; i < known->second; ++i) node.push_back(in.node(mesh, tags[first + i]));
  for (const std::string& group : groups) mesh.groups[group].insert(node.begin(), node.end());
  if (type == 5) {
    std::array<int, 8> hex{};
    std::copy(node.begin(), node.end(), hex.begin());
    mesh.hexes.push_back(hex);
    mesh.hex_numbers.push_back(tags[0]);
  } else if (type == 4) {
    mesh.tets.push_back({node[0], node[1], node[2], node[3]});
    mesh.tet_numbers.push_back(tags[0]);
  }
}

/// One file, section by section.
class GmshFile {
 public:
  explicit GmshFile(const std::string& path) : in_(path) {}

  SolidMesh read() {
    while (in_.line()) {
      const std::string section = in_.text();
      if (section == "$MeshFormat")
        format();
      else if (section == "$PhysicalNames")
        physical_names();
      else if (section == "$Entities")
        entities();
      else if (section == "$Nodes")
        version_ == 2.2 ? nodes_2() : nodes_4();
      else if (section == "$Elements")
        version_ == 2.2 ? elements_2() : elements_4();
    }
    if (version_ == 0) in_.fail("", "the file has no $MeshFormat section", "give a Gmsh .msh file");
    return std::move(mesh_);
  }

 private:
  /// The count that opens a section of version 2.2, the numbers of blocks of 4.1.
  long count() {
    in_.need_line();
    return in_.values<long>(1)[0];
  }

  std::string group_name(int dimension, long tag) const {
    const auto found = physical_.find({dimension, tag});
    return found == physical_.end() ? std::to_string(tag) : found->second;
  }

  void format() {
    in_.need_line();
    const auto v = in_.values<double>(2);
    version_ = v[0];
    if (v[1] != 0) in_.fail(in_.text(), "binary files are not read", "write with Mesh.Binary = 0");
    if (version_ != 2.2 && version_ != 4.1)
      in_.fail(fmt::format("{:g}", version_), "versions 2.2 and 4.1 are read",
               "write with Mesh.MshFileVersion = 4.1");
  }

  void physical_names() {
    for (long n = count(); n > 0; --n) {
      in_.need_line();
      const auto v = in_.values<long>(2);
      const std::size_t from = in_.text().find('"'), to = in_.text().rfind('"');
      if (from == std::string::npos || to <= from)
        in_.fail(in_.text(), "a name in quotation marks is expected", "write the file again");
      physical_[{static_cast<int>(v[0]), v[1]}] = in_.text().substr(from + 1, to - from - 1);
    }
  }

  /// Which physical groups the elements of each entity belong to (4.1).
  void entities() {
    in_.need_line();
    const auto counts = in_.values<long>(4);
    for (int d = 0; d < 4; ++d)
      for (long i = 0; i < counts[d]; ++i) {
        in_.need_line();
        const auto v = in_.values<double>(d == 0 ? 5 : 8);
        const std::size_t at = d == 0 ? 4 : 7;
        const long n = whole(in_, v[at]);
        for (long k = 0; k < n && at + 1 + k < v.size(); ++k)
          entity_[{d, whole(in_, v[0])}].push_back(whole(in_, v[at + 1 + k]));
      }
  }

  void nodes_2() {
    for (long n = count(); n > 0; --n) {
      in_.need_line();
      const auto v = in_.values<double>(4);
      add_node(in_, mesh_, whole(in_, v[0]), {v[1], v[2], v[3]});
    }
  }

  void nodes_4() {
    for (long blocks = count(); blocks > 0; --blocks) {
      in_.need_line();
      const long n = in_.values<long>(4)[3];
      std::vector<long> tags;
      for (long i = 0; i < n; ++i) in_.need_line(), tags.push_back(in_.values<long>(1)[0]);
      for (const long tag : tags) {
        in_.need_line();
        const auto v = in_.values<double>(3);
        add_node(in_, mesh_, tag, {v[0], v[1], v[2]});
      }
    }
  }

  void elements_2() {
    static const std::map<int, int> dimension_of{{15, 0}, {1, 1}, {2, 2}, {3, 2}, {4, 3}, {5, 3}};
    for (long n = count(); n > 0; --n) {
      in_.need_line();
      const auto v = in_.values<long>(4);
      const int type = static_cast<int>(v[1]);
      if (v[2] < 0 || v[2] > static_cast<long>(v.size()))
        in_.fail(in_.text(), "the number of tags does not fit the line", "write the file again");
      const auto d = dimension_of.find(type);
      std::vector<std::string> groups;
      if (v[2] > 0 && v[3] != 0 && d != dimension_of.end()) groups.push_back(group_name(d->second, v[3]));
      add_gmsh_element(in_, mesh_, type, v, 3 + v[2], groups);
    }
  }

  void elements_4() {
    for (long blocks = count(); blocks > 0; --blocks) {
      in_.need_line();
      const auto v = in_.values<long>(4);
      const int dimension = static_cast<int>(v[0]);
      std::vector<std::string> groups;
      for (const long tag : entity_[{dimension, v[1]}]) groups.push_back(group_name(dimension, tag));
      for (long i = 0; i < v[3]; ++i) {
        in_.need_line();
        add_gmsh_element(in_, mesh_, static_cast<int>(v[2]), in_.values<long>(2), 1, groups);
      }
    }
  }

  Reader in_;
  Draft mesh_;
  double version_ = 0;
  std::map<std::pair<int, long>, std::string> physical_;      // (dimension, tag) -> name
  std::map<std::pair<int, long>, std::vector<long>> entity_;  // (dimension, tag) -> physical tags
};

}  // namespace

SolidMesh read_gmsh(const std::string& path) { return GmshFile(path).read(); }

std::string gmsh_text(const std::string& path, const SolidMesh& mesh) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  const std::size_t volume =
      mesh.groups.size() + 1;  // the physical group of the cells, after those of points
  fmt::format_to(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", mesh.groups.size());
  std::size_t tag = 0, points = 0;
  for (const auto& [name, nodes] : mesh.groups) {
    if (name.find_first_of("\"\n\r") != std::string::npos)
      refuse_group(path, name,
                   "the name of a group in a .msh file holds no quotation mark and no line break");
    fmt::format_to(out, "0 {} \"{}\"\n", ++tag, name);
    points += nodes.size();
  }
  fmt::format_to(out, "$EndPhysicalNames\n$Nodes\n{}\n", mesh.nodes.size());
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    fmt::format_to(out, "{} {} {} {}\n", n + 1, mesh.nodes[n].x(), mesh.nodes[n].y(), mesh.nodes[n].z());
  fmt::format_to(out, "$EndNodes\n$Elements\n{}\n", points + mesh.hexes.size() + mesh.tets.size());
  std::size_t element = 0;
  tag = 0;
  for (const auto& [name, nodes] : mesh.groups) {
    ++tag;
    for (const int n : nodes) fmt::format_to(out, "{} 15 2 {} {} {}\n", ++element, tag, tag, n + 1);
  }
  const auto cells = [&](int type, const auto& list) {
    for (const auto& cell : list) {
      fmt::format_to(out, "{} {} 2 0 {}", ++element, type, volume);
      for (const int n : cell) fmt::format_to(out, " {}", n + 1);
      text.push_back('\n');
    }
  };
  cells(5, mesh.hexes);
  cells(4, mesh.tets);
  fmt::format_to(out, "$EndElements\n");
  return fmt::to_string(text);
}

}  // namespace talus::solid_mesh
