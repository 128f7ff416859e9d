/// A made-up run with known numbers, to test writers and the report without a simulator: a boulder bounces
/// down a slope and strikes a pier with a half-sine force of known impulse; the pier sways with a damped
/// cosine. Nothing here is physics to rely on.
#pragma once
#include <cmath>
#include <filesystem>
#include <numbers>

#include "io/recorder.hpp"

namespace talus::test {

inline Polyhedron box(const Vec3& size) {
  Polyhedron p;
  for (int i = 0; i < 8; ++i)
    p.vertices.push_back(0.5 * size.cwiseProduct(Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  p.face_offset = {0};
  for (int f = 0; f < 6; ++f) {
    for (const int v : faces[f]) p.face_vertices.push_back(v);
    p.face_offset.push_back(static_cast<int>(p.face_vertices.size()));
    p.triangles.push_back({faces[f][0], faces[f][1], faces[f][2]});
    p.triangles.push_back({faces[f][0], faces[f][2], faces[f][3]});
    p.triangle_face.insert(p.triangle_face.end(), 2, f);
  }
  p.convex = true;
  return p;
}

struct SyntheticRun {
  int blocks = 2;
  int terrain_nodes = 81;  // per side
  std::array<int, 3> cells{4, 4, 24};
  double end = 8.0, impact = 5.0, contact_time = 0.02, peak = 40e6;
  double history_interval = 0.01, field_interval = 0.05;
  bool fragment = true, structure = true, bars = false;
  bool members = false,
       line = false;  // a pier P2 and a span S1 of five stations each; a line "road" that B1 crosses at 4 s
  Vec3 offset{1000, 2000, 1500};  // far from the origin, as real terrain is
  Vec3 pier{120, 80, 0};          // base centre, relative to offset

  double ground(double x, double y) const {
    const double slope = x < 110 ? 70 - 0.62 * x : 70 - 0.62 * 110 - 0.02 * (x - 110);
    return slope + 1.8 * std::sin(0.11 * x) * std::cos(0.07 * y) + 0.012 * (y - 80) * (y - 80);
  }

  sim::RunHeader header() const {
    sim::RunHeader h;
    h.title = "Synthetic boulder against pier P2";
    h.duration = end;
    for (int i = 0; i < blocks; ++i) {
      sim::RunHeader::BlockInfo b;
      b.name = i == 0 ? "B1" : "B" + std::to_string(i + 1);
      const Vec3 size = i == 0 ? Vec3(2.6, 3.0, 3.4) : Vec3(0.8, 1.0, 1.2) * (1 + 0.1 * (i % 5));
      b.shape = box(size);
      b.volume = size.prod();
      b.mass = 2600 * b.volume;
      h.blocks.push_back(b);
    }
    const int n = terrain_nodes;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double x = 160.0 * i / (n - 1), y = 160.0 * j / (n - 1);
        h.terrain.vertices.push_back(offset + Vec3(x, y, ground(x, y)));
      }
    for (int j = 0; j + 1 < n; ++j)
      for (int i = 0; i + 1 < n; ++i) {
        const int a = j * n + i;
        h.terrain.triangles.push_back({a, a + 1, a + n + 1});
        h.terrain.triangles.push_back({a, a + n + 1, a + n});
      }
    if (structure) {
      sim::RunHeader::StructureInfo s;
      s.name = "P2";
      s.probes = {"top", "middle"};
      s.probe_at = {base() + Vec3(0, 0, 12), base() + Vec3(0, 0, 6)};
      s.plan = "hexahedra 4 x 4 x 24, 8-node\nno reinforcement: none was given";
      if (members) s.members = {pier_member(), span_member()};
      h.structures.push_back(s);
    }
    h.materials = {"rock", "slope", "C40"};
    h.plan = {"blocks: " + std::to_string(blocks) + ", rigid, 6 unknowns each", "terrain: rigid, no unknowns",
              "damage law: left out, the structure is elastic"};
    return h;
  }

  Member pier_member() const {
    Member m;
    m.name = "P2";
    m.base = base();
    m.length = 12;
    m.volume = 48;
    m.stations = {0, 3, 6, 9, 12};
    m.axial_preload = 1.2e6;
    m.shear_design = m.shear_mean = {20e6, 20e6};
    return m;
  }
  Member span_member() const {
    Member m = pier_member();
    m.name = "S1";
    m.span = true;
    m.base = base() + Vec3(0, -15, 12);
    m.axis_x = -Vec3::UnitX();
    m.axis_y = Vec3::UnitZ();
    m.length = 30;
    m.stations = {0, 7.5, 15, 22.5, 30};
    return m;
  }
  /// Section forces at station k of five: of the pier of a force at 3.4 m, of the span of its own weight.
  MemberState member_state(bool span, double t) const {
    MemberState s;
    for (int k = 0; k < 5; ++k) {
      const double below = !span && 3.0 * k < 3.4 ? force(t) : 0.0;
      s.axial.push_back(span ? 0.0 : 1.2e6 * (1 - 0.1 * k));
      s.shear.push_back({below, span ? 1e6 * (1 - 0.5 * k) : 0.0});
      s.moment.push_back({span ? 1.8e6 * k * (4 - k) : 0.0, below * (3.4 - 3.0 * k)});
    }
    s.drift = {sway(t), 0};
    s.crack_width = t < impact ? 0 : 3e-4;
    return s;
  }
  MemberPeaks member_peaks(bool span, double t) const {
    MemberPeaks p;
    const double at = impact + 0.5 * contact_time;
    p.shear = span || t < at ? LoadPeak{1e6, 0, 0} : LoadPeak{0.9 * peak, at, 3};
    p.use_design = p.use_mean = {p.shear.value / 20e6, p.shear.time, p.shear.station};
    p.moment = span || t < at ? LoadPeak{7.2e6, 0, span ? 15.0 : 0.0} : LoadPeak{3 * peak, at, 0};
    p.crack_width = span || t < impact ? 0 : 3e-4;
    p.drift = span ? 1e-3 : 0.03;
    return p;
  }

  Vec3 base() const { return offset + Vec3(pier.x(), pier.y(), ground(pier.x(), pier.y())); }

  /// Centroid of block i: three bounces down the slope to the pier, then back and down.
  Vec3 position(int i, double t) const {
    const double y = pier.y() + 7.0 * ((i * 37) % 11 - 5) / 5.0 * (i > 0) -
                     12.0 * (1 - std::min(t / impact, 1.0)) * (i % 2 ? -1 : 1);
    const double x_hit = pier.x() - 1.0 - 1.3;
    double s = std::min(t / impact, 1.0);
    double x = 8 + (x_hit - 8) * (0.35 * s + 0.65 * s * s) - (i > 0 ? 6.0 + 2.0 * (i % 7) : 0.0);
    double hop = 4.5 * std::abs(std::sin(std::numbers::pi * 4.5 * s * s));
    if (t > impact) {
      const double u = t - impact;
      if (i == 0) x = x_hit - 4.0 * (1 - std::exp(-u));
      hop = 4.5 * std::exp(-3.5 * u);
    }
    return offset + Vec3(x, y, ground(x, y) + 1.6 + hop);
  }
  Eigen::Vector4d orientation(int i, double t) const {
    const double u = t < impact ? t : impact + 0.6 * (1 - std::exp(-(t - impact)));
    const double angle = 0.45 * u * u + i;
    const Vec3 axis = Vec3(0.1, 1.0, 0.05 * (i % 3)).normalized();
    return {std::cos(angle / 2), axis.x() * std::sin(angle / 2), axis.y() * std::sin(angle / 2),
            axis.z() * std::sin(angle / 2)};
  }
  double sway(double t) const {
    const double u = t - impact;
    return u <= 0 ? 0.0
                  : 0.035 * std::exp(-0.9 * u) * std::sin(2 * std::numbers::pi * 5.0 * u) +
                        0.004 * (1 - std::exp(-40 * u));
  }
  double force(double t) const {
    const double u = (t - impact) / contact_time;
    return u <= 0 || u >= 1
               ? 0.0
               : peak * std::sin(std::numbers::pi * u) * (1 + 0.25 * std::sin(2 * std::numbers::pi * 11 * u));
  }
  int present(double t) const { return blocks + (fragment && structure && t >= impact + 0.5 ? 1 : 0); }

  sim::HistoryRow row(double t, int n) const {
    sim::HistoryRow r;
    r.time = t;
    const auto h = header();
    for (int i = 0; i < n; ++i) {
      const double e = 1e-5;
      const Vec3 p = position(i, t), v = (position(i, t + e) - position(i, t)) / e;
      const double mass = i < blocks ? h.blocks[static_cast<std::size_t>(i)].mass : 2600 * 0.125;
      r.position.push_back(p);
      r.velocity.push_back(v);
      r.spin.push_back(Vec3(0, 0.9 * t, 0));
      r.orientation.push_back(orientation(i, t));
      r.strain.push_back(Vec6::Zero());
      r.kinetic_translational.push_back(0.5 * mass * v.squaredNorm());
      r.kinetic_rotational.push_back(0.05 * mass * v.squaredNorm());
      r.ledger.kinetic += r.kinetic_translational.back() + r.kinetic_rotational.back();
      r.ledger.potential += mass * 9.81 * p.z();
      r.ledger.linear_momentum += mass * v;
    }
    if (structure) {
      sim::HistoryRow::StructureRow s;
      s.base_force = Vec3(force(t) + 2e8 * sway(t), 0, -1.2e6);
      s.base_moment = Vec3(0, 6 * force(t) + 1.5e9 * sway(t), 0);
      s.probe_displacement = {Vec3(sway(t), 0, 0), Vec3(0.4 * sway(t), 0, 0)};
      s.damage_max = t < impact ? 0 : 0.86 * (1 - std::exp(-60 * (t - impact)));
      s.damaged_volume = t < impact ? 0 : 0.7 * (1 - std::exp(-60 * (t - impact)));
      for (const bool span : {false, true})
        if (members)
          s.members.push_back(member_state(span, t)), s.peaks.members.push_back(member_peaks(span, t));
      r.structures.push_back(s);
      r.ledger.strain = 0.5 * 2e8 * sway(t) * sway(t);
      r.ledger.damage_work = s.damage_max * 4e5;
    }
    const double k = r.ledger.kinetic + r.ledger.strain + r.ledger.potential;
    if (t == 0) start_energy_ = k;
    r.ledger.friction_work = 0.8 * std::max(0.0, start_energy_ - k);
    r.ledger.damping_work =
        start_energy_ - k - r.ledger.friction_work - r.ledger.damage_work + 0.002 * r.ledger.kinetic;
    r.ledger.residual = 0.002 * r.ledger.kinetic;
    return r;
  }

  Structure::Snapshot snapshot(double t) const {
    Structure::Snapshot s;
    const int nx = cells[0], ny = cells[1], nz = cells[2];
    const auto id = [&](int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
    for (int k = 0; k <= nz; ++k)
      for (int j = 0; j <= ny; ++j)
        for (int i = 0; i <= nx; ++i) {
          const Vec3 local(2.0 * i / nx - 1, 2.0 * j / ny - 1, 12.0 * k / nz);
          const double z = local.z() / 12;
          s.nodes.push_back(base() + local);
          s.displacement.push_back(
              Vec3(sway(t) * z * z * (1.5 - 0.5 * z), 0, -sway(t) * 2 * z / 12 * local.x()));
          s.velocity.push_back(Vec3(0, 0, 0));
        }
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
          s.hexes.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                             id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                             id(i, j + 1, k + 1)});
          const double z = 12.0 * (k + 0.5) / nz,
                       d = std::exp(-std::pow((z - 3.4) / 1.2, 2)) * std::exp(-0.5 * i);
          s.damage_tension.push_back(
              t < impact ? 0 : std::min(1.0, 0.9 * d * (1 - std::exp(-60 * (t - impact)))));
          s.damage_compression.push_back(0.5 * s.damage_tension.back());
          s.stress_von_mises.push_back(2e5 * (12 - z) / 12 + 3e8 * std::abs(sway(t)) * (12 - z) / 12 *
                                                                 std::abs(2.0 * (i + 0.5) / nx - 1));
        }
    for (int corner = 0; bars && corner < 4; ++corner)
      for (int k = 0; k <= nz; ++k) {
        const Vec3 local(corner & 1 ? 0.9 : -0.9, corner & 2 ? 0.9 : -0.9, 12.0 * k / nz);
        const double z = local.z() / 12;
        s.bar_points.push_back(base() + local +
                               Vec3(sway(t) * z * z * (1.5 - 0.5 * z), 0, -sway(t) * 2 * z / 12 * local.x()));
        const int n = static_cast<int>(s.bar_points.size());
        if (k == 0) continue;
        s.bars.push_back({n - 2, n - 1});
        s.bar_strain.push_back(sway(t) * (1 - z) * local.x() / 12);
      }
    return s;
  }

  std::vector<Pose> poses(double t, int n) const {
    std::vector<Pose> p;
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector4d q = orientation(i, t);
      p.push_back({position(i, t), Quat(q[0], q[1], q[2], q[3]).toRotationMatrix()});
    }
    return p;
  }

  std::vector<sim::ContactRow> contact_rows(double t0, double t1, double dt = 1e-4) const {
    std::vector<sim::ContactRow> rows;
    for (int k = 0; structure && impact + (k + 1) * dt <= impact + contact_time + 1e-12; ++k) {
      const double t = impact + (k + 1) * dt;
      if (t <= t0 || t > t1) continue;
      for (int c = 0; c < 2; ++c) {
        sim::ContactRow r;
        r.time = t;
        r.dt = dt;
        r.point = base() + Vec3(-1, c ? 0.3 : -0.3, 3.4);
        r.force = Vec3(0.5 * force(t - 0.5 * dt), 0, -0.05 * force(t - 0.5 * dt));
        r.normal = Vec3(-1, 0, 0);
        r.area = 0.04;
        rows.push_back(r);
      }
    }
    return rows;
  }

  sim::RunHeader::BlockInfo fragment_info() const {
    sim::RunHeader::BlockInfo b;
    b.name = "P2-fragment-1";
    b.shape = box(Vec3(0.5, 0.5, 0.5));
    b.volume = 0.125;
    b.mass = 2600 * 0.125;
    b.fragment = true;
    return b;
  }

  /// Records rows [first, last] of the run; `each` is called after every row.
  template <class Each>
  void record(io::Recorder& r, int first, int last, Each each) const {
    if (line && first == 0) r.lines(std::vector<std::string>{"road"});
    const int per_field = static_cast<int>(std::lround(field_interval / history_interval));
    for (int k = first; k <= last; ++k) {
      const double t = k * history_interval, before = t - history_interval;
      if (k > 0) r.contacts(contact_rows(before, t));
      if (line && before < 4 && t >= 4) {
        const io::LineRow crossed{.block = 0,
                                  .time = 4,
                                  .position = position(0, 4),
                                  .velocity = Vec3(20, 0, -9),
                                  .translational = 4e6,
                                  .rotational = 1e5,
                                  .height = 2.5};
        r.crossings({&crossed, 1});
      }
      if (k > 0 && present(t) > present(before)) {
        const auto f = fragment_info();
        r.extend({&f, 1});
      }
      r.history(row(t, present(t)));
      if (k % per_field == 0) {
        std::vector<Structure::Fields> s;
        if (structure) s.push_back(Structure::fields(snapshot(t)));
        r.field(t, poses(t, present(t)), s);
      }
      each(k);
    }
  }
  int rows() const { return static_cast<int>(std::lround(end / history_interval)) + 1; }

 private:
  mutable double start_energy_ = 0;
};

inline SyntheticRun small() {
  SyntheticRun run;
  run.terrain_nodes = 9;
  run.cells = {1, 1, 4};
  return run;
}

}  // namespace talus::test
