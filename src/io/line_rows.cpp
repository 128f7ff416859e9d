#include "io/line_rows.hpp"

#include <stdexcept>

#include "io/bytes.hpp"
#include "io/hdf5_file.hpp"

namespace talus::io {
namespace {

template <class Row, class F>
void fields(Row& r, F&& f) {
  f(r.line), f(r.block), f(r.time), f(r.position), f(r.velocity), f(r.spin), f(r.translational),
      f(r.rotational), f(r.height);
}

template <class Item, class Get>
std::vector<Item> list(std::string_view bytes, Get&& get) {
  ByteReader r(bytes);
  std::vector<Item> items;
  for (auto n = r.take<std::uint64_t>(); n > 0; --n)
    get(r, items.emplace_back());  // a count that lies ends with the record
  return items;
}

}  // namespace

std::string encode_line_names(std::span<const std::string> names) {
  ByteWriter w;
  w.put(static_cast<std::uint64_t>(names.size()));
  for (const std::string& name : names) w.put(name);
  return w.bytes();
}

std::vector<std::string> decode_line_names(std::string_view bytes) {
  return list<std::string>(bytes, [](ByteReader& r, std::string& name) { r.get(name); });
}

std::string encode_line_rows(std::span<const LineRow> rows) {
  ByteWriter w;
  w.put(static_cast<std::uint64_t>(rows.size()));
  for (const LineRow& row : rows) fields(row, [&](const auto& x) { w.put(x); });
  return w.bytes();
}

std::vector<LineRow> decode_line_rows(std::string_view bytes) {
  return list<LineRow>(bytes, [](ByteReader& r, LineRow& row) { fields(row, [&](auto& x) { r.get(x); }); });
}

void write_lines(Hdf5File& file, std::span<const std::string> names, std::span<const LineRow> rows,
                 const std::string& crs) {
  for (std::size_t l = 0; l < names.size(); ++l) {
    std::vector<std::int64_t> block;
    std::vector<double> time, position, velocity, spin, translational, rotational, height;
    const auto add = [](std::vector<double>& to, const Vec3& v) {
      to.insert(to.end(), v.data(), v.data() + 3);
    };
    for (const LineRow& r : rows) {
      if (r.line != static_cast<int>(l)) continue;
      block.push_back(r.block), time.push_back(r.time), translational.push_back(r.translational),
          rotational.push_back(r.rotational), height.push_back(r.height);
      add(position, r.position), add(velocity, r.velocity), add(spin, r.spin);
    }
    const std::size_t n = block.size();
    const std::string at = "/lines/" + names[l] + "/";
    file.write<std::int64_t>(at + "block", block, {n}, "1", "place of the block in the scene, from 0");
    file.write<double>(at + "time", time, {n}, "s", "of the crossing");
    file.write<double>(at + "position", position, {n, 3}, "m", "of the centroid, scene coordinates");
    file.write<double>(at + "velocity", velocity, {n, 3}, "m/s", "of the centroid");
    file.write<double>(at + "spin", spin, {n, 3}, "rad/s", "world axes");
    file.write<double>(at + "kinetic_translational", translational, {n}, "J", "m |v|^2 / 2");
    file.write<double>(at + "kinetic_rotational", rotational, {n}, "J", "of rotation and strain rate");
    file.write<double>(at + "height", height, {n}, "m", "of the centroid above the ground");
    file.attribute("/lines/" + names[l], "crs", crs);
  }
}

}  // namespace talus::io
