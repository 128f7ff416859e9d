// /history and /ledger.
#include <algorithm>
#include <limits>

#include "io/files.hpp"
#include "io/result_writers.hpp"

namespace talus::io {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

HistoryWriter::HistoryWriter(Hdf5File& file, const sim::RunHeader& header, std::size_t nt)
    : file_(file), header_(header), nb_(header.blocks.size()) {
  make("/history/time", {nt}, "s", "time of the row");
  const std::string b = "/history/blocks/";
  make(b + "position", {nt, nb_, 3}, "m", "centroid, scene coordinates");
  make(b + "velocity", {nt, nb_, 3}, "m/s", "velocity of the centroid");
  make(b + "spin", {nt, nb_, 3}, "rad/s", "angular velocity, world axes");
  make(b + "orientation", {nt, nb_, 4}, "1", "unit quaternion w, x, y, z, body to world");
  make(b + "strain", {nt, nb_, 6}, "1",
       "strain in body axes: ex, ey, ez, g_yz, g_zx, g_xy (engineering shear)");
  make(b + "kinetic_translational", {nt, nb_}, "J", "m |v|^2 / 2");
  make(b + "kinetic_rotational", {nt, nb_}, "J", "kinetic energy of rotation and strain rate");
  for (const auto& s : header.structures) make_structure(s, nt);
  const std::string l = "/ledger/";
  make(l + "kinetic", {nt}, "J", "kinetic energy of blocks and structures");
  make(l + "potential", {nt}, "J", "potential energy, zero at z = 0");
  make(l + "strain", {nt}, "J", "elastic energy of blocks and structures");
  make(l + "contact", {nt}, "J", "elastic energy of contacts");
  make(l + "friction_work", {nt}, "J", "dissipated by friction since the start");
  make(l + "damping_work", {nt}, "J", "dissipated by damping and restitution since the start");
  make(l + "yield_work", {nt}, "J",
       "dissipated by ground and cushions whose laws harden or end, since the start");
  make(l + "ploughing_work", {nt}, "J", "dissipated by ploughing through the ground since the start");
  make(l + "vegetation_work", {nt}, "J", "dissipated by the drag of vegetation since the start");
  make(l + "damage_work", {nt}, "J", "dissipated by damage and plasticity since the start");
  make(l + "algorithmic", {nt}, "J",
       "numerical dissipation since the start, negative: energy gain; with step_dependence");
  make(l + "external_work", {nt}, "J", "work of prescribed loads since the start");
  make(l + "residual", {nt}, "J", "energy now + dissipated - energy at the start - external work");
  make(l + "step_dependence", {nt}, "J",
       "part of algorithmic that is no loss: decrease of the leapfrog energy of structures by longer "
       "explicit steps");
  make(l + "linear_momentum", {nt, 3}, "kg m/s", "of blocks and structures");
  make(l + "angular_momentum", {nt, 3}, "kg m^2/s", "of blocks and structures, about the scene origin");
  std::size_t row = 0;
  for (const Column& c : columns_) row += c.width * sizeof(double);
  batch_ = std::clamp<std::size_t>((std::size_t{32} << 20) / std::max<std::size_t>(row, 1), 1, 4096);
}

void HistoryWriter::make(const std::string& path, const Dims& dims, const char* unit,
                         const std::string& description) {
  std::size_t width = 1;
  for (std::size_t k = 1; k < dims.size(); ++k) width *= dims[k];
  file_.create_rows(path, dims, unit, description);
  columns_.push_back({path, width, {}});
}

void HistoryWriter::make_structure(const sim::RunHeader::StructureInfo& s, std::size_t nt) {
  const std::string p = "/history/structures/" + safe_name(s.name) + "/";
  make(p + "base_force", {nt, 3}, "N", "acting on the support");
  make(p + "base_moment", {nt, 3}, "N m",
       "acting on the support, about the first centroid of the supported nodes");
  make(p + "probe_displacement", {nt, s.probes.size(), 3}, "m",
       "displacement of the probes in the order of probe_name");
  make(p + "damage_max", {nt}, "1", "greatest damage of any cell");
  make(p + "damaged_volume", {nt}, "m^3", "volume with damage above one half");
  make(p + "spalled_volume", {nt}, "m^3", "volume eroded or come off as fragments");
  const std::size_t nm = s.members.size(), ns = nm > 0 ? s.members[0].stations.size() : 0;
  if (nm == 0) return;
  make(p + "members/axial", {nt, nm, ns}, "N", "axial force at the stations, compression positive");
  make(p + "members/shear", {nt, nm, ns, 2}, "N",
       "shear force along axis_x and axis_y, of the part above on the part below");
  make(p + "members/moment", {nt, nm, ns, 2}, "N m",
       "bending moment about axis_x and axis_y, of the part above on the part below");
  make(p + "members/drift", {nt, nm, 2}, "m",
       "displacement of the top against the base along axis_x and axis_y");
  make(p + "members/crack_width", {nt, nm}, "m", "widest crack");
  make(p + "members/lost_volume", {nt, nm}, "m^3", "volume eroded or come off");
  make(p + "members/bars_yielded", {nt, nm}, "1", "number of bars that have yielded");
  make(p + "members/bars_broken", {nt, nm}, "1", "number of broken bars");
}

void HistoryWriter::add(const sim::HistoryRow& r) {
  next_ = 0;
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
    const sim::HistoryRow::StructureRow empty{.base_force = Vec3::Constant(nan),
                                              .base_moment = Vec3::Constant(nan),
                                              .probe_displacement = {},
                                              .damage_max = nan,
                                              .damaged_volume = nan,
                                              .spalled_volume = nan,
                                              .members = {},
                                              .peaks = {}};
    add_structure(i < r.structures.size() ? r.structures[i] : empty, header_.structures[i]);
  }
  const sim::LedgerRow& l = r.ledger;
  for (const double v : {l.kinetic, l.potential, l.strain, l.contact, l.friction_work, l.damping_work,
                         l.yield_work, l.ploughing_work, l.vegetation_work, l.damage_work, l.algorithmic,
                         l.external_work, l.residual, l.step_dependence})
    next().add(v);
  next().add(l.linear_momentum);
  next().add(l.angular_momentum);
  if (++held_ == batch_) flush();
}

void HistoryWriter::add_structure(const sim::HistoryRow::StructureRow& s,
                                  const sim::RunHeader::StructureInfo& info) {
  next().add(s.base_force);
  next().add(s.base_moment);
  Column& probes = next();
  for (std::size_t p = 0; p < info.probes.size(); ++p)
    probes.add(p < s.probe_displacement.size() ? s.probe_displacement[p] : Vec3::Constant(nan));
  next().add(s.damage_max);
  next().add(s.damaged_volume);
  next().add(s.spalled_volume);
  const std::vector<Member>& members = info.members;
  if (members.empty()) return;
  const MemberState gone{};
  const auto per_member = [&](auto&& values) {
    Column& c = next();
    for (std::size_t m = 0; m < members.size(); ++m) values(c, m < s.members.size() ? s.members[m] : gone);
  };
  const std::size_t ns = members[0].stations.size();
  const auto per_station = [&](Column& c, const auto& values, std::size_t width) {
    for (std::size_t k = 0; k < ns; ++k)
      for (std::size_t x = 0; x < width; ++x)
        c.add(k < values.size() ? reinterpret_cast<const double*>(&values[k])[x] : nan);
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

void HistoryWriter::flush() {
  for (Column& c : columns_) {
    file_.write_rows(c.path, written_, held_, c.values.data());
    c.values.clear();
  }
  written_ += held_;
  held_ = 0;
}

ContactWriter::ContactWriter(Hdf5File& file, std::size_t n) : file_(file) {
  const auto make = [&](const char* name, Dims dims, const char* unit, const char* description,
                        Hdf5File::Packing packing = Hdf5File::Packing::deflated) {
    const std::string path = std::string("/history/contacts/structure/") + name;
    const std::size_t width = dims.size() > 1 ? dims[1] : 1;
    file_.create_rows(path, dims, unit, description, packing);
    columns_.push_back({path, width, {}});
  };
  make("time", {n}, "s", "end of the coupled step");
  make("dt", {n}, "s", "length of the coupled step: force is the mean over (time - dt, time]");
  make("point", {n, 3}, "m", "where the force acts, scene coordinates");
  make("force", {n, 3}, "N", "mean force on the structure over the step, world axes",
       Hdf5File::Packing::plain);  // five sixths would be left
  make("normal", {n, 3}, "1", "unit normal of the contact, world axes");
  make("area", {n}, "m^2", "tributary area");
  file_.create_rows_int("/history/contacts/structure/block", {n},
                        "index of the block, order of /history/blocks/name");
  file_.create_rows_int("/history/contacts/structure/structure", {n},
                        "index of the structure, order of /geometry/structures/name");
}

void ContactWriter::add(const sim::ContactRow& c) {
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

void ContactWriter::flush() {
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

}  // namespace talus::io
