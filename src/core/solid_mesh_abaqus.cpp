// Abaqus and CalculiX .inp: nodes, C3D8 and C3D4, sets.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>

#include "core/solid_mesh_file.hpp"

namespace talus::solid_mesh {
namespace {

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

/// One file, line by line: a line with a star opens what the lines after it hold.
class AbaqusFile {
 public:
  explicit AbaqusFile(const std::string& path) : in_(path) {}

  SolidMesh read() {
    while (in_.line()) {
      const std::string& line = in_.text();
      if (line.empty() || line.rfind("**", 0) == 0) continue;
      const auto f = fields(line);
      if (line[0] == '*')
        keyword(f);
      else if (keyword_ == "*NODE")
        node(f);
      else if (keyword_ == "*ELEMENT")
        element(f);
      else if (keyword_ == "*INSTANCE")
        placement(f);
      else if (keyword_ == "*SYSTEM")
        in_.fail(line, "nodes are read in the axes of the whole, these have axes of their own",
                 "write the mesh without *SYSTEM, with the nodes where they belong");
      else if ((keyword_ == "*NSET" || keyword_ == "*ELSET") && !set_.empty())
        set(f);
    }
    return std::move(mesh_);
  }

 private:
  long number(const std::string& s) const {
    char* end = nullptr;
    const long v = std::strtol(s.c_str(), &end, 10);
    if (s.empty() || *end) in_.fail(s, "a whole number is expected", "correct the line");
    return v;
  }

  void keyword(const std::vector<std::string>& f) {
    if (!pending_.empty()) in_.fail("", "the element before has too few nodes", "complete it");
    keyword_ = upper(f[0]);
    set_.clear(), generate_ = false;
    const std::string_view own = keyword_ == "*NODE" || keyword_ == "*NSET" ? "NSET" : "ELSET";
    std::string type, system, elements;
    bool input = false;
    for (std::size_t i = 1; i < f.size(); ++i) {
      const auto eq = f[i].find('=');
      const std::string key = upper(f[i].substr(0, eq)),
                        value = eq == std::string::npos ? "" : f[i].substr(eq + 1);
      if (key == own) set_ = value;
      if (key == "ELSET") elements = value;
      if (key == "TYPE") type = upper(value);
      if (key == "GENERATE") generate_ = true;
      if (key == "SYSTEM") system = upper(value);
      if (key == "INPUT") input = true;
    }
    static const std::set<std::string> written_elsewhere{"*INCLUDE", "*NGEN",  "*NFILL", "*NCOPY",
                                                         "*NMAP",    "*ELGEN", "*ELCOPY"};
    if (written_elsewhere.count(keyword_) > 0 || input)
      in_.fail(in_.text(), "nodes and elements that are included, generated, copied or mapped are not read",
               "write the mesh into one file, each node and each element with its line");
    if (keyword_ == "*NODE" && !system.empty() && system != "R")
      in_.fail(in_.text(), "cylindrical and spherical coordinates are not read",
               "write the nodes in Cartesian coordinates");
    if (keyword_ == "*ELEMENT") element_type(type);
    if (keyword_ == "*NSET" && !set_.empty() && !elements.empty()) add(elements, mesh_.groups[set_]);
  }

  /// Lines and surfaces carry no volume: they only name groups.
  void element_type(const std::string& type) {
    static const std::map<std::string, std::size_t> flat{
        {"T3D2", 2}, {"B31", 2},   {"CPS3", 3}, {"CPE3", 3}, {"S3", 3},   {"M3D3", 3},   {"CPS4", 4},
        {"CPE4", 4}, {"CPS4R", 4}, {"S4", 4},   {"S4R", 4},  {"M3D4", 4}, {"SFM3D3", 3}, {"SFM3D4", 4}};
    const auto named = flat.find(type);
    solid_ = named == flat.end();
    type_ = type;
    if (!solid_)
      wanted_ = named->second;
    else if (type.rfind("C3D8", 0) == 0)
      wanted_ = 8;
    else if (type == "C3D4")
      wanted_ = 4;
    else
      in_.fail("TYPE=" + type, "only C3D8 (hexahedra) and C3D4 (tetrahedra) are supported",
               "remesh with first-order hexahedra or tetrahedra");
  }

  void node(const std::vector<std::string>& f) {
    if (f.size() < 4) in_.fail(in_.text(), "number, x, y, z are expected", "correct the line");
    if (std::any_of(f.begin() + 4, f.end(), [](const std::string& s) { return !s.empty(); }))
      in_.fail(in_.text(),
               "number, x, y, z are expected, and nothing after them: are the commas decimal ones?",
               "write numbers with decimal points, separated by commas");
    Vec3 x;
    for (int c = 0; c < 3; ++c) {
      char* end = nullptr;
      x[c] = std::strtod(f[1 + c].c_str(), &end);
      if (f[1 + c].empty() || *end) in_.fail(f[1 + c], "a coordinate is expected", "correct the line");
    }
    add_node(in_, mesh_, number(f[0]), x);
    if (!set_.empty()) mesh_.groups[set_].insert(static_cast<int>(mesh_.nodes.size()) - 1);
  }

  /// An element goes on in the next line where its line ends with a comma.
  void element(const std::vector<std::string>& f) {
    for (const std::string& s : f)
      if (!s.empty()) pending_.push_back(number(s));
    if (pending_.size() < wanted_ + 1 && in_.text().back() == ',') return;
    if (pending_.size() < wanted_ + 1 || (solid_ && pending_.size() > wanted_ + 1))
      in_.fail(in_.text(),
               fmt::format("{} nodes where an element of {} has {}", pending_.size() - 1, type_, wanted_),
               "correct the line; one that goes on in the next ends with a comma");
    std::vector<int> nodes;
    for (std::size_t i = 1; i <= wanted_; ++i) nodes.push_back(in_.node(mesh_, pending_[i]));
    if (solid_ && wanted_ == 8) {
      std::array<int, 8> hex{};
      std::copy(nodes.begin(), nodes.end(), hex.begin());
      mesh_.hexes.push_back(hex);
      mesh_.hex_numbers.push_back(pending_[0]);
    } else if (solid_) {
      mesh_.tets.push_back({nodes[0], nodes[1], nodes[2], nodes[3]});
      mesh_.tet_numbers.push_back(pending_[0]);
    } else {
      ++mesh_.without_volume[type_];
    }
    if (!set_.empty()) mesh_.groups[set_].insert(nodes.begin(), nodes.end());
    if (!element_nodes_.emplace(pending_[0], std::move(nodes)).second)
      in_.fail(fmt::format("element {}", pending_[0]), "the number was given to another element above",
               "number the elements of all parts through");
    pending_.clear();
  }

  /// What moves or turns an instance of a part.
  void placement(const std::vector<std::string>& f) const {
    for (const std::string& s : f)
      if (!s.empty() && std::strtod(s.c_str(), nullptr) != 0)
        in_.fail(in_.text(), "instances are read where their part stands, this one is moved",
                 "write the mesh flat (no parts and instances), with the nodes where they belong");
  }

  void set(const std::vector<std::string>& f) {
    std::set<int>& group = mesh_.groups[set_];
    for (const long m : generate_ ? range(f) : listed(f, group)) {
      if (keyword_ == "*NSET")
        group.insert(in_.node(mesh_, m));
      else if (const auto e = element_nodes_.find(m); e != element_nodes_.end())
        group.insert(e->second.begin(), e->second.end());
      else
        in_.fail(fmt::format("element {}", m), "the element is not defined",
                 "write sets after their elements, and only elements that are in the file into them");
    }
  }

  /// A set as a part of another one.
  void add(const std::string& name, std::set<int>& group) {
    const auto other = mesh_.groups.find(name);
    if (other == mesh_.groups.end())
      in_.fail(name, "no set of this name is defined above", "write sets before those that hold them");
    group.insert(other->second.begin(), other->second.end());
  }

  /// Numbers as they are; a name stands for a set told before.
  std::vector<long> listed(const std::vector<std::string>& f, std::set<int>& group) {
    std::vector<long> members;
    for (const std::string& s : f) {
      if (s.empty()) continue;
      if (std::isdigit(static_cast<unsigned char>(s[0])))
        members.push_back(number(s));
      else
        add(s, group);
    }
    return members;
  }

  std::vector<long> range(const std::vector<std::string>& f) const {
    if (f.size() < 2) in_.fail(in_.text(), "first, last, step are expected", "correct the line");
    const long step = f.size() > 2 && !f[2].empty() ? number(f[2]) : 1;
    if (step <= 0) in_.fail(in_.text(), "the step must be positive", "correct the line");
    const long first = number(f[0]), last = number(f[1]);
    // Unsigned: the distance of any two numbers.
    const unsigned long count = first <= last
                                    ? (static_cast<unsigned long>(last) - static_cast<unsigned long>(first)) /
                                              static_cast<unsigned long>(step) +
                                          1
                                    : 0;
    if (count > 10'000'000)
      in_.fail(in_.text(), "the range has more than ten million members", "correct the range");
    std::vector<long> members;
    for (unsigned long k = 0; k < count; ++k) members.push_back(first + static_cast<long>(k) * step);
    return members;
  }

  Reader in_;
  Draft mesh_;
  std::string keyword_, type_, set_;
  bool generate_ = false, solid_ = true;
  std::size_t wanted_ = 0;
  std::vector<long> pending_;  // numbers of an element that is not yet complete
  std::unordered_map<long, std::vector<int>> element_nodes_;  // for look-up only
};

}  // namespace

SolidMesh read_abaqus(const std::string& path) { return AbaqusFile(path).read(); }

std::string abaqus_text(const std::string& path, const SolidMesh& mesh) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "*NODE\n");
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    fmt::format_to(out, "{}, {}, {}, {}\n", n + 1, mesh.nodes[n].x(), mesh.nodes[n].y(), mesh.nodes[n].z());
  std::size_t element = 0;
  const auto cells = [&](std::string_view type, const auto& list) {
    if (list.empty()) return;
    fmt::format_to(out, "*ELEMENT, TYPE={}, ELSET=Eall\n", type);
    for (const auto& cell : list) {
      fmt::format_to(out, "{}", ++element);
      for (const int n : cell) fmt::format_to(out, ", {}", n + 1);
      text.push_back('\n');
    }
  };
  cells("C3D8", mesh.hexes);
  cells("C3D4", mesh.tets);
  for (const auto& [name, nodes] : mesh.groups) {
    if (name.empty() || name.find_first_of(",\"*=\n\r\t ") != std::string::npos)
      refuse_group(path, name,
                   "the name of a set in an .inp file holds no blank and none of , = * and quotation marks");
    fmt::format_to(out, "*NSET, NSET={}\n", name);
    std::size_t on_line = 0;
    for (const int n : nodes)
      fmt::format_to(out, "{}{}", n + 1, ++on_line % 16 == 0 || on_line == nodes.size() ? "\n" : ", ");
  }
  return fmt::to_string(text);
}

}  // namespace talus::solid_mesh
