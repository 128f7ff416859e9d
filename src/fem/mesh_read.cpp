// Meshes from file: Gmsh .msh (2.2 and 4.1, ASCII) and Abaqus/CalculiX .inp. Hexahedra as they are, tetrahedra cut into four
// hexahedra each (at the midpoints of edges, faces and the cell).
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <unordered_map>

#include "core/error.hpp"
#include "fem/hex_mesh.hpp"

namespace talus::fem {
namespace {

struct RawMesh {
  std::vector<Vec3> nodes;
  std::unordered_map<long, int> number;  // tag in the file -> index; for look-up only
  std::vector<std::array<int, 8>> hexes;
  std::vector<std::array<int, 4>> tets;
  std::map<std::string, std::set<int>> groups;
};

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), in_(path) {
    if (!in_) fail("", "the mesh file cannot be read", "check the path");
  }
  bool line() {
    if (!std::getline(in_, text_)) return false;
    ++number_;
    while (!text_.empty() && (text_.back() == '\r' || text_.back() == ' ')) text_.pop_back();
    return true;
  }
  void need_line() {
    if (!line()) fail("", "the file ends too early", "write it again");
  }
  const std::string& text() const { return text_; }
  [[noreturn]] void fail(const std::string& value, const std::string& rule, const std::string& remedy) const {
    Problem p;
    p.file = path_;
    p.line = number_;
    p.value = value;
    p.key = "mesh";
    p.rule = rule;
    p.remedy = remedy;
    throw InputError(p);
  }
  /// The line's numbers, at least `least` of them.
  template <class T>
  std::vector<T> values(std::size_t least) const {
    std::istringstream s(text_);
    std::vector<T> v;
    for (T x; s >> x;) v.push_back(x);
    if (v.size() < least) fail(text_, fmt::format("at least {} numbers are expected here", least), "write the file again as ASCII");
    return v;
  }
  int node(const RawMesh& mesh, long tag) const {
    const auto found = mesh.number.find(tag);
    if (found == mesh.number.end()) fail(fmt::format("node {}", tag), "the node is not defined", "write the nodes with the elements");
    return found->second;
  }

 private:
  std::string path_;
  std::ifstream in_;
  std::string text_;
  int number_ = 0;
};

/// A tag or count that stands among real numbers.
long whole(const Reader& in, double x) {
  if (!(std::abs(x) < 9e15)) in.fail(fmt::format("{:g}", x), "a whole number is expected here", "write the file again");
  return static_cast<long>(x);
}

void add_node(const Reader& in, RawMesh& mesh, long tag, const Vec3& x) {
  if (!x.allFinite()) in.fail(in.text(), "coordinates must be finite numbers", "correct the node");
  mesh.number[tag] = static_cast<int>(mesh.nodes.size());
  mesh.nodes.push_back(x);
}

/// Takes one Gmsh element; what carries no volume only names groups.
void add_gmsh_element(const Reader& in, RawMesh& mesh, int type, const std::vector<long>& tags, std::size_t first, const std::vector<std::string>& groups) {
  static const std::map<int, int> count{{15, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 4}, {5, 8}};
  const auto known = count.find(type);
  if (known == count.end()) {
    static const std::map<int, std::string> names{{6, "prism"}, {7, "pyramid"}, {8, "second-order line"}, {9, "second-order triangle"}, {10, "second-order quadrangle"},
                                                  {11, "second-order tetrahedron"}, {12, "second-order hexahedron"}, {16, "second-order quadrangle"}, {17, "second-order hexahedron"}};
    const auto name = names.find(type);
    in.fail(fmt::format("element type {}{}", type, name == names.end() ? "" : " (" + name->second + ")"), "only first-order hexahedra and tetrahedra are supported",
            "mesh with Mesh.ElementOrder = 1 and hexahedra (Recombine) or tetrahedra alone");
  }
  if (tags.size() < first + known->second) in.fail(in.text(), "too few nodes for the element", "write the file again");
  std::vector<int> node;
  for (int i = 0; i < known->second; ++i) node.push_back(in.node(mesh, tags[first + i]));
  for (const std::string& group : groups) mesh.groups[group].insert(node.begin(), node.end());
  if (type == 5) {
    std::array<int, 8> hex{};
    std::copy(node.begin(), node.end(), hex.begin());
    mesh.hexes.push_back(hex);
  } else if (type == 4) {
    mesh.tets.push_back({node[0], node[1], node[2], node[3]});
  }
}

RawMesh read_gmsh(const std::string& path) {
  Reader in(path);
  RawMesh mesh;
  std::map<std::pair<int, long>, std::string> physical;                    // (dimension, tag) -> name
  std::map<std::pair<int, long>, std::vector<long>> entity;                // (dimension, tag) -> physical tags
  double version = 0;
  const auto name_of = [&](int dimension, long tag) {
    const auto found = physical.find({dimension, tag});
    return found == physical.end() ? std::to_string(tag) : found->second;
  };
  static const std::map<int, int> dimension_of{{15, 0}, {1, 1}, {2, 2}, {3, 2}, {4, 3}, {5, 3}};
  while (in.line()) {
    const std::string section = in.text();
    if (section == "$MeshFormat") {
      in.need_line();
      const auto v = in.values<double>(2);
      version = v[0];
      if (v[1] != 0) in.fail(in.text(), "binary files are not read", "write with Mesh.Binary = 0");
      if (version != 2.2 && version != 4.1) in.fail(fmt::format("{:g}", version), "versions 2.2 and 4.1 are read", "write with Mesh.MshFileVersion = 4.1");
    } else if (section == "$PhysicalNames") {
      in.need_line();
      const long n = in.values<long>(1)[0];
      for (long i = 0; i < n; ++i) {
        in.need_line();
        const auto v = in.values<long>(2);
        const std::size_t from = in.text().find('"'), to = in.text().rfind('"');
        if (from == std::string::npos || to <= from) in.fail(in.text(), "a name in quotation marks is expected", "write the file again");
        physical[{static_cast<int>(v[0]), v[1]}] = in.text().substr(from + 1, to - from - 1);
      }
    } else if (section == "$Entities") {
      in.need_line();
      const auto counts = in.values<long>(4);
      for (int d = 0; d < 4; ++d)
        for (long i = 0; i < counts[d]; ++i) {
          in.need_line();
          const auto v = in.values<double>(d == 0 ? 5 : 8);
          const std::size_t at = d == 0 ? 4 : 7;
          const long n = whole(in, v[at]);
          for (long k = 0; k < n && at + 1 + k < v.size(); ++k) entity[{d, whole(in, v[0])}].push_back(whole(in, v[at + 1 + k]));
        }
    } else if (section == "$Nodes") {
      in.need_line();
      const auto head = in.values<long>(1);
      if (version == 2.2) {
        for (long i = 0; i < head[0]; ++i) {
          in.need_line();
          const auto v = in.values<double>(4);
          add_node(in, mesh, whole(in, v[0]), {v[1], v[2], v[3]});
        }
      } else {
        for (long b = 0; b < head[0]; ++b) {
          in.need_line();
          const long n = in.values<long>(4)[3];
          std::vector<long> tags;
          for (long i = 0; i < n; ++i) in.need_line(), tags.push_back(in.values<long>(1)[0]);
          for (long i = 0; i < n; ++i) {
            in.need_line();
            const auto v = in.values<double>(3);
            add_node(in, mesh, tags[i], {v[0], v[1], v[2]});
          }
        }
      }
    } else if (section == "$Elements") {
      in.need_line();
      const auto head = in.values<long>(1);
      if (version == 2.2) {
        for (long i = 0; i < head[0]; ++i) {
          in.need_line();
          const auto v = in.values<long>(4);
          const int type = static_cast<int>(v[1]);
          if (v[2] < 0 || v[2] > static_cast<long>(v.size())) in.fail(in.text(), "the number of tags does not fit the line", "write the file again");
          const auto d = dimension_of.find(type);
          std::vector<std::string> groups;
          if (v[2] > 0 && v[3] != 0 && d != dimension_of.end()) groups.push_back(name_of(d->second, v[3]));
          add_gmsh_element(in, mesh, type, v, 3 + v[2], groups);
        }
      } else {
        for (long b = 0; b < head[0]; ++b) {
          in.need_line();
          const auto v = in.values<long>(4);
          std::vector<std::string> groups;
          for (long tag : entity[{static_cast<int>(v[0]), v[1]}]) groups.push_back(name_of(static_cast<int>(v[0]), tag));
          for (long i = 0; i < v[3]; ++i) {
            in.need_line();
            add_gmsh_element(in, mesh, static_cast<int>(v[2]), in.values<long>(2), 1, groups);
          }
        }
      }
    }
  }
  if (version == 0) in.fail("", "the file has no $MeshFormat section", "give a Gmsh .msh file");
  return mesh;
}

std::string upper(std::string s) {
  for (char& c : s) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return s;
}

std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out;
  std::string field;
  std::istringstream s(line);
  while (std::getline(s, field, ',')) {
    const auto from = field.find_first_not_of(" \t"), to = field.find_last_not_of(" \t");
    out.push_back(from == std::string::npos ? "" : field.substr(from, to - from + 1));
  }
  return out;
}

RawMesh read_abaqus(const std::string& path) {
  Reader in(path);
  RawMesh mesh;
  std::unordered_map<long, std::vector<int>> element_nodes;  // for look-up only
  std::string keyword, set, type;
  bool generate = false, solid = true;
  std::vector<long> pending;  // nodes of an element that goes on over several lines
  std::size_t wanted = 0;
  const auto number = [&](const std::string& s) {
    char* end = nullptr;
    const long v = std::strtol(s.c_str(), &end, 10);
    if (s.empty() || *end) in.fail(s, "a whole number is expected", "correct the line");
    return v;
  };
  while (in.line()) {
    const std::string& line = in.text();
    if (line.empty() || line.rfind("**", 0) == 0) continue;
    if (line[0] == '*') {
      if (!pending.empty()) in.fail("", "the element before has too few nodes", "complete it");
      const auto f = fields(line);
      keyword = upper(f[0]);
      set.clear(), type.clear(), generate = false;
      for (std::size_t i = 1; i < f.size(); ++i) {
        const auto eq = f[i].find('=');
        const std::string key = upper(f[i].substr(0, eq)), value = eq == std::string::npos ? "" : f[i].substr(eq + 1);
        if (key == "NSET" || key == "ELSET") set = value;
        if (key == "TYPE") type = upper(value);
        if (key == "GENERATE") generate = true;
      }
      if (keyword == "*INCLUDE") in.fail(line, "included files are not read", "write the mesh into one file");
      if (keyword == "*ELEMENT") {
        // Lines and surfaces carry no volume: they only name groups.
        static const std::map<std::string, std::size_t> flat{{"T3D2", 2}, {"B31", 2}, {"CPS3", 3}, {"CPE3", 3}, {"S3", 3}, {"M3D3", 3}, {"CPS4", 4}, {"CPE4", 4},
                                                             {"CPS4R", 4}, {"S4", 4}, {"S4R", 4}, {"M3D4", 4}, {"SFM3D3", 3}, {"SFM3D4", 4}};
        const auto named = flat.find(type);
        solid = named == flat.end();
        if (!solid) wanted = named->second;
        else if (type.rfind("C3D8", 0) == 0) wanted = 8;
        else if (type == "C3D4") wanted = 4;
        else in.fail("TYPE=" + type, "only C3D8 (hexahedra) and C3D4 (tetrahedra) are supported", "remesh with first-order hexahedra or tetrahedra");
      }
      continue;
    }
    const auto f = fields(line);
    if (keyword == "*NODE") {
      if (f.size() < 4) in.fail(line, "number, x, y, z are expected", "correct the line");
      Vec3 x;
      for (int c = 0; c < 3; ++c) {
        char* end = nullptr;
        x[c] = std::strtod(f[1 + c].c_str(), &end);
        if (f[1 + c].empty() || *end) in.fail(f[1 + c], "a coordinate is expected", "correct the line");
      }
      add_node(in, mesh, number(f[0]), x);
      if (!set.empty()) mesh.groups[set].insert(static_cast<int>(mesh.nodes.size()) - 1);
    } else if (keyword == "*ELEMENT") {
      for (const std::string& s : f)
        if (!s.empty()) pending.push_back(number(s));
      if (pending.size() < wanted + 1) continue;
      std::vector<int> node;
      for (std::size_t i = 1; i <= wanted; ++i) node.push_back(in.node(mesh, pending[i]));
      if (solid && wanted == 8) {
        std::array<int, 8> hex{};
        std::copy(node.begin(), node.end(), hex.begin());
        mesh.hexes.push_back(hex);
      } else if (solid) {
        mesh.tets.push_back({node[0], node[1], node[2], node[3]});
      }
      if (!set.empty()) mesh.groups[set].insert(node.begin(), node.end());
      element_nodes[pending[0]] = node;
      pending.clear();
    } else if ((keyword == "*NSET" || keyword == "*ELSET") && !set.empty()) {
      std::vector<long> members;
      if (generate) {
        if (f.size() < 2) in.fail(line, "first, last, step are expected", "correct the line");
        const long step = f.size() > 2 && !f[2].empty() ? number(f[2]) : 1;
        if (step <= 0) in.fail(line, "the step must be positive", "correct the line");
        const long first = number(f[0]), last = number(f[1]);
        // Unsigned: the distance of any two numbers.
        const unsigned long count = first <= last ? (static_cast<unsigned long>(last) - static_cast<unsigned long>(first)) / static_cast<unsigned long>(step) + 1 : 0;
        if (count > 10'000'000) in.fail(line, "the range has more than ten million members", "correct the range");
        for (unsigned long k = 0; k < count; ++k) members.push_back(first + static_cast<long>(k) * step);
      } else {
        for (const std::string& s : f) {
          if (s.empty()) continue;
          if (std::isdigit(static_cast<unsigned char>(s[0]))) members.push_back(number(s));
          else mesh.groups[set].insert(mesh.groups[s].begin(), mesh.groups[s].end());
        }
      }
      for (long m : members) {
        if (keyword == "*NSET") mesh.groups[set].insert(in.node(mesh, m));
        else if (const auto e = element_nodes.find(m); e != element_nodes.end()) mesh.groups[set].insert(e->second.begin(), e->second.end());
      }
    }
  }
  return mesh;
}

/// Four hexahedra per tetrahedron; midpoints are shared, so the result is conforming.
void subdivide_tets(RawMesh& mesh) {
  std::map<std::vector<int>, int> middle;
  const auto mid = [&](std::vector<int> of) {
    std::sort(of.begin(), of.end());
    const auto [at, fresh] = middle.try_emplace(of, static_cast<int>(mesh.nodes.size()));
    if (fresh) {
      Vec3 x = Vec3::Zero();
      for (int n : of) x += mesh.nodes[n] / static_cast<double>(of.size());
      mesh.nodes.push_back(x);
      for (auto& [name, nodes] : mesh.groups) {
        bool all = true;
        for (int n : of) all = all && nodes.count(n);
        if (all) nodes.insert(at->second);
      }
    }
    return at->second;
  };
  for (const auto& t : mesh.tets) {
    const int c = mid({t[0], t[1], t[2], t[3]});
    for (int i = 0; i < 4; ++i) {
      // The corner's three neighbours, counter-clockwise seen from outside for a positive tetrahedron.
      static const int around[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
      const int v = t[i], a = t[around[i][0]], b = t[around[i][1]], d = t[around[i][2]];
      mesh.hexes.push_back({v, mid({v, a}), mid({v, a, b}), mid({v, b}), mid({v, d}), mid({v, a, d}), c, mid({v, b, d})});
    }
  }
  mesh.tets.clear();
}

}  // namespace

HexMesh read_mesh(const StructureSpec& spec) {
  const std::string extension = upper(std::filesystem::path(spec.file).extension().string());
  RawMesh raw;
  if (extension == ".MSH") raw = read_gmsh(spec.file);
  else if (extension == ".INP") raw = read_abaqus(spec.file);
  else {
    Problem p;
    p.key = "structure." + spec.name + ".file";
    p.value = spec.file;
    p.rule = "Gmsh .msh and Abaqus/CalculiX .inp are read";
    p.remedy = "export the mesh in one of these formats";
    throw InputError(p);
  }
  subdivide_tets(raw);
  if (raw.hexes.empty()) {
    Problem p;
    p.file = spec.file;
    p.key = "structure." + spec.name + ".file";
    p.rule = "the mesh has no hexahedra and no tetrahedra";
    p.remedy = "mesh the volume, and save all elements";
    throw InputError(p);
  }
  // Only nodes that belong to a cell, in the order of the file.
  std::vector<int> number(raw.nodes.size(), -1);
  for (const auto& hex : raw.hexes)
    for (int n : hex) number[n] = 0;
  HexMesh mesh;
  for (std::size_t n = 0; n < raw.nodes.size(); ++n)
    if (number[n] == 0) number[n] = static_cast<int>(mesh.nodes.size()), mesh.nodes.push_back(raw.nodes[n]);
  for (auto hex : raw.hexes) {
    for (int& n : hex) n = number[n];
    mesh.hexes.push_back(hex);
  }
  for (const auto& [name, nodes] : raw.groups) {
    auto& list = mesh.node_groups[name];
    for (int n : nodes)
      if (number[n] >= 0) list.push_back(number[n]);
  }
  mesh.local = mesh.nodes;
  // With "centred" the volume centroid goes to the position; without, the coordinates are the world's, moved by it.
  bool centred = false;
  for (const auto& [key, value] : spec.parameters) centred = centred || (key == "centred" && value != 0);
  Vec3 pivot = Vec3::Zero();
  if (centred) {
    double volume = 0;
    for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell)
      for (int q = 0; q < 8; ++q) {
        const double w = jacobian(mesh, cell, gauss_point(q)).determinant();
        const auto shape = shape_values(gauss_point(q));
        for (int a = 0; a < 8; ++a) pivot += w * shape[a] * mesh.nodes[mesh.hexes[cell][a]];
        volume += w;
      }
    if (volume != 0) pivot /= volume;
  }
  for (Vec3& x : mesh.nodes) x = spec.rotation * (x - pivot) + spec.position;
  return mesh;
}

}  // namespace talus::fem
