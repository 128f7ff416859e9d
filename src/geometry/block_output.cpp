#include "geometry/block_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "core/csv.hpp"
#include "core/names.hpp"
#include "core/text_file.hpp"
#include "geometry/mass_properties.hpp"

namespace talus::geometry {
namespace {

constexpr std::size_t shown_of_a_name = 60;  // [bytes]

std::string block_field(const std::string& prefix, std::size_t number) {
  return csv_field(prefix + std::to_string(number));
}

}  // namespace

Mesh block_system(const CutResult& cut, const std::string& prefix) {
  Mesh mesh;
  for (std::size_t b = 0; b < cut.blocks.size(); ++b) {
    const CutBlock& block = cut.blocks[b];
    const int base = static_cast<int>(mesh.vertices.size());
    for (const Vec3& v : block.body.vertices) mesh.vertices.push_back(block.centroid + v);
    for (const auto& t : block.body.triangles) {
      mesh.triangles.push_back({base + t[0], base + t[1], base + t[2]});
      mesh.group.push_back(static_cast<int>(b));
    }
    mesh.group_names.push_back(prefix + std::to_string(b + 1));
  }
  return mesh;
}

int group_line(const std::string& path, const std::string& name) {
  std::ifstream file(path, std::ios::binary);
  int last = 0, number = 0;
  for (std::string text; std::getline(file, text);) {
    ++number;
    const auto blank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
    const auto word = std::find_if_not(text.begin(), text.end(), blank),
               end = std::find_if(word, text.end(), blank);
    if (end - word != 1 || (*word != 'g' && *word != 'o')) continue;
    const auto from =
        std::find_if_not(end, text.end(), [](char c) { return c == ' ' || c == '\t' || c == '\r'; });
    auto to = text.end();
    while (to > from && blank(*(to - 1))) --to;
    if (std::string_view(from, to) == name) last = number;
  }
  return last;
}

std::vector<NamedBlock> read_block_system(const std::string& path) {
  Mesh all = read_mesh(path);
  if (all.group.empty()) {
    all.group.assign(all.triangles.size(), 0);
    all.group_names = {"R1"};
  }
  std::vector<NamedBlock> blocks;
  std::vector<Problem> problems;
  for (int g = 0; g < static_cast<int>(all.group_names.size()); ++g) {
    Mesh part;
    std::map<int, int> number;
    for (std::size_t t = 0; t < all.triangles.size(); ++t) {
      if (all.group[t] != g) continue;
      std::array<int, 3> c;
      for (int k = 0; k < 3; ++k) {
        const auto [it, is_new] = number.emplace(all.triangles[t][k], static_cast<int>(part.vertices.size()));
        if (is_new) part.vertices.push_back(all.vertices[it->first]);
        c[k] = it->second;
      }
      part.triangles.push_back(c);
    }
    if (part.triangles.empty()) continue;
    const std::string &name = all.group_names[g], key = "group " + name;
    if (!is_name(name)) {
      problems.push_back({.file = path,
                          .line = group_line(path, name),
                          .key = "group",
                          .value = "\"" + name.substr(0, shown_of_a_name) + "\"",
                          .rule = name_rule,
                          .remedy = "name the group of every block: the block has its name"});
      continue;
    }
    auto found = closed_mesh_problems(part, path);
    for (Problem& p : found) p.key = key + ": " + p.key;
    if (found.empty())
      if (const int pieces = body_count(part); pieces > 1)
        found.push_back(
            {.file = path,
             .line = group_line(path, name),
             .key = key,
             .rule = fmt::format("is {} pieces that do not touch, as of blocks of one name", pieces),
             .remedy = "give every block a group of its own name"});
    if (!found.empty()) {
      problems.insert(problems.end(), found.begin(), found.end());
      continue;
    }
    const MassProperties m = mass_properties(part.vertices, part.triangles, 1);
    for (Vec3& v : part.vertices) v -= m.centroid;
    blocks.push_back(
        {all.group_names[g], make_polyhedron(part.vertices, part.triangles), m.centroid, m.volume});
  }
  if (!problems.empty()) throw InputError(std::move(problems));
  return blocks;
}

void write_blocks_vtu(const std::string& path, const CutResult& cut, const std::vector<KeyBlock>& keys) {
  std::string points, connectivity, offsets, types, block, volume, joint, type, safety;
  std::size_t vertices = 0, cells = 0, corners = 0;
  for (std::size_t b = 0; b < cut.blocks.size(); ++b) {
    const CutBlock& c = cut.blocks[b];
    for (const Vec3& v : c.body.vertices) {
      const Vec3 x = c.centroid + v;
      points += fmt::format("{} {} {}\n", x.x(), x.y(), x.z());
    }
    for (int f = 0; f < c.body.faces(); ++f) {
      for (int k = c.body.face_offset[f]; k < c.body.face_offset[f + 1]; ++k) {
        connectivity += fmt::format("{} ", vertices + static_cast<std::size_t>(c.body.face_vertices[k]));
        ++corners;
      }
      connectivity += "\n";
      offsets += fmt::format("{}\n", corners);
      types += "7\n";  // polygon
      block += fmt::format("{}\n", b + 1);
      volume += fmt::format("{}\n", c.volume);
      joint += fmt::format("{}\n", c.body.face_joint_set[f]);
      if (!keys.empty()) {
        type += fmt::format("{}\n", static_cast<int>(keys[b].type));
        safety += fmt::format("{}\n", std::min(keys[b].factor_of_safety, 1e6));
      }
      ++cells;
    }
    vertices += c.body.vertices.size();
  }
  const auto array = [](const char* kind, const char* name, const std::string& data) {
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" format=\"ascii\">\n{}</DataArray>\n", kind, name,
                       data);
  };
  std::string out = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
      "byte_order=\"LittleEndian\">\n<UnstructuredGrid><Piece NumberOfPoints=\"{}\" "
      "NumberOfCells=\"{}\">\n<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
      "format=\"ascii\">\n{}</DataArray></Points>\n<Cells>\n",
      vertices, cells, points);
  out += array("Int64", "connectivity", connectivity) + array("Int64", "offsets", offsets) +
         array("UInt8", "types", types) + "</Cells>\n<CellData>\n";
  out += array("Int32", "block", block) + array("Float64", "volume", volume) +
         array("Int32", "joint_set", joint);
  if (!keys.empty())
    out += array("Int32", "removability", type) + array("Float64", "factor_of_safety", safety);
  out += "</CellData></Piece></UnstructuredGrid></VTKFile>\n";
  write_bytes(path, out);
}

void write_blocks_csv(const std::string& path, const CutResult& cut, const std::string& prefix,
                      const std::vector<KeyBlock>& keys) {
  std::string out = "block,volume_m3,x_m,y_m,z_m,faces,convex,cells";
  if (!keys.empty()) out += ",type,mode,joint_1,joint_2,factor_of_safety";
  out += "\n";
  const auto joint_name = [&](int j) {
    return j >= 0 && j < static_cast<int>(cut.joint_names.size()) ? csv_field(cut.joint_names[j])
                                                                  : std::string();
  };
  for (std::size_t b = 0; b < cut.blocks.size(); ++b) {
    const CutBlock& c = cut.blocks[b];
    out += fmt::format("{},{},{},{},{},{},{},{}", block_field(prefix, b + 1), c.volume, c.centroid.x(),
                       c.centroid.y(), c.centroid.z(), c.body.faces(), c.body.convex ? 1 : 0, c.cells);
    if (!keys.empty()) {
      const KeyBlock& k = keys[b];
      out += fmt::format(",{},{},{},{},{}", name_of(k.type), name_of(k.mode), joint_name(k.joint_1),
                         joint_name(k.joint_2),
                         std::isfinite(k.factor_of_safety) ? fmt::format("{}", k.factor_of_safety) : "");
    }
    out += "\n";
  }
  write_bytes(path, out);
}

void write_interfaces_csv(const std::string& path, const CutResult& cut, const std::string& prefix) {
  std::string out = "block_a,block_b,joint,area_m2,bonded_area_m2,tension_pa,shear_pa,x_m,y_m,z_m\n";
  for (const CutInterface& i : cut.interfaces)
    out +=
        fmt::format("{},{},{},{},{},{},{},{},{},{}\n", block_field(prefix, static_cast<std::size_t>(i.a) + 1),
                    block_field(prefix, static_cast<std::size_t>(i.b) + 1),
                    i.joint >= 0 ? csv_field(cut.joint_names[i.joint]) : std::string(), i.area, i.bonded_area,
                    i.tension, i.shear, i.centroid.x(), i.centroid.y(), i.centroid.z());
  write_bytes(path, out);
}

SizeCurve size_curve(const CutResult& cut) {
  SizeCurve c;
  for (const CutBlock& b : cut.blocks) c.volume.push_back(b.volume);
  std::sort(c.volume.begin(), c.volume.end());
  double total = 0, sum = 0;
  for (double v : c.volume) total += v;
  for (double v : c.volume) c.passing.push_back((sum += v) / total);
  const auto at = [&](double share) {
    for (std::size_t k = 0; k < c.passing.size(); ++k)
      if (c.passing[k] >= share * (1 - 1e-12)) return c.volume[k];
    return c.volume.empty() ? 0.0 : c.volume.back();
  };
  c.v25 = at(0.25), c.v50 = at(0.5), c.v75 = at(0.75), c.v90 = at(0.9);
  return c;
}

void write_size_curve_csv(const std::string& path, const SizeCurve& c) {
  std::string out = "volume_m3,passing\n";
  for (std::size_t k = 0; k < c.volume.size(); ++k) out += fmt::format("{},{}\n", c.volume[k], c.passing[k]);
  write_bytes(path, out);
}

std::string size_curve_svg(const SizeCurve& c) {
  const double w = 640, h = 420, left = 70, right = 20, top = 40, bottom = 60;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" "
      "font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<text x=\"{}\" y=\"24\" text-anchor=\"middle\" font-size=\"15\">Block size distribution</text>\n",
      w, h, w / 2);
  if (c.volume.empty()) return out + "</svg>\n";
  const double lo = std::floor(std::log10(c.volume.front())),
               hi = std::max(lo + 1, std::ceil(std::log10(c.volume.back())));
  const auto x = [&](double v) { return left + (std::log10(v) - lo) / (hi - lo) * (w - left - right); };
  const auto y = [&](double p) { return h - bottom - p * (h - top - bottom); };
  for (double e = lo; e <= hi; ++e)
    out += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" "
        "y=\"{3}\" text-anchor=\"middle\">{4:g}</text>\n",
        x(std::pow(10, e)), top, h - bottom, h - bottom + 18, std::pow(10, e));
  for (int k = 0; k <= 4; ++k)
    out += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/><text x=\"{3}\" "
        "y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
        left, w - right, y(k / 4.0), left - 8, y(k / 4.0) + 4, 25 * k);
  std::string line = fmt::format("M{:.2f},{:.2f}", x(c.volume.front()), y(0));
  double before = 0;
  for (std::size_t k = 0; k < c.volume.size(); ++k) {
    line += fmt::format(" L{:.2f},{:.2f} L{:.2f},{:.2f}", x(c.volume[k]), y(before), x(c.volume[k]),
                        y(c.passing[k]));
    before = c.passing[k];
  }
  out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"2\"/>\n", line);
  out += fmt::format(
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">Block volume, m³ ({} blocks, half of the volume in "
      "blocks below {:.3g} m³)</text>\n",
      (left + w - right) / 2, h - 16, c.volume.size(), c.v50);
  out += fmt::format(
      "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">Passing, % of "
      "volume</text>\n</svg>\n",
      (top + h - bottom) / 2);
  return out;
}

}  // namespace talus::geometry
