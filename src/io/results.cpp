#include "io/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "io/bytes.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"
#include "io/journal.hpp"
#include "io/records.hpp"
#include "io/xdmf.hpp"

namespace talus::io {


namespace {

using sim::ContactRow;
using sim::HistoryRow;
using sim::RunHeader;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Count {
  RunHeader header;  // with all fragments
  std::size_t rows = 0, contacts = 0, fields = 0;
  std::optional<Outcome> outcome;
};

Count count(const std::filesystem::path& journal, std::uint64_t limit) {
  Count c;
  JournalReader reader(journal, limit);
  RecordKind kind;
  std::string payload;
  while (reader.next(kind, payload)) {
    switch (kind) {
      case RecordKind::header: c.header = decode_header(payload); break;
      case RecordKind::extend:
        for (auto& b : decode_blocks(payload)) c.header.blocks.push_back(std::move(b));
        break;
      case RecordKind::history: ++c.rows; break;
      case RecordKind::contacts: c.contacts += ByteReader(payload).take<std::uint64_t>(); break;
      case RecordKind::field: ++c.fields; break;
      case RecordKind::outcome: c.outcome = decode_outcome(payload); break;
    }
  }
  return c;
}

/// One dataset that grows row by row: rows are kept until flush() writes them together.
struct Column {
  std::string path;
  std::size_t width;
  std::vector<double> values;
  void add(const double* v, std::size_t n) { values.insert(values.end(), v, v + n); }
  void add(const Vec3& v) { add(v.data(), 3); }
  void add(double v) { values.push_back(v); }
};

class HistoryWriter {
 public:
  HistoryWriter(Hdf5File& file, const RunHeader& header, std::size_t nt) : file_(file), header_(header), nb_(header.blocks.size()) {
    const auto make = [&](const std::string& path, Dims dims, const char* unit, const std::string& description) {
      std::size_t width = 1;
      for (std::size_t k = 1; k < dims.size(); ++k) width *= dims[k];
      file_.create_rows(path, dims, unit, description);
      columns_.push_back({path, width, {}});
      return columns_.size() - 1;
    };
    make("/history/time", {nt}, "s", "time of the row");
    const std::string b = "/history/blocks/";
    make(b + "position", {nt, nb_, 3}, "m", "centroid, scene coordinates");
    make(b + "velocity", {nt, nb_, 3}, "m/s", "velocity of the centroid");
    make(b + "spin", {nt, nb_, 3}, "rad/s", "angular velocity, world axes");
    make(b + "orientation", {nt, nb_, 4}, "1", "unit quaternion w, x, y, z, body to world");
    make(b + "strain", {nt, nb_, 6}, "1", "strain in body axes: ex, ey, ez, g_yz, g_zx, g_xy (engineering shear)");
    make(b + "kinetic_translational", {nt, nb_}, "J", "m |v|^2 / 2");
    make(b + "kinetic_rotational", {nt, nb_}, "J", "kinetic energy of rotation and strain rate");
    for (const auto& s : header.structures) {
      const std::string p = "/history/structures/" + safe_name(s.name) + "/";
      make(p + "base_force", {nt, 3}, "N", "acting on the support");
      make(p + "base_moment", {nt, 3}, "N m", "acting on the support, about the first centroid of the supported nodes");
      make(p + "probe_displacement", {nt, s.probes.size(), 3}, "m", "displacement of the probes in the order of probe_name");
      make(p + "damage_max", {nt}, "1", "greatest damage of any cell");
      make(p + "damaged_volume", {nt}, "m^3", "volume with damage above one half");
      make(p + "spalled_volume", {nt}, "m^3", "volume eroded or come off as fragments");
      const std::size_t nm = s.members.size(), ns = nm > 0 ? s.members[0].stations.size() : 0;
      if (nm == 0) continue;
      make(p + "members/axial", {nt, nm, ns}, "N", "axial force at the stations, compression positive");
      make(p + "members/shear", {nt, nm, ns, 2}, "N", "shear force along axis_x and axis_y, of the part above on the part below");
      make(p + "members/moment", {nt, nm, ns, 2}, "N m", "bending moment about axis_x and axis_y, of the part above on the part below");
      make(p + "members/drift", {nt, nm, 2}, "m", "displacement of the top against the base along axis_x and axis_y");
      make(p + "members/crack_width", {nt, nm}, "m", "widest crack");
      make(p + "members/lost_volume", {nt, nm}, "m^3", "volume eroded or come off");
      make(p + "members/bars_yielded", {nt, nm}, "1", "number of bars that have yielded");
      make(p + "members/bars_broken", {nt, nm}, "1", "number of broken bars");
    }
    const std::string l = "/ledger/";
    make(l + "kinetic", {nt}, "J", "kinetic energy of blocks and structures");
    make(l + "potential", {nt}, "J", "potential energy, zero at z = 0");
    make(l + "strain", {nt}, "J", "elastic energy of blocks and structures");
    make(l + "contact", {nt}, "J", "elastic energy of contacts");
    make(l + "friction_work", {nt}, "J", "dissipated by friction since the start");
    make(l + "damping_work", {nt}, "J", "dissipated by damping and restitution since the start");
    make(l + "damage_work", {nt}, "J", "dissipated by damage and plasticity since the start");
    make(l + "algorithmic", {nt}, "J", "dissipated by the time integration since the start");
    make(l + "external_work", {nt}, "J", "work of prescribed loads since the start");
    make(l + "residual", {nt}, "J", "energy now + dissipated - energy at the start - external work");
    make(l + "linear_momentum", {nt, 3}, "kg m/s", "of blocks and structures");
    make(l + "angular_momentum", {nt, 3}, "kg m^2/s", "of blocks and structures, about the scene origin");
    std::size_t row = 0;
    for (const Column& c : columns_) row += c.width * sizeof(double);
    batch_ = std::clamp<std::size_t>((std::size_t{32} << 20) / std::max<std::size_t>(row, 1), 1, 4096);
  }

  void add(const HistoryRow& r) {
    std::size_t k = 0;
    const auto next = [&]() -> Column& { return columns_[k++]; };
    next().add(r.time);
    const auto per_block = [&](const auto& values, std::size_t width) {
      Column& c = next();
      for (std::size_t i = 0; i < nb_; ++i) {
        if (i >= values.size()) {
          c.values.insert(c.values.end(), width, nan);  // not born yet
        } else if constexpr (std::is_arithmetic_v<std::decay_t<decltype(values[i])>>) {
          c.add(values[i]);
        } else {
          c.add(values[i].data(), width);
        }
      }
    };
    per_block(r.position, 3);
    per_block(r.velocity, 3);
    per_block(r.spin, 3);
    per_block(r.orientation, 4);
    per_block(r.strain, 6);
    per_block(r.kinetic_translational, 1);
    per_block(r.kinetic_rotational, 1);
    for (std::size_t i = 0; i < header_.structures.size(); ++i) {
      const HistoryRow::StructureRow empty{Vec3::Constant(nan), Vec3::Constant(nan), {}, nan, nan, nan, {}};
      const auto& s = i < r.structures.size() ? r.structures[i] : empty;
      next().add(s.base_force);
      next().add(s.base_moment);
      Column& probes = next();
      for (std::size_t p = 0; p < header_.structures[i].probes.size(); ++p)
        probes.add(p < s.probe_displacement.size() ? s.probe_displacement[p] : Vec3::Constant(nan));
      next().add(s.damage_max);
      next().add(s.damaged_volume);
      next().add(s.spalled_volume);
      const std::vector<Member>& members = header_.structures[i].members;
      if (members.empty()) continue;
      const MemberState gone{};
      const auto per_member = [&](auto&& values) {
        Column& c = next();
        for (std::size_t m = 0; m < members.size(); ++m) values(c, m < s.members.size() ? s.members[m] : gone);
      };
      const std::size_t ns = members[0].stations.size();
      const auto per_station = [&](Column& c, const auto& values, std::size_t width) {
        for (std::size_t k = 0; k < ns; ++k)
          for (std::size_t x = 0; x < width; ++x) c.add(k < values.size() ? reinterpret_cast<const double*>(&values[k])[x] : nan);
      };
      per_member([&](Column& c, const MemberState& m) { per_station(c, m.axial, 1); });
      per_member([&](Column& c, const MemberState& m) { per_station(c, m.shear, 2); });
      per_member([&](Column& c, const MemberState& m) { per_station(c, m.moment, 2); });
      per_member([&](Column& c, const MemberState& m) { c.add(m.drift.data(), 2); });
      per_member([&](Column& c, const MemberState& m) { c.add(m.crack_width); });
      per_member([&](Column& c, const MemberState& m) { c.add(m.lost_volume); });
      per_member([&](Column& c, const MemberState& m) { c.add(static_cast<double>(m.bars_yielded)); });
      per_member([&](Column& c, const MemberState& m) { c.add(static_cast<double>(m.bars_broken)); });
    }
    const sim::LedgerRow& l = r.ledger;
    for (const double v : {l.kinetic, l.potential, l.strain, l.contact, l.friction_work, l.damping_work, l.damage_work, l.algorithmic, l.external_work, l.residual})
      next().add(v);
    next().add(l.linear_momentum);
    next().add(l.angular_momentum);
    if (++held_ == batch_) flush();
  }

  void flush() {
    for (Column& c : columns_) {
      file_.write_rows(c.path, written_, held_, c.values.data());
      c.values.clear();
    }
    written_ += held_;
    held_ = 0;
  }

 private:
  Hdf5File& file_;
  const RunHeader& header_;
  std::size_t nb_;
  std::vector<Column> columns_;
  std::size_t batch_ = 1, held_ = 0, written_ = 0;
};

class ContactWriter {
 public:
  ContactWriter(Hdf5File& file, std::size_t n) : file_(file) {
    const auto make = [&](const char* name, Dims dims, const char* unit, const char* description) {
      const std::string path = std::string("/history/contacts/structure/") + name;
      const std::size_t width = dims.size() > 1 ? dims[1] : 1;
      file_.create_rows(path, dims, unit, description);
      columns_.push_back({path, width, {}});
    };
    make("time", {n}, "s", "end of the coupled step");
    make("dt", {n}, "s", "length of the coupled step: force is the mean over (time - dt, time]");
    make("point", {n, 3}, "m", "where the force acts, scene coordinates");
    make("force", {n, 3}, "N", "mean force on the structure over the step, world axes");
    make("normal", {n, 3}, "1", "unit normal of the contact, world axes");
    make("area", {n}, "m^2", "tributary area");
    file_.create_rows_int("/history/contacts/structure/block", {n}, "index of the block, order of /history/blocks/name");
    file_.create_rows_int("/history/contacts/structure/structure", {n}, "index of the structure, order of /geometry/structures/name");
  }
  void add(const ContactRow& c) {
    columns_[0].add(c.time);
    columns_[1].add(c.dt);
    columns_[2].add(c.point);
    columns_[3].add(c.force);
    columns_[4].add(c.normal);
    columns_[5].add(c.area);
    block_.push_back(c.block);
    structure_.push_back(c.structure);
    if (block_.size() == 65536) flush();
  }
  void flush() {
    const std::size_t n = block_.size();
    for (Column& c : columns_) {
      file_.write_rows(c.path, written_, n, c.values.data());
      c.values.clear();
    }
    file_.write_rows("/history/contacts/structure/block", written_, n, block_.data());
    file_.write_rows("/history/contacts/structure/structure", written_, n, structure_.data());
    block_.clear();
    structure_.clear();
    written_ += n;
  }

 private:
  Hdf5File& file_;
  std::vector<Column> columns_;
  std::vector<std::int64_t> block_, structure_;
  std::size_t written_ = 0;
};

std::vector<double> flat(const std::vector<Vec3>& v) {
  std::vector<double> out;
  out.reserve(3 * v.size());
  for (const Vec3& p : v) out.insert(out.end(), p.data(), p.data() + 3);
  return out;
}
template <std::size_t N>
std::vector<std::int32_t> flat(const std::vector<std::array<int, N>>& v) {
  std::vector<std::int32_t> out;
  out.reserve(N * v.size());
  for (const auto& p : v) out.insert(out.end(), p.begin(), p.end());
  return out;
}

}  // namespace

void write_geometry(Hdf5File& file, const RunHeader& h) {
  std::vector<double> vertices, mass, volume;
  std::vector<std::int64_t> vertex_offset{0}, face_vertices, face_offset{0}, block_face_offset{0};
  std::vector<std::int32_t> triangles;
  std::vector<std::int64_t> triangle_offset{0};
  std::vector<std::uint8_t> fixed, fragment;
  std::vector<std::string> names;
  for (const auto& b : h.blocks) {
    const std::int64_t first = vertex_offset.back();
    const std::vector<double> v = flat(b.shape.vertices);
    vertices.insert(vertices.end(), v.begin(), v.end());
    for (int f = 0; f < b.shape.faces(); ++f) {
      for (int k = b.shape.face_offset[static_cast<std::size_t>(f)]; k < b.shape.face_offset[static_cast<std::size_t>(f) + 1]; ++k)
        face_vertices.push_back(first + b.shape.face_vertices[static_cast<std::size_t>(k)]);
      face_offset.push_back(static_cast<std::int64_t>(face_vertices.size()));
    }
    for (const auto& t : b.shape.triangles)
      for (const int v : t) triangles.push_back(static_cast<std::int32_t>(first) + v);
    triangle_offset.push_back(static_cast<std::int64_t>(triangles.size() / 3));
    vertex_offset.push_back(first + static_cast<std::int64_t>(b.shape.vertices.size()));
    block_face_offset.push_back(static_cast<std::int64_t>(face_offset.size()) - 1);
    names.push_back(b.name);
    mass.push_back(b.mass);
    volume.push_back(b.volume);
    fixed.push_back(b.fixed);
    fragment.push_back(b.fragment);
  }
  const std::string g = "/geometry/blocks/";
  const auto ints = [&](const std::string& path, const std::vector<std::int64_t>& v, const char* description) {
    file.write<std::int64_t>(path, v, {v.size()}, "1", description);
  };
  file.write<double>(g + "vertices", vertices, {vertices.size() / 3, 3}, "m", "vertices of all blocks in body axes about the centroid");
  ints(g + "vertex_offset", vertex_offset, "vertices of block b: rows vertex_offset[b] to vertex_offset[b + 1]");
  ints(g + "face_vertices", face_vertices, "rows of vertices, face by face, counter-clockwise seen from outside");
  ints(g + "face_offset", face_offset, "face f: face_vertices[face_offset[f] : face_offset[f + 1]]");
  ints(g + "block_face_offset", block_face_offset, "faces of block b: block_face_offset[b] to block_face_offset[b + 1]");
  file.write<std::int32_t>(g + "triangles", triangles, {triangles.size() / 3, 3}, "1", "triangulation of the faces: rows of vertices, outward");
  ints(g + "triangle_offset", triangle_offset, "triangles of block b: triangle_offset[b] to triangle_offset[b + 1]");
  file.write<double>(g + "volume", volume, {volume.size()}, "m^3", "volume");
  file.write<std::uint8_t>(g + "fixed", fixed, {fixed.size()}, "1", "1: the block does not move");
  file.write<std::uint8_t>(g + "fragment", fragment, {fragment.size()}, "1", "1: came off a structure during the run");
  file.write("/history/blocks/name", names, "names in the order of the scene, then the rock mass, then fragments");
  file.write<double>("/history/blocks/mass", mass, {mass.size()}, "kg", "mass");

  if (!h.terrain.triangles.empty()) {
    file.write<double>("/geometry/terrain/vertices", flat(h.terrain.vertices), {h.terrain.vertices.size(), 3}, "m", "scene coordinates");
    file.write<std::int32_t>("/geometry/terrain/triangles", flat(h.terrain.triangles), {h.terrain.triangles.size(), 3}, "1", "rows of vertices, outward");
  }
  std::vector<double> planes;
  for (const Plane& p : h.planes) {
    planes.insert(planes.end(), p.point.data(), p.point.data() + 3);
    planes.insert(planes.end(), p.normal.data(), p.normal.data() + 3);
  }
  if (!h.planes.empty())
    file.write<double>("/geometry/planes", planes, {h.planes.size(), 6}, "m, 1", "a point of each plane and its outward unit normal");
  std::vector<std::string> structures;
  for (const auto& s : h.structures) {
    structures.push_back(s.name);
    const std::string p = "/history/structures/" + safe_name(s.name) + "/";
    file.write(p + "probe_name", s.probes, "names of the probes");
    if (!s.members.empty()) {
      std::vector<std::string> names;
      std::vector<double> stations, frame, shear;
      for (const Member& m : s.members) {
        names.push_back(m.name);
        stations.insert(stations.end(), m.stations.begin(), m.stations.end());
        for (const Vec3* v : {&m.base, &m.axis_x, &m.axis_y}) frame.insert(frame.end(), v->data(), v->data() + 3);
        for (const auto& r : {m.shear_design, m.shear_mean}) shear.insert(shear.end(), r.begin(), r.end());
      }
      file.write(p + "members/name", names, "names of the members");
      file.write<double>(p + "members/station", stations, {names.size(), s.members[0].stations.size()}, "m", "distance of the sections from the base");
      file.write<double>(p + "members/frame", frame, {names.size(), 3, 3}, "m, 1, 1", "rows: centre of the base, axis_x, axis_y; the member runs along axis_x x axis_y");
      file.write<double>(p + "members/shear_resistance", shear, {names.size(), 2, 2}, "N", "EN 1992-1-1 6.2: rows design (accidental), mean strengths; columns along axis_x, axis_y");
    }
    file.write<double>(p + "probe_position", flat(s.probe_at), {s.probe_at.size(), 3}, "m", "position of the probes at t = 0");
  }
  file.write("/geometry/structures/name", structures, "names of the structures in the order of the scene");
  file.write("/plan", h.plan, "what was computed and what was left out");
  file.write("/materials", h.materials, "names of the materials");
}

namespace {

/// Writes frame groups; arrays equal to those of the frame before are linked, not written again.
class FieldWriter {
 public:
  FieldWriter(Hdf5File& file, const RunHeader& header) : file_(file), header_(header) {}

  void add(const FieldRow& f) {
    XdmfFrame frame;
    frame.time = f.time;
    frame.group = fmt::format("/fields/{:06}", frames_.size());
    file_.group(frame.group);
    file_.attribute(frame.group, "time", f.time);
    blocks(f, frame);
    for (std::size_t i = 0; i < f.structures.size() && i < header_.structures.size(); ++i) structure(f.structures[i], i, frame);
    frames_.push_back(std::move(frame));
  }
  const std::vector<XdmfFrame>& frames() const { return frames_; }

 private:
  template <class T>
  void put(const std::string& group, const std::string& name, const std::vector<T>& values, const Dims& dims, const char* unit, const char* description) {
    const std::string path = group + "/" + name;
    const std::string key = path.substr(path.find('/', 8));  // without "/fields/NNNNNN"
    Last& last = last_[key];
    const std::string_view bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    if (!last.path.empty() && last.bytes == bytes && last.dims == dims) {
      file_.hard_link(last.path, path);
      return;
    }
    file_.write<T>(path, values, dims, unit, description);
    last = {path, std::string(bytes), dims};
  }

  void blocks(const FieldRow& f, XdmfFrame& frame) {
    std::vector<double> points;
    std::vector<std::int32_t> topology, owner;
    for (std::size_t i = 0; i < f.poses.size() && i < header_.blocks.size(); ++i) {
      const Polyhedron& s = header_.blocks[i].shape;
      const auto first = static_cast<std::int32_t>(points.size() / 3);
      for (const Vec3& X : s.vertices) {
        const Vec3 x = f.poses[i].world(X);
        points.insert(points.end(), x.data(), x.data() + 3);
      }
      for (int face = 0; face < s.faces(); ++face) {
        const int a = s.face_offset[static_cast<std::size_t>(face)], b = s.face_offset[static_cast<std::size_t>(face) + 1];
        topology.push_back(3);  // a polygon of XDMF
        topology.push_back(b - a);
        for (int k = a; k < b; ++k) topology.push_back(first + s.face_vertices[static_cast<std::size_t>(k)]);
        owner.push_back(static_cast<std::int32_t>(i));
      }
    }
    frame.points = points.size() / 3;
    frame.polygons = owner.size();
    frame.topology = topology.size();
    if (owner.empty()) return;
    const std::string g = frame.group + "/blocks";
    put(g, "points", points, {frame.points, 3}, "m", "vertices of the blocks, scene coordinates");
    put(g, "topology", topology, {topology.size()}, "1", "XDMF mixed topology of polygons");
    put(g, "face_block", owner, {owner.size()}, "1", "block of each polygon");
  }

  void structure(const Structure::Snapshot& s, std::size_t i, XdmfFrame& frame) {
    XdmfFrame::Part part;
    part.name = safe_name(header_.structures[i].name);
    part.nodes = s.nodes.size();
    part.hexes = s.hexes.size();
    const std::string g = frame.group + "/structures/" + part.name;
    put(g, "nodes", flat(s.nodes), {s.nodes.size(), 3}, "m", "reference positions");
    put(g, "hexes", flat(s.hexes), {s.hexes.size(), 8}, "1", "live cells, VTK order");
    const auto nodal = [&](const char* name, const std::vector<Vec3>& v, const char* unit) {
      if (v.size() != s.nodes.size() || v.empty()) return false;
      const std::vector<double> d = flat(v);
      put(g, name, std::vector<float>(d.begin(), d.end()), {v.size(), 3}, unit, name);
      return true;
    };
    const auto cell = [&](const char* name, const std::vector<double>& v, const char* unit) {
      if (v.size() != s.hexes.size() || v.empty()) return false;
      put(g, name, std::vector<float>(v.begin(), v.end()), {v.size()}, unit, name);
      return true;
    };
    part.displacement = nodal("displacement", s.displacement, "m");
    part.velocity = nodal("velocity", s.velocity, "m/s");
    part.damage_tension = cell("damage_tension", s.damage_tension, "1");
    part.damage_compression = cell("damage_compression", s.damage_compression, "1");
    part.stress = cell("stress_von_mises", s.stress_von_mises, "Pa");
    part.crack_width = cell("crack_width", s.crack_width, "m");
    if (!s.bars.empty()) {
      put(g, "bars", flat(s.bars), {s.bars.size(), 2}, "1", "reinforcement: rows of bar_points");
      const std::vector<double> p = flat(s.bar_points);
      put(g, "bar_points", std::vector<float>(p.begin(), p.end()), {s.bar_points.size(), 3}, "m", "scene coordinates");
      if (s.bar_strain.size() == s.bars.size())
        put(g, "bar_strain", std::vector<float>(s.bar_strain.begin(), s.bar_strain.end()), {s.bars.size()}, "1", "axial strain");
      if (s.bar_stress.size() == s.bars.size())
        put(g, "bar_stress", std::vector<float>(s.bar_stress.begin(), s.bar_stress.end()), {s.bars.size()}, "Pa", "axial stress");
      if (s.bar_state.size() == s.bars.size())
        put(g, "bar_state", std::vector<float>(s.bar_state.begin(), s.bar_state.end()), {s.bars.size()}, "1", "0 elastic, 1 has yielded, 2 broken");
    }
    frame.structures.push_back(std::move(part));
  }

  struct Last {
    std::string path, bytes;
    Dims dims;
  };
  Hdf5File& file_;
  const RunHeader& header_;
  std::map<std::string, Last> last_;
  std::vector<XdmfFrame> frames_;
};

}  // namespace

namespace {

BuiltResults build(const std::filesystem::path& directory, const Outcome* outcome, std::uint64_t limit, const sim::FinalState* state) {
  const std::filesystem::path journal = directory / "journal.bin";
  Count c = count(journal, limit);
  if (outcome == nullptr && c.outcome) outcome = &*c.outcome;
  PartFile part(directory / "results.h5");
  BuiltResults built{.summary_json = {}, .rows = c.rows, .contacts = c.contacts, .fields = c.fields};
  std::vector<XdmfFrame> frames;
  {
    Hdf5File file = Hdf5File::create(part.path());
    file.attribute("/", "program", std::string("talus"));
    file.attribute("/", "schema", std::int64_t{1});
    file.attribute("/", "title", c.header.title);
    HistoryWriter history(file, c.header, c.rows);
    ContactWriter contacts(file, c.contacts);
    write_geometry(file, c.header);
    FieldWriter fields(file, c.header);
    std::optional<SummaryBuilder> summary;
    RecordCodec codec;
    JournalReader reader(journal, limit);
    RecordKind kind;
    std::string payload;
    std::vector<double> field_times;
    while (reader.next(kind, payload)) {
      switch (kind) {
        case RecordKind::header: summary.emplace(decode_header(payload)); break;
        case RecordKind::extend:
          if (summary) summary->extend(decode_blocks(payload));
          break;
        case RecordKind::history: {
          const HistoryRow row = codec.decode_history(payload);
          history.add(row);
          if (summary) summary->add(row);
          break;
        }
        case RecordKind::contacts: {
          const std::vector<ContactRow> rows = decode_contacts(payload);
          for (const ContactRow& r : rows) contacts.add(r);
          if (summary) summary->add(rows);
          break;
        }
        case RecordKind::field: {
          const FieldRow& row = codec.decode_field(payload);
          field_times.push_back(row.time);
          fields.add(row);
          break;
        }
        case RecordKind::outcome: break;
      }
    }
    history.flush();
    contacts.flush();
    file.write<double>("/fields/time", field_times, {field_times.size()}, "s", "time of each frame group");
    if (summary) built.summary_json = summary->text(outcome);
    if (state != nullptr) write_final_state(file, *state);
    file.close();
    frames = fields.frames();
  }
  part.swap_in();
  const XdmfTerrain terrain{c.header.terrain.vertices.size(), c.header.terrain.triangles.size()};
  write_file(directory / "results.xdmf", xdmf_text(frames, terrain));
  return built;
}

}  // namespace

BuiltResults build_results(const std::filesystem::path& directory, const Outcome* outcome, std::uint64_t limit, const sim::FinalState* state) {
  try {
    return build(directory, outcome, limit, state);
  } catch (const std::out_of_range& e) {  // whole by its checksum, and yet no record of ours
    throw bad_file(directory / "journal.bin", {}, fmt::format("holds a record that cannot be read: {}", e.what()), "run the scene again");
  }
}

std::string encode_outcome(const Outcome& o) {
  ByteWriter w;
  w.put(o.status);
  w.put(o.message);
  w.put(o.audit_made);
  w.put(o.counters);
  for (const double v : {o.audit.worst_force_imbalance, o.audit.worst_moment_imbalance, o.audit.impulse_defect, o.audit.work_on_blocks, o.audit.work_on_structure}) w.put(v);
  w.put(o.audit.impulse_on_structure);
  return w.bytes();
}

Outcome decode_outcome(std::string_view bytes) {
  ByteReader r(bytes);
  Outcome o;
  r.get(o.status);
  r.get(o.message);
  r.get(o.audit_made);
  r.get(o.counters);
  for (double* v : {&o.audit.worst_force_imbalance, &o.audit.worst_moment_imbalance, &o.audit.impulse_defect, &o.audit.work_on_blocks, &o.audit.work_on_structure}) r.get(*v);
  r.get(o.audit.impulse_on_structure);
  return o;
}

}  // namespace talus::io
