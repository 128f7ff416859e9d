#include "io/records.hpp"

#include <array>
#include <cstring>
#include <stdexcept>

#include "io/bytes.hpp"

namespace talus::io {
namespace {

using sim::ContactRow;
using sim::HistoryRow;
using sim::LedgerRow;
using sim::RunHeader;

void put_block(ByteWriter& w, const RunHeader::BlockInfo& b) {
  w.put(b.name);
  w.put(b.mass);
  w.put(b.volume);
  w.put(b.fixed);
  w.put(b.fragment);
  w.put(b.shape.vertices);
  w.put(b.shape.face_offset);
  w.put(b.shape.face_vertices);
  w.put(b.shape.triangles);
  w.put(b.shape.triangle_face);
  w.put(b.young);
  w.put(b.poisson);
}

void check_indices(const std::vector<std::array<int, 3>>& triangles, std::size_t vertices) {
  for (const auto& t : triangles)
    for (const int v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= vertices) throw std::out_of_range("a triangle names a vertex that is not there");
}

/// A journal that is whole by its checksum may still be none of ours: whoever reads a shape goes by its indices.
void check_shape(const Polyhedron& s) {
  check_indices(s.triangles, s.vertices.size());
  int before = 0;
  for (const int at : s.face_offset) {
    if (at < before || static_cast<std::size_t>(at) > s.face_vertices.size()) throw std::out_of_range("a face ends beyond the list of its vertices");
    before = at;
  }
  for (const int v : s.face_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= s.vertices.size()) throw std::out_of_range("a face names a vertex that is not there");
}

RunHeader::BlockInfo get_block(ByteReader& r) {
  RunHeader::BlockInfo b;
  r.get(b.name);
  r.get(b.mass);
  r.get(b.volume);
  r.get(b.fixed);
  r.get(b.fragment);
  r.get(b.shape.vertices);
  r.get(b.shape.face_offset);
  r.get(b.shape.face_vertices);
  r.get(b.shape.triangles);
  r.get(b.shape.triangle_face);
  r.get(b.young);
  r.get(b.poisson);
  check_shape(b.shape);
  return b;
}

void put_member(ByteWriter& w, const Member& m) {
  w.put(m.name);
  for (const Vec3& v : {m.base, m.axis_x, m.axis_y}) w.put(v);
  w.put(m.length);
  w.put(m.volume);
  w.put(m.stations);
  w.put(m.axial_preload);
  w.put(m.shear_design);
  w.put(m.shear_mean);
}

Member get_member(ByteReader& r) {
  Member m;
  r.get(m.name);
  for (Vec3* v : {&m.base, &m.axis_x, &m.axis_y}) r.get(*v);
  r.get(m.length);
  r.get(m.volume);
  r.get(m.stations);
  r.get(m.axial_preload);
  r.get(m.shear_design);
  r.get(m.shear_mean);
  return m;
}

void put_member_state(ByteWriter& w, const MemberState& m) {
  w.put(m.axial);
  w.put(m.shear);
  w.put(m.moment);
  w.put(m.drift);
  w.put(m.crack_width);
  w.put(m.lost_volume);
  w.put(m.bars_yielded);
  w.put(m.bars_broken);
}

MemberState get_member_state(ByteReader& r) {
  MemberState m;
  r.get(m.axial);
  r.get(m.shear);
  r.get(m.moment);
  r.get(m.drift);
  r.get(m.crack_width);
  r.get(m.lost_volume);
  r.get(m.bars_yielded);
  r.get(m.bars_broken);
  return m;
}

/// Groups of `width` doubles: a bit for each that differs from `before`, then those groups; `before` becomes `now`.
void put_changed(ByteWriter& w, std::vector<double>& before, const std::vector<double>& now, std::size_t width) {
  const std::size_t n = now.size() / width;
  w.put(static_cast<std::uint64_t>(n));
  std::string mask((n + 7) / 8, '\0');
  const auto changed = [&](std::size_t i) {
    return (i + 1) * width > before.size() || std::memcmp(&before[i * width], &now[i * width], width * sizeof(double)) != 0;
  };
  for (std::size_t i = 0; i < n; ++i)
    if (changed(i)) mask[i / 8] = static_cast<char>(mask[i / 8] | (1 << (i % 8)));
  w.raw(mask.data(), mask.size());
  for (std::size_t i = 0; i < n; ++i)
    if (mask[i / 8] & (1 << (i % 8))) w.raw(&now[i * width], width * sizeof(double));
  before = now;
}

void get_changed(ByteReader& r, std::vector<double>& values, std::size_t width) {
  const auto n = r.take<std::uint64_t>();
  if (n / 8 > r.left()) throw std::out_of_range("count beyond the record");
  std::string mask((n + 7) / 8, '\0');
  r.raw(mask.data(), mask.size());
  values.resize(n * width);
  for (std::size_t i = 0; i < n; ++i)
    if (mask[i / 8] & (1 << (i % 8))) r.raw(&values[i * width], width * sizeof(double));
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::is_arithmetic_v<T> || sizeof(T) % sizeof(int) == 0);
  return a.size() == b.size() && (a.empty() || std::memcmp(static_cast<const void*>(a.data()), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_mesh(const Structure::Snapshot& a, const Structure::Snapshot& b) {
  return same(a.nodes, b.nodes) && same(a.hexes, b.hexes) && same(a.bars, b.bars);
}
bool same_values(const Structure::Snapshot& a, const Structure::Snapshot& b) {
  return same(a.displacement, b.displacement) && same(a.velocity, b.velocity) && same(a.damage_tension, b.damage_tension) &&
         same(a.damage_compression, b.damage_compression) && same(a.stress_von_mises, b.stress_von_mises) &&
         same(a.crack_width, b.crack_width) && same(a.bar_points, b.bar_points) && same(a.bar_strain, b.bar_strain) && same(a.bar_stress, b.bar_stress) &&
         same(a.bar_state, b.bar_state);
}

std::vector<double> flat(const std::vector<Pose>& poses) {
  std::vector<double> values(poses.size() * 12);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::memcpy(&values[12 * i], poses[i].c.data(), 3 * sizeof(double));
    std::memcpy(&values[12 * i + 3], poses[i].F.data(), 9 * sizeof(double));
  }
  return values;
}

}  // namespace

std::string encode_blocks(std::span<const RunHeader::BlockInfo> blocks) {
  ByteWriter w;
  w.put(static_cast<std::uint64_t>(blocks.size()));
  for (const auto& b : blocks) put_block(w, b);
  return w.bytes();
}

std::vector<RunHeader::BlockInfo> decode_blocks(std::string_view bytes) {
  ByteReader r(bytes);
  std::vector<RunHeader::BlockInfo> blocks;
  for (auto n = r.take<std::uint64_t>(); n > 0; --n) blocks.push_back(get_block(r));
  return blocks;
}

std::string encode_header(const RunHeader& h) {
  ByteWriter w;
  w.put(h.title);
  w.put(h.duration);
  w.put(encode_blocks(h.blocks));
  w.put(h.terrain.vertices);
  w.put(h.terrain.triangles);
  w.put(static_cast<std::uint64_t>(h.planes.size()));
  for (const Plane& p : h.planes) {
    w.put(p.point);
    w.put(p.normal);
  }
  w.put(static_cast<std::uint64_t>(h.structures.size()));
  for (const auto& s : h.structures) {
    w.put(s.name);
    w.put(s.probes);
    w.put(s.probe_at);
    w.put(s.plan);
    w.put(static_cast<std::uint64_t>(s.members.size()));
    for (const Member& m : s.members) put_member(w, m);
    w.put(s.young);
    w.put(s.poisson);
    w.put(s.f_cm);
  }
  w.put(h.materials);
  w.put(h.plan);
  return w.bytes();
}

RunHeader decode_header(std::string_view bytes) {
  ByteReader r(bytes);
  RunHeader h;
  r.get(h.title);
  r.get(h.duration);
  h.blocks = decode_blocks(r.take<std::string>());
  r.get(h.terrain.vertices);
  r.get(h.terrain.triangles);
  check_indices(h.terrain.triangles, h.terrain.vertices.size());
  for (auto n = r.take<std::uint64_t>(); n > 0; --n) {
    Plane p;
    r.get(p.point);
    r.get(p.normal);
    h.planes.push_back(p);
  }
  for (auto n = r.take<std::uint64_t>(); n > 0; --n) {
    RunHeader::StructureInfo s;
    r.get(s.name);
    r.get(s.probes);
    r.get(s.probe_at);
    r.get(s.plan);
    for (auto k = r.take<std::uint64_t>(); k > 0; --k) s.members.push_back(get_member(r));
    r.get(s.young);
    r.get(s.poisson);
    r.get(s.f_cm);
    h.structures.push_back(std::move(s));
  }
  r.get(h.materials);
  r.get(h.plan);
  return h;
}

std::string encode_contacts(std::span<const ContactRow> rows) {
  ByteWriter w;
  w.put(static_cast<std::uint64_t>(rows.size()));
  for (const ContactRow& c : rows) {
    w.put(c.time);
    w.put(c.dt);
    w.put(c.block);
    w.put(c.structure);
    w.put(c.point);
    w.put(c.force);
    w.put(c.normal);
    w.put(c.area);
  }
  return w.bytes();
}

std::vector<ContactRow> decode_contacts(std::string_view bytes) {
  ByteReader r(bytes);
  std::vector<ContactRow> rows;
  for (auto n = r.take<std::uint64_t>(); n > 0; --n) {
    ContactRow c;
    r.get(c.time);
    r.get(c.dt);
    r.get(c.block);
    r.get(c.structure);
    r.get(c.point);
    r.get(c.force);
    r.get(c.normal);
    r.get(c.area);
    rows.push_back(c);
  }
  return rows;
}

std::string RecordCodec::encode(const HistoryRow& row) {
  const std::size_t n = row.position.size();
  if (row.velocity.size() != n || row.spin.size() != n || row.orientation.size() != n || row.strain.size() != n ||
      row.kinetic_translational.size() != n || row.kinetic_rotational.size() != n)
    throw std::logic_error("history row with arrays of different lengths");
  std::vector<double> now(n * history_width);
  double* p = now.data();
  const auto add = [&](const double* v, int k) { p = std::copy(v, v + k, p); };
  for (std::size_t i = 0; i < n; ++i) {
    add(row.position[i].data(), 3);
    add(row.velocity[i].data(), 3);
    add(row.spin[i].data(), 3);
    add(row.orientation[i].data(), 4);
    add(row.strain[i].data(), 6);
    add(&row.kinetic_translational[i], 1);
    add(&row.kinetic_rotational[i], 1);
  }
  ByteWriter w;
  w.put(row.time);
  put_changed(w, blocks_, now, history_width);
  w.put(static_cast<std::uint64_t>(row.structures.size()));
  for (const auto& s : row.structures) {
    w.put(s.base_force);
    w.put(s.base_moment);
    w.put(s.probe_displacement);
    w.put(s.damage_max);
    w.put(s.damaged_volume);
    w.put(s.spalled_volume);
    w.put(static_cast<std::uint64_t>(s.members.size()));
    for (const MemberState& m : s.members) put_member_state(w, m);
  }
  const LedgerRow& l = row.ledger;
  for (const double v : {l.kinetic, l.potential, l.strain, l.contact, l.friction_work, l.damping_work, l.damage_work, l.algorithmic, l.external_work, l.residual}) w.put(v);
  w.put(l.linear_momentum);
  w.put(l.angular_momentum);
  return w.bytes();
}

HistoryRow RecordCodec::decode_history(std::string_view bytes) {
  ByteReader r(bytes);
  HistoryRow row;
  r.get(row.time);
  get_changed(r, blocks_, history_width);
  const std::size_t n = blocks_.size() / history_width;
  row.position.resize(n);
  row.velocity.resize(n);
  row.spin.resize(n);
  row.orientation.resize(n);
  row.strain.resize(n);
  row.kinetic_translational.resize(n);
  row.kinetic_rotational.resize(n);
  const double* p = blocks_.data();
  const auto get = [&](double* v, int k) {
    std::copy(p, p + k, v);
    p += k;
  };
  for (std::size_t i = 0; i < n; ++i) {
    get(row.position[i].data(), 3);
    get(row.velocity[i].data(), 3);
    get(row.spin[i].data(), 3);
    get(row.orientation[i].data(), 4);
    get(row.strain[i].data(), 6);
    get(&row.kinetic_translational[i], 1);
    get(&row.kinetic_rotational[i], 1);
  }
  for (auto k = r.take<std::uint64_t>(); k > 0; --k) {
    HistoryRow::StructureRow s;
    r.get(s.base_force);
    r.get(s.base_moment);
    r.get(s.probe_displacement);
    r.get(s.damage_max);
    r.get(s.damaged_volume);
    r.get(s.spalled_volume);
    for (auto m = r.take<std::uint64_t>(); m > 0; --m) s.members.push_back(get_member_state(r));
    row.structures.push_back(std::move(s));
  }
  LedgerRow& l = row.ledger;
  for (double* v : {&l.kinetic, &l.potential, &l.strain, &l.contact, &l.friction_work, &l.damping_work, &l.damage_work, &l.algorithmic, &l.external_work, &l.residual}) r.get(*v);
  r.get(l.linear_momentum);
  r.get(l.angular_momentum);
  return row;
}

std::string RecordCodec::encode(const FieldRow& row) {
  ByteWriter w;
  w.put(row.time);
  std::vector<double> before = flat(field_.poses);
  put_changed(w, before, flat(row.poses), 12);
  w.put(static_cast<std::uint64_t>(row.structures.size()));
  for (std::size_t i = 0; i < row.structures.size(); ++i) {
    const Structure::Snapshot& s = row.structures[i];
    const bool mesh = i < field_.structures.size() && same_mesh(field_.structures[i], s);
    const bool values = mesh && same_values(field_.structures[i], s);
    w.put(static_cast<std::uint8_t>(values ? 0 : mesh ? 1 : 2));
    if (!mesh) {
      w.put(s.nodes);
      w.put(s.hexes);
      w.put(s.bars);
    }
    if (!values) {
      w.put(s.displacement);
      w.put(s.velocity);
      w.put(s.damage_tension);
      w.put(s.damage_compression);
      w.put(s.stress_von_mises);
      w.put(s.crack_width);
      w.put(s.bar_points);
      w.put(s.bar_strain);
      w.put(s.bar_stress);
      w.put(s.bar_state);
    }
  }
  field_ = row;
  return w.bytes();
}

const FieldRow& RecordCodec::decode_field(std::string_view bytes) {
  ByteReader r(bytes);
  r.get(field_.time);
  std::vector<double> values = flat(field_.poses);
  get_changed(r, values, 12);
  field_.poses.resize(values.size() / 12);
  for (std::size_t i = 0; i < field_.poses.size(); ++i) {
    std::memcpy(field_.poses[i].c.data(), &values[12 * i], 3 * sizeof(double));
    std::memcpy(field_.poses[i].F.data(), &values[12 * i + 3], 9 * sizeof(double));
  }
  const auto n = r.take<std::uint64_t>();
  if (n > bytes.size()) throw std::out_of_range("count beyond the record");
  field_.structures.resize(n);
  for (Structure::Snapshot& s : field_.structures) {
    const auto change = r.take<std::uint8_t>();
    if (change >= 2) {
      r.get(s.nodes);
      r.get(s.hexes);
      r.get(s.bars);
    }
    if (change >= 1) {
      r.get(s.displacement);
      r.get(s.velocity);
      r.get(s.damage_tension);
      r.get(s.damage_compression);
      r.get(s.stress_von_mises);
      r.get(s.crack_width);
      r.get(s.bar_points);
      r.get(s.bar_strain);
      r.get(s.bar_stress);
      r.get(s.bar_state);
    }
  }
  return field_;
}

}  // namespace talus::io
