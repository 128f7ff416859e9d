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

// One list of fields for each kind of record, in their order in the journal, for writing and for reading.
auto writing(ByteWriter& w) {
  return [&w](const auto& value) { w.put(value); };
}
auto reading(ByteReader& r) {
  return [&r](auto& value) { r.get(value); };
}

void block_fields(auto& b, auto&& f) {
  f(b.name), f(b.mass), f(b.volume), f(b.fixed), f(b.fragment);
  f(b.shape.vertices), f(b.shape.face_offset), f(b.shape.face_vertices), f(b.shape.triangles),
      f(b.shape.triangle_face);
  f(b.young), f(b.poisson), f(b.from);
}

void member_fields(auto& m, auto&& f) {
  f(m.name), f(m.span), f(m.base), f(m.axis_x), f(m.axis_y), f(m.length), f(m.volume), f(m.section),
      f(m.stations), f(m.axial_preload), f(m.shear_design), f(m.shear_mean);
}

void member_state_fields(auto& m, auto&& f) {
  f(m.axial), f(m.shear), f(m.moment), f(m.drift), f(m.crack_width), f(m.lost_volume), f(m.bars_yielded),
      f(m.bars_broken), f(m.ends_unseated), f(m.end_shift);
}

void load_peak_fields(auto& p, auto&& f) { f(p.value), f(p.time), f(p.station); }

void member_peak_fields(auto& m, auto&& f) {
  for (auto* p : {&m.shear, &m.moment, &m.use_design, &m.use_mean}) load_peak_fields(*p, f);
  f(m.axial_least), f(m.axial_largest), f(m.drift), f(m.crack_width);
}

void before_fields(auto& m, auto&& f) {
  f(m.before.use_design), f(m.before.use_mean), f(m.before.crack_width);
}

void contact_fields(auto& c, auto&& f) {
  f(c.time), f(c.dt), f(c.block), f(c.structure), f(c.point), f(c.force), f(c.normal), f(c.area);
}

void arrival_fields(auto& a, auto&& f) {
  f(a.known), f(a.velocity), f(a.spin), f(a.translational), f(a.rotational);
}

void ledger_fields(auto& l, auto&& f) {
  f(l.kinetic), f(l.potential), f(l.strain), f(l.contact), f(l.friction_work), f(l.damping_work),
      f(l.damage_work), f(l.algorithmic), f(l.external_work), f(l.residual);
  f(l.yield_work), f(l.ploughing_work), f(l.vegetation_work);
  f(l.linear_momentum), f(l.angular_momentum);
}

void structure_row_fields(auto& s, auto&& f) {
  f(s.base_force), f(s.base_moment), f(s.probe_displacement), f(s.damage_max), f(s.damaged_volume),
      f(s.spalled_volume);
  for (auto* p : {&s.peaks.force, &s.peaks.shear, &s.peaks.moment}) load_peak_fields(*p, f);
  f(s.peaks.moment_at), f(s.peaks.moment_member);
  for (auto* p : {&s.peaks.tension, &s.peaks.compression})
    f(p->value), f(p->time), f(p->strength), f(p->share), f(p->at);
}

/// A block's values of a history row, side by side.
void motion_fields(auto& row, std::size_t i, auto&& f) {
  f(row.position[i].data(), 3), f(row.velocity[i].data(), 3), f(row.spin[i].data(), 3),
      f(row.orientation[i].data(), 4), f(row.strain[i].data(), 6);
  f(&row.kinetic_translational[i], 1), f(&row.kinetic_rotational[i], 1);
}

/// A count, then each item by `item`.
template <class Items, class F>
void put_list(ByteWriter& w, const Items& items, F&& item) {
  w.put(static_cast<std::uint64_t>(items.size()));
  for (const auto& one : items) item(one);
}
template <class Items, class F>
void get_list(ByteReader& r, Items& items, F&& item) {
  for (auto n = r.take<std::uint64_t>(); n > 0; --n)
    item(items.emplace_back());  // a count that lies ends with the record
}

void check_corners(const std::vector<std::array<int, 3>>& triangles, std::size_t vertices) {
  for (const auto& t : triangles)
    for (const int v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= vertices)
        throw std::out_of_range("a triangle names a vertex that is not there");
}

/// A journal that is whole by its checksum may still be of another program: whoever reads a shape goes by its
/// indices.
void check_shape(const Polyhedron& s) {
  check_corners(s.triangles, s.vertices.size());
  int before = 0;
  for (const int at : s.face_offset) {
    if (at < before || static_cast<std::size_t>(at) > s.face_vertices.size())
      throw std::out_of_range("a face ends beyond the list of its vertices");
    before = at;
  }
  for (const int v : s.face_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= s.vertices.size())
      throw std::out_of_range("a face names a vertex that is not there");
}

/// Groups of `width` doubles: a bit for each that differs from `before`, then those groups; `before` becomes
/// `now`.
void put_changed(ByteWriter& w, std::vector<double>& before, const std::vector<double>& now,
                 std::size_t width) {
  const std::size_t n = now.size() / width;
  w.put(static_cast<std::uint64_t>(n));
  std::string mask((n + 7) / 8, '\0');
  const auto changed = [&](std::size_t i) {
    return (i + 1) * width > before.size() ||
           std::memcmp(&before[i * width], &now[i * width], width * sizeof(double)) != 0;
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
  put_list(w, blocks, [&](const auto& b) { block_fields(b, writing(w)); });
  for (const auto& b : blocks) w.put(b.crushed);
  return w.bytes();
}

std::vector<RunHeader::BlockInfo> decode_blocks(std::string_view bytes) {
  ByteReader r(bytes);
  std::vector<RunHeader::BlockInfo> blocks;
  get_list(r, blocks, [&](auto& b) {
    block_fields(b, reading(r));
    check_shape(b.shape);
  });
  for (std::size_t i = 0; i < blocks.size() && r.left() > 0; ++i)
    r.get(blocks[i].crushed);  // not in what earlier versions wrote
  return blocks;
}

std::string encode_header(const RunHeader& h) {
  ByteWriter w;
  const auto put = writing(w);
  put(h.title), put(h.duration), put(h.crs), put(h.map_origin), put(encode_blocks(h.blocks)),
      put(h.terrain.vertices), put(h.terrain.triangles);
  put_list(w, h.planes, [&](const Plane& p) { put(p.point), put(p.normal); });
  put_list(w, h.structures, [&](const RunHeader::StructureInfo& s) {
    put(s.name), put(s.probes), put(s.probe_at), put(s.plan);
    put_list(w, s.members, [&](const Member& m) { member_fields(m, put); });
    put(s.young), put(s.poisson), put(s.f_cm), put(s.loaded), put(s.axes), put(s.effective_depth),
        put(s.reinforcement_ratio), put(s.form), put(s.cushion);
  });
  put(h.materials), put(h.plan), put(h.warnings), put(h.prescribed_impact);
  for (const RunHeader::StructureInfo& s : h.structures)
    put(s.meets), put(s.load_until), put(Vec3(s.permanent.head<3>())), put(Vec3(s.permanent.tail<3>()));
  for (const RunHeader::StructureInfo& s : h.structures)
    for (const Member& m : s.members) put(m.carried_by);
  return w.bytes();
}

RunHeader decode_header(std::string_view bytes) {
  ByteReader r(bytes);
  const auto get = reading(r);
  RunHeader h;
  get(h.title), get(h.duration), get(h.crs), get(h.map_origin);
  h.blocks = decode_blocks(r.take<std::string>());
  get(h.terrain.vertices), get(h.terrain.triangles);
  check_corners(h.terrain.triangles, h.terrain.vertices.size());
  get_list(r, h.planes, [&](Plane& p) { get(p.point), get(p.normal); });
  get_list(r, h.structures, [&](RunHeader::StructureInfo& s) {
    get(s.name), get(s.probes), get(s.probe_at), get(s.plan);
    get_list(r, s.members, [&](Member& m) { member_fields(m, get); });
    get(s.young), get(s.poisson), get(s.f_cm), get(s.loaded), get(s.axes), get(s.effective_depth),
        get(s.reinforcement_ratio), get(s.form), get(s.cushion);
  });
  get(h.materials), get(h.plan);
  if (r.left() > 0) get(h.warnings), get(h.prescribed_impact);  // not in what earlier versions wrote
  if (r.left() > 0)
    for (RunHeader::StructureInfo& s : h.structures) {
      Vec3 force, moment;
      get(s.meets), get(s.load_until), get(force), get(moment);
      s.permanent << force, moment;
      s.told_permanent = true;
    }
  if (r.left() > 0)
    for (RunHeader::StructureInfo& s : h.structures)
      for (Member& m : s.members) {
        get(m.carried_by);
        for (const int by : m.carried_by)
          if (by < 0 || static_cast<std::size_t>(by) >= s.members.size())
            throw std::out_of_range("a span is carried by a member that is not there");
      }
  for (const RunHeader::StructureInfo& s : h.structures)
    for (const int other : s.meets)
      if (other < 0 || static_cast<std::size_t>(other) >= h.structures.size())
        throw std::out_of_range("a structure meets one that is not there");
  return h;
}

std::string encode_contacts(std::span<const ContactRow> rows) {
  ByteWriter w;
  put_list(w, rows, [&](const ContactRow& c) { contact_fields(c, writing(w)); });
  for (const ContactRow& c : rows) arrival_fields(c.arrival, writing(w));
  return w.bytes();
}

std::vector<ContactRow> decode_contacts(std::string_view bytes) {
  ByteReader r(bytes);
  std::vector<ContactRow> rows;
  get_list(r, rows, [&](ContactRow& c) { contact_fields(c, reading(r)); });
  if (r.left() > 0)  // not in what earlier versions wrote
    for (ContactRow& c : rows) arrival_fields(c.arrival, reading(r));
  return rows;
}

std::string RecordCodec::encode(const HistoryRow& row) {
  const std::size_t n = row.position.size();
  if (row.velocity.size() != n || row.spin.size() != n || row.orientation.size() != n ||
      row.strain.size() != n || row.kinetic_translational.size() != n || row.kinetic_rotational.size() != n)
    throw std::logic_error("history row with arrays of different lengths");
  std::vector<double> now(n * history_width);
  double* p = now.data();
  for (std::size_t i = 0; i < n; ++i)
    motion_fields(row, i, [&](const double* v, int k) { p = std::copy(v, v + k, p); });
  ByteWriter w;
  w.put(row.time);
  put_changed(w, blocks_, now, history_width);
  const auto put = writing(w);
  put_list(w, row.structures, [&](const HistoryRow::StructureRow& s) {
    structure_row_fields(s, put);
    put_list(w, s.members, [&](const MemberState& m) { member_state_fields(m, put); });
    put_list(w, s.peaks.members, [&](const MemberPeaks& m) { member_peak_fields(m, put); });
  });
  ledger_fields(row.ledger, put);
  put(row.ledger.step_dependence);
  put(row.kinetic_peak);
  std::vector<double> peaks;
  for (const coupling::MotionPeaks& m : row.peaks) peaks.insert(peaks.end(), {m.speed, m.spin, m.kinetic});
  put_changed(w, peaks_, peaks, peaks_width);
  for (const HistoryRow::StructureRow& s : row.structures)
    put_list(w, s.peaks.probes, [&](const LoadPeak& p) { load_peak_fields(p, put); });
  for (const HistoryRow::StructureRow& s : row.structures)
    for (const MemberPeaks& m : s.peaks.members) before_fields(m, put);
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
  for (std::size_t i = 0; i < n; ++i)
    motion_fields(row, i, [&](double* v, int k) {
      std::copy(p, p + k, v);
      p += k;
    });
  const auto get = reading(r);
  get_list(r, row.structures, [&](HistoryRow::StructureRow& s) {
    structure_row_fields(s, get);
    get_list(r, s.members, [&](MemberState& m) { member_state_fields(m, get); });
    get_list(r, s.peaks.members, [&](MemberPeaks& m) { member_peak_fields(m, get); });
  });
  ledger_fields(row.ledger, get);
  if (r.left() > 0) get(row.ledger.step_dependence);  // not in what earlier versions wrote
  if (r.left() > 0) {                                 // nor these
    get(row.kinetic_peak);
    get_changed(r, peaks_, peaks_width);
    for (std::size_t k = 0; k < peaks_.size(); k += peaks_width)
      row.peaks.push_back({.speed = peaks_[k], .spin = peaks_[k + 1], .kinetic = peaks_[k + 2]});
  }
  if (r.left() > 0)
    for (HistoryRow::StructureRow& s : row.structures)
      get_list(r, s.peaks.probes, [&](LoadPeak& p) { load_peak_fields(p, get); });
  if (r.left() > 0)
    for (HistoryRow::StructureRow& s : row.structures)
      for (MemberPeaks& m : s.peaks.members) before_fields(m, get);
  return row;
}

std::string RecordCodec::encode(const FieldRow& row) {
  ByteWriter w;
  w.put(row.time);
  std::vector<double> before = flat(field_.poses);
  put_changed(w, before, flat(row.poses), 12);
  put_list(w, row.structures, writing(w));
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
  field_.structures.clear();
  get_list(r, field_.structures, [&](StructureField& f) {
    r.get(f);
    for (std::size_t c = 0; c < column_count; ++c)
      if (f.range(c).end < f.range(c).begin ||
          f.rows[c] > (f.range(c).end - f.range(c).begin) / field_columns[c].bytes())
        throw std::out_of_range("more rows than there is room for");
  });
  return field_;
}

}  // namespace talus::io
