/// What the readers of volume meshes share; no one else includes this.
#pragma once
#include <fmt/format.h>

#include <sstream>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/error.hpp"
#include "core/solid_mesh.hpp"
#include "core/text_file.hpp"

namespace talus::solid_mesh {

/// A mesh in the making, with the node numbers of its file.
struct Draft : SolidMesh {
  std::unordered_map<long, int> number;  // tag in the file -> index; for look-up only
};

/// The lines of a file, counted for messages.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), in_(read_text(path)) {}
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
    if (v.size() < least)
      fail(text_, fmt::format("at least {} numbers are expected here", least),
           "write the file again as ASCII");
    return v;
  }
  int node(const Draft& mesh, long tag) const {
    const auto found = mesh.number.find(tag);
    if (found == mesh.number.end())
      fail(fmt::format("node {}", tag), "the node is not defined", "write the nodes with the elements");
    return found->second;
  }

 private:
  std::string path_;
  std::istringstream in_;
  std::string text_;
  int number_ = 0;
};

/// A tag or count that stands among real numbers.
long whole(const Reader& in, double x);

void add_node(const Reader& in, Draft& mesh, long tag, const Vec3& x);

std::string upper(std::string s);

/// A group of the mesh whose name the format of `path` cannot hold.
[[noreturn]] void refuse_group(const std::string& path, const std::string& name, const std::string& rule);

SolidMesh read_gmsh(const std::string& path);
SolidMesh read_abaqus(const std::string& path);
std::string gmsh_text(const std::string& path, const SolidMesh& mesh);
std::string abaqus_text(const std::string& path, const SolidMesh& mesh);

}  // namespace talus::solid_mesh
