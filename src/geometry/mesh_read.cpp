#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>

#include "core/text_file.hpp"
#include "geometry/mesh_builder.hpp"
#include "geometry/text_cursor.hpp"

namespace talus::geometry {
namespace {

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string ending(const std::string& path) {
  const auto slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  return lower_case(path.substr(dot + 1));
}

/// A number from a file as a whole number in 0 .. limit - 1; `limit` if it is none.
long whole_below(double x, long limit) {
  return x >= 0 && x < static_cast<double>(limit) ? static_cast<long>(x) : limit;
}

Mesh read_stl_binary(const std::string& text) {
  std::uint32_t n;
  std::memcpy(&n, text.data() + 80, 4);
  Mesh mesh;
  VertexTable table(mesh.vertices, n / 2 + 8);
  mesh.triangles.resize(n);
  for (std::uint32_t t = 0; t < n; ++t) {
    float c[12];
    std::memcpy(c, text.data() + 84 + 50ull * t, 48);
    for (int k = 0; k < 3; ++k)
      mesh.triangles[t][k] = table.add(Vec3(c[3 + 3 * k], c[4 + 3 * k], c[5 + 3 * k]));
  }
  return mesh;
}

/// Words of the format in either case: some programs write SOLID, FACET, VERTEX.
Mesh read_stl_text(const std::string& text, const std::string& name) {
  TextCursor in(text, name);
  Mesh mesh;
  VertexTable table(mesh.vertices, text.size() / 500);
  mesh.triangles.reserve(text.size() / 240);
  std::array<int, 3> corner{};
  int corners = 0, solids = 0;
  while (!in.at_end()) {
    const char* start = in.position();
    const std::string word = lower_case(in.word());
    if (word == "vertex") {
      Vec3 p;
      for (int k = 0; k < 3; ++k) p[k] = in.number<double>("vertex");
      if (corners >= 3) in.position(start), in.fail("facet", "must have three vertices");
      corner[corners++] = table.add(p);
    } else if (word == "endloop") {
      if (corners != 3) in.position(start), in.fail("facet", "must have three vertices");
      mesh.triangles.push_back(corner);
      mesh.group.push_back(std::max(0, solids - 1));
      corners = 0;
    } else if (word == "facet" || word == "endsolid") {
      in.rest_of_line();
    } else if (word == "outer" || word == "loop" || word == "endfacet") {
    } else if (word == "solid") {
      const std::string_view name = in.rest_of_line();
      const auto first = name.find_first_not_of(" \t\r"), last = name.find_last_not_of(" \t\r");
      mesh.group_names.emplace_back(first == std::string_view::npos ? std::string_view()
                                                                    : name.substr(first, last - first + 1));
      ++solids;
    } else {
      in.position(start);
      in.fail("stl", "is not a word of the STL format");
    }
  }
  if (corners != 0) in.fail("facet", "file ends within a facet");
  if (solids < 2) mesh.group.clear(), mesh.group_names.clear();  // all one
  return mesh;
}

/// A backslash at the end of a line of an OBJ file goes on with the next.
std::string with_joined_lines(std::string text) {
  for (auto at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1))
    for (const std::string_view end : {"\n", "\r\n"})
      if (text.compare(at + 1, end.size(), end) == 0) text.replace(at, 1 + end.size(), 1 + end.size(), ' ');
  return text;
}

Mesh read_obj(const std::string& given, const std::string& name) {
  const std::string joined = given.find('\\') == std::string::npos ? std::string() : with_joined_lines(given),
                    &text = joined.empty() ? given : joined;
  TextCursor in(text, name);
  Builder b;
  b.name = name;
  std::vector<int> loop;
  while (!in.at_end()) {
    const auto word = in.word();
    if (word == "v") {
      Vec3 p;
      for (int k = 0; k < 3; ++k) p[k] = in.number<double>("v");
      b.points.push_back(p);
    } else if (word == "f") {
      loop.clear();
      while (!in.at_line_end()) {
        const char* start = in.position();
        const long i = in.number<long>("f");
        const long n = static_cast<long>(b.points.size()), v = i < 0 ? n + i : i - 1;
        if (i == 0 || v < 0 || v >= n)
          in.position(start), in.fail("f", fmt::format("vertex must be in 1..{} (or -{}..-1)", n, n));
        loop.push_back(static_cast<int>(v));
        in.skip_to_blank();  // texture and normal indices follow a slash
      }
      b.face(loop, &in);
    } else if (word == "g" || word == "o") {
      b.start_group(std::string(in.rest_of_line()));
      continue;
    }
    in.rest_of_line();
  }
  return b.finish();
}

Mesh read_off(const std::string& text, const std::string& name) {
  TextCursor in(text, name);
  Builder b;
  b.name = name;
  in.skip_comments();
  const auto word = in.word();
  if (word != "OFF" && word != "COFF" && word != "NOFF") in.fail("off", "must begin with OFF");
  in.skip_comments();
  const long nv = in.number<long>("vertices"), nf = in.number<long>("faces");
  if (nv < 0 || nf < 0) in.fail("off", "counts must not be negative");
  if (static_cast<std::size_t>(nv) > text.size()) in.fail("off", "more vertices than the file can hold");
  in.rest_of_line();
  b.points.resize(nv);
  for (Vec3& p : b.points) {
    in.skip_comments();
    for (int k = 0; k < 3; ++k) p[k] = in.number<double>("vertex");
    in.rest_of_line();
  }
  std::vector<int> loop;
  for (long f = 0; f < nf; ++f) {
    in.skip_comments();
    const long n = in.number<long>("face");
    loop.clear();
    for (long k = 0; k < n; ++k) {
      in.skip_space();
      const char* start = in.position();
      const long v = in.number<long>("face");
      if (v < 0 || v >= nv)
        in.position(start), in.fail("face", fmt::format("vertex must be in 0..{}", nv - 1));
      loop.push_back(static_cast<int>(v));
    }
    b.face(loop, &in);
    in.rest_of_line();  // colours
  }
  in.expect_end("off");
  return b.finish();
}

/// One PLY property or element, from the header.
struct PlyProperty {
  std::string name;
  int size = 0, count_size = 0;       // bytes; count_size > 0: list
  char kind = 'f', count_kind = 'u';  // f float, i signed, u unsigned
};
struct PlyElement {
  std::string name;
  long count = 0;
  std::vector<PlyProperty> properties;
};

bool ply_type(std::string_view word, int& size, char& kind) {
  static const std::map<std::string_view, std::pair<int, char>> types = {
      {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
      {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
      {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
      {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
  const auto it = types.find(word);
  if (it == types.end()) return false;
  size = it->second.first, kind = it->second.second;
  return true;
}

double ply_value(const char* p, int size, char kind, bool swap) {
  unsigned char raw[8];
  std::memcpy(raw, p, size);
  if (swap) std::reverse(raw, raw + size);
  const auto as = [&]<class T>(T x) {
    std::memcpy(&x, raw, sizeof x);
    return static_cast<double>(x);
  };
  switch (kind) {
    case 'f': return size == 4 ? as(float{}) : as(double{});
    case 'i': return size == 1 ? as(std::int8_t{}) : size == 2 ? as(std::int16_t{}) : as(std::int32_t{});
    default: return size == 1 ? as(std::uint8_t{}) : size == 2 ? as(std::uint16_t{}) : as(std::uint32_t{});
  }
}

Mesh read_ply(const std::string& text, const std::string& name) {
  TextCursor in(text, name);
  if (in.rest_of_line() != "ply") in.fail("ply", "must begin with ply");
  std::vector<PlyElement> elements;
  bool is_text = false, swap = false;
  for (;;) {
    if (in.at_end()) in.fail("ply", "header has no end_header");
    const auto word = in.word();
    if (word == "end_header") {
      in.rest_of_line();
      break;
    }
    if (word == "format") {
      const auto format = in.word();
      is_text = format == "ascii";
      swap = format == "binary_big_endian";
      if (!is_text && !swap && format != "binary_little_endian") in.fail("format", "must be ascii or binary");
    } else if (word == "element") {
      PlyElement e;
      e.name = in.word();
      e.count = in.number<long>("element");
      if (e.count < 0 || static_cast<std::size_t>(e.count) > text.size())
        in.fail("element", "more of them than the file can hold");
      elements.push_back(e);
    } else if (word == "property") {
      if (elements.empty()) in.fail("property", "stands before any element");
      PlyProperty p;
      auto type = in.word();
      if (type == "list") {
        if (!ply_type(in.word(), p.count_size, p.count_kind)) in.fail("property", "unknown type");
        type = in.word();
      }
      if (!ply_type(type, p.size, p.kind)) in.fail("property", "unknown type");
      p.name = in.word();
      elements.back().properties.push_back(p);
    }
    in.rest_of_line();
  }
  Builder b;
  b.name = name;
  std::vector<int> loop;
  const auto next = [&](int size, char kind, const std::string& what) {
    if (is_text) return in.number<double>(what.c_str());
    if (in.end() - in.position() < size) in.fail(what, "file is shorter than its header says");
    const double x = ply_value(in.position(), size, kind, swap);
    in.position(in.position() + size);
    return x;
  };
  for (const PlyElement& e : elements) {
    const bool is_vertex = e.name == "vertex", is_face = e.name == "face";
    for (long i = 0; i < e.count; ++i) {
      Vec3 p = Vec3::Zero();
      for (const PlyProperty& property : e.properties) {
        if (property.count_size > 0) {
          const long most = static_cast<long>(text.size());
          const long n = whole_below(next(property.count_size, property.count_kind, property.name), most);
          if (n == most) in.fail(property.name, "more entries than the file can hold");
          loop.clear();
          for (long k = 0; k < n; ++k)
            loop.push_back(static_cast<int>(whole_below(next(property.size, property.kind, property.name),
                                                        std::numeric_limits<int>::max())));
          if (is_face && (property.name == "vertex_indices" || property.name == "vertex_index")) {
            for (int v : loop)
              if (v >= static_cast<int>(b.points.size()))
                throw InputError(Problem{
                    .file = name,
                    .key = fmt::format("mesh face {}", i),
                    .value = std::to_string(v),
                    .rule = b.points.empty() ? "the file has no vertices before it"
                                             : fmt::format("vertex must be in 0..{}", b.points.size() - 1)});
            b.face(loop, nullptr);
          }
        } else {
          const double x = next(property.size, property.kind, property.name);
          if (property.name == "x") p.x() = x;
          if (property.name == "y") p.y() = x;
          if (property.name == "z") p.z() = x;
        }
      }
      if (is_vertex) b.points.push_back(p);
    }
  }
  in.expect_end("ply");
  return b.finish();
}

/// What is text is read as UTF-8. Binary files stay as they are: those of STL tell by their size, PLY begins
/// with "ply" unless it is text in another encoding.
bool is_binary_stl(const std::string& bytes, std::uint32_t& triangles) {
  if (bytes.size() < 84) return false;
  std::memcpy(&triangles, bytes.data() + 80, 4);
  return bytes.size() == 84 + 50ull * triangles;
}

std::string decoded(std::string bytes, const std::string& name) {
  std::uint32_t n = 0;
  const std::string e = ending(name);
  if ((e == "stl" && is_binary_stl(bytes, n)) || (e == "ply" && bytes.compare(0, 3, "ply") == 0))
    return bytes;
  return as_utf8(std::move(bytes), name);
}

}  // namespace

bool is_mesh_file(const std::string& path) {
  const std::string e = ending(path);
  return e == "stl" || e == "obj" || e == "ply" || e == "off" || e == "vtu";
}

Mesh read_mesh_text(const std::string& text, const std::string& name) {
  const std::string e = ending(name);
  if (e == "stl") {
    std::uint32_t n = 0;
    const bool is_binary = is_binary_stl(text, n);
    const bool is_text = lower_case(TextCursor(text, name).word()) == "solid" &&
                         text.find('\0') == std::string::npos;  // headers of binary files may begin so, too
    if (!is_binary && !is_text)
      throw InputError(Problem{
          .file = name,
          .key = "stl",
          .value = text.size() < 84 ? fmt::format("{} bytes", text.size())
                                    : fmt::format("{} bytes, {} triangles if it is binary", text.size(), n),
          .rule = "neither text (\"solid\" first) nor a whole binary STL (84 + 50 bytes a triangle)",
          .remedy = "export the file again"});
    Mesh mesh = is_binary ? read_stl_binary(text) : read_stl_text(text, name);
    if (mesh.triangles.empty())
      throw InputError(
          Problem{.file = name, .key = "mesh", .rule = "has no faces", .remedy = "give a surface mesh"});
    check_vertices(mesh.vertices, name);
    return mesh;
  }
  if (e == "obj") return read_obj(text, name);
  if (e == "ply") return read_ply(text, name);
  if (e == "off") return read_off(text, name);
  if (e == "vtu") return read_vtu(text, name);
  throw InputError(Problem{.file = name,
                           .key = "file",
                           .value = e,
                           .rule = "not a mesh format that is read",
                           .remedy = "use STL, OBJ, PLY, OFF or VTU"});
}

Mesh read_mesh(const std::string& path) { return read_mesh_text(decoded(read_bytes(path), path), path); }

}  // namespace talus::geometry
