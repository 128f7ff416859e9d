// Stress scenes of blocks. After each: no intersection by the exact checker, nothing that is not a number, no
// growth of energy, Coulomb's law solved in every step. The same scenes by the 1988 scheme,
// for comparison.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/turn.hpp"
#include "dda/state.hpp"
#include "geometry/exact_check.hpp"
#include "sim/world.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

const std::string held = "fixed = true\n";

struct Stress {
  std::string id, title;
  Method method = Method::by_accuracy(1e-3);
  double size = 1;           // of the smallest block [m]
  double paper_step = 1e-3;  // 0: the 1988 scheme is not asked
  std::function<std::string(const Method&)> text;
  double overlap = 0;  // allowed for springs [m]
  std::function<void(CaseRun&, const Outcome&)> more = {};
  bool quick = true;
};

SceneText start(const Method& m, double duration, double mu,
                const std::string& law = "normal_stiffness = \"hard\"", const Vec3& gravity = {0, 0, -9.81},
                double rows = 40) {
  SceneText s(m, duration, gravity);
  s.history(duration / rows)
      .material("rock", 2600, stone)
      .material("ground", 2600, stone)
      .interface("rock", "rock", mu, law)
      .interface("rock", "ground", mu, law);
  return s;
}

void judge(CaseRun& c, const Stress& q, const Method& m) {
  c.method(m);
  Outcome o = c.run(q.text(m));
  c.holds(q.title + ": runs to its end", "no failure", o.ok());
  const sim::RunHeader& header = o.simulation->header();
  std::vector<geometry::CheckedBody> bodies;
  for (const auto& b : header.blocks) bodies.emplace_back(b.shape);
  std::vector<const geometry::CheckedBody*> list;
  for (const auto& b : bodies) list.push_back(&b);
  const double tolerance = q.overlap > 0 ? q.overlap : 1e-9 * q.size;
  bool finite = true;
  double deepest = 0, growth = 0, first = 0, most = 0;
  for (const auto& b : header.blocks)  // at rest: a thousandth of the size in height, of all blocks, since
                                       // the projection of drift may move each by 5e-10 of its size
    if (!b.fixed) most += b.mass * 9.81 * 1e-3 * q.size;
  // Contacts and energy are met at the ends of steps; rows within them come as near as the accuracy. The
  // rows at ends of macro steps are judged.
  const double macro = o.simulation->world().system->longest_stretch();
  const auto ends_step = [&](std::size_t i) {
    return m.kind == Method::Kind::paper || i + 1 == o.rows.size() ||
           std::abs(o.rows[i].time / macro - std::round(o.rows[i].time / macro)) < 1e-9;
  };
  std::size_t ends = 0, seen = 0;
  for (std::size_t i = 0; i < o.rows.size(); ++i) ends += ends_step(i);
  const std::size_t every = std::max<std::size_t>(1, ends / (header.blocks.size() > 30 ? 4 : 20));
  for (std::size_t i = 0; i < o.rows.size(); ++i) {
    const sim::HistoryRow& r = o.rows[i];
    std::vector<Pose> poses;
    for (std::size_t k = 0; k < r.position.size(); ++k) {
      Pose p;
      p.c = r.position[k];
      Mat3 strain = Mat3::Identity();
      const Vec6& e = r.strain[k];
      strain += dda::strain_tensor(e);
      p.F = Quat(r.orientation[k][0], r.orientation[k][1], r.orientation[k][2], r.orientation[k][3])
                .toRotationMatrix() *
            strain;
      finite = finite && p.c.allFinite() && p.F.allFinite() && r.velocity[k].allFinite();
      poses.push_back(p);
    }
    if (!finite) break;
    if (!ends_step(i)) continue;
    const double energy = r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
    if (i == 0) first = energy;
    growth = std::max(growth, energy - first);
    most = std::max({most, r.ledger.kinetic, std::abs(r.ledger.potential - o.rows.front().ledger.potential)});
    if (seen++ % every != 0 && i + 1 != o.rows.size()) continue;
    for (const geometry::Finding& f :
         geometry::find_intersections(list, poses, {}, header.planes, tolerance)) {
      if (f.with == geometry::Finding::With::body && header.blocks[static_cast<std::size_t>(f.a)].fixed &&
          header.blocks[static_cast<std::size_t>(f.b)].fixed)
        continue;
      deepest = std::max(deepest, f.depth);
    }
  }
  c.holds(q.title + ": finite", "no NaN", finite);
  c.absolute(q.title + ": intersection [m]", "exact check, at most 1e-9 of the size, or the springs' F/k", 0,
             deepest, tolerance);
  c.absolute(q.title + ": energy gained", "relative to the energy in motion", 0,
             most > 0 ? std::max(0.0, growth) / most : 0, 1e-6);
  if (m.kind != Method::Kind::paper && q.more) q.more(c, o);
}

std::string cubes(SceneText s, int nx, int ny, int nz, double edge, double z, double gap = 0,
                  double shift = 0) {
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        s.box(fmt::format("C{}_{}_{}", i, j, k), Vec3(edge, edge, edge),
              Vec3(i * (edge + gap) + (k % 2) * shift, j * (edge + gap), z + edge / 2 + k * (edge + gap)));
  return s.str();
}

std::vector<Stress> scenes() {
  using M = Method;
  std::vector<Stress> all;
  const Vec3 up = Vec3::UnitZ(), unit = Vec3::Ones();
  const auto add = [&](const std::string& id, const std::string& title,
                       const std::function<std::string(const M&)>& text) -> Stress& {
    all.push_back({.id = id, .title = title, .text = text});
    return all.back();
  };
  add("E1", "1000 m/s at a plate of 1 mm, step 0.01", [=](const M& m) {
    return start(m, 0.1, 0.5)
        .box("plate", Vec3(0.001, 20, 20), Vec3::Zero(), held)
        .box("B", unit, Vec3(-8.3, 0, 0), velocity(Vec3(1000, 0, 0)))
        .str();
  }).method = M::fixed_step(0.01);
  auto& crowd = add("E1-crowd", "1000 m/s at a plate of 1 mm in an island of 26", [=](const M& m) {
    SceneText s = start(m, 0.1, 0.5);
    s.plane(up, Vec3(0, 0, -0.5))
        .box("plate", Vec3(0.001, 20, 20), Vec3(0, 0, 9.5), held)
        .box("B", unit, Vec3(-8.3, 0, 1.6), velocity(Vec3(1000, 0, 0)));
    for (int i = 0; i < 24; ++i)
      s.box(fmt::format("c{}", i), Vec3(0.5, 0.5, 0.5), Vec3((i < 12 ? 0.4 : -8) + 0.6 * (i % 12), 0, -0.25),
            {});
    return s.str();
  });
  crowd.size = 0.5;
  crowd.more = [](CaseRun& c, const Outcome& o) {
    c.holds("1000 m/s in a crowd: the cube stays before the plate", "x <= -0.5",
            o.last().position[1].x() <= -0.5 + 1e-9);
  };
  add("E2", "tunnel with 0.1 mm to spare", [=](const M& m) {
    return start(m, 1, 0.3)
        .plane(up)
        .plane(-up, Vec3(0, 0, 1.0001))
        .plane(Vec3::UnitY())
        .plane(-Vec3::UnitY(), Vec3(0, 1.0001, 0))
        .box("B", unit, Vec3(0, 0.50005, 0.50005), velocity(Vec3(20, 0.5, 0)) + spin(Vec3(0.1, 0.05, 0.2)))
        .str();
  });
  for (const double ratio : {1e3, 1e6, 1e8})
    add(fmt::format("E3-{:g}", ratio), fmt::format("mass ratio {:g}", ratio), [=](const M& m) {
      SceneText s = start(m, 0.5, 0.5);
      s.material("heavy", 1e5, stone)
          .material("light", 1e5 / ratio, stone)
          .interface("heavy", "light", 0.5)
          .interface("heavy", "ground", 0.5)
          .interface("light", "ground", 0.5);
      return s.plane(up)
          .box("light", unit, Vec3(0, 0, 0.5), {}, "light")
          .box("heavy", unit, Vec3(0.1, 0, 1.6), {}, "heavy")
          .str();
    });
  add("E4", "spike, point first", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up)
        .hull("S", {Vec3(0, 0, 0), Vec3(0.1, 0, 2), Vec3(-0.1, 0.1, 2), Vec3(-0.1, -0.1, 2)},
              Vec3(-0.025, 0, 2.5), spin(Vec3(0.2, 0, 0)))
        .str();
  }).size = 0.1;
  add("E5", "wedge in a notch", [=](const M& m) {
    return start(m, 1, 0.4)
        .plane(Vec3(1, 0, 0.3))
        .plane(Vec3(-1, 0, 0.3))
        .box("B", unit, Vec3(0.05, 0, 3), spin(Vec3(0, 0.3, 0.2)))
        .str();
  });
  add("E6", "over a crack of 1 mm", [=](const M& m) {
    return start(m, 0.5, 0.3)
        .box("a", unit, Vec3(-0.5005, 0, -0.5), held)
        .box("b", unit, Vec3(0.5005, 0, -0.5), held)
        .box("B", Vec3(0.3, 0.3, 0.3), Vec3(-0.3, 0, 0.25), velocity(Vec3(2, 0, 0)))
        .str();
  }).size = 0.3;
  add("E7", "over a cliff", [=](const M& m) {
    return start(m, 1.2, 0.2)
        .plane(up, Vec3(0, 0, -3))
        .box("a", Vec3(2, 2, 2), Vec3(-1, 0, -1), held)
        .box("B", Vec3(0.5, 0.5, 0.5), Vec3(-0.8, 0, 0.25), velocity(Vec3(2, 0.1, 0)))
        .str();
  }).size = 0.5;
  // Slider on separate flush blocks: {mu-free} straight, turned about the vertical, on steps, and in a crowd
  // of more than twelve.
  const auto slider = [=](const M& m, double step, double yaw, int crowd) {
    SceneText s = start(m, 1, 0);
    for (int i = 0; i < 5; ++i) s.box(fmt::format("a{}", i), unit, Vec3(i, 0, -0.5 + (i % 2) * step), held);
    for (int i = 0; i < crowd; ++i)
      s.box(fmt::format("c{}", i), Vec3(0.1, 0.1, 0.1), Vec3(0.25 * i, 0.35 * (i % 2 == 0 ? 1 : -1), 0.05),
            {});
    return s.box("B", Vec3(0.4, 0.4, 0.4), Vec3(0, 0, 0.2), velocity(Vec3(4, 0, 0)) + turned(Vec3(0, 0, yaw)))
        .str();
  };
  const auto smooth = [](CaseRun& c, const Outcome& o) {
    c.absolute("internal edges: change of velocity [m/s]", "smooth coplanar faces", 0,
               (o.last().velocity.back() - Vec3(4, 0, 0)).norm(), 1e-8);
  };
  const auto over_edges = [&](const std::string& id, const std::string& title, double step, double yaw,
                              int crowd) {
    auto& edges = add(id, title, [=](const M& m) { return slider(m, step, yaw, crowd); });
    edges.size = 0.4;
    edges.more = smooth;
  };
  over_edges("E8", "internal edges, mu 0", 0, 0, 0);
  over_edges("E8-turned", "internal edges, turned 30 degrees", 0, 30 * deg, 0);
  for (const double step : {1e-12, 1e-10, 4e-10})
    over_edges(fmt::format("E8-{:g}", step), fmt::format("internal edges, steps of {:g} m", step), step, 0,
               0);
  over_edges("E8-crowd", "internal edges, an island of 15", 0, 0, 14);
  const Mat3 corner = turn_between(Vec3::Ones(), up).toRotationMatrix();
  const double half = std::sqrt(3.0) / 2;
  add("E9", "vertex on vertex", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up, Vec3(0, 0, -2))
        .box("a", unit, Vec3(0, 0, -half), held + turned(rotation_vector(corner)))
        .box("B", unit, Vec3(0, 0, half + 0.2), turned(rotation_vector(corner)))
        .str();
  });
  const auto edge_up = [](double z) {
    return turned(rotation_vector(Eigen::AngleAxisd(z, Vec3::UnitZ()).toRotationMatrix() *
                                  Eigen::AngleAxisd(45 * deg, Vec3::UnitX()).toRotationMatrix()));
  };
  const double diagonal = std::sqrt(2.0) / 2;
  add("E10", "edge across edge", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up, Vec3(0, 0, -2))
        .box("a", unit, Vec3(0, 0, -diagonal), held + edge_up(0))
        .box("B", unit, Vec3(0.1, 0.1, diagonal + 0.1), edge_up(70 * deg))
        .str();
  });
  add("E11", "edge along edge", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up, Vec3(0, 0, -2))
        .box("a", unit, Vec3(0, 0, -diagonal), held + edge_up(0))
        .box("B", unit, Vec3(0.1, 0, diagonal + 0.1), edge_up(0))
        .str();
  });
  add("E12", "corner of three walls", [=](const M& m) {
    return start(m, 1, 0.4)
        .plane(up)
        .plane(Vec3::UnitX())
        .plane(Vec3::UnitY())
        .box("B", unit, Vec3(1.2, 1.3, 1.6), velocity(Vec3(-6, -5, -4)) + spin(Vec3(1, 2, 3)))
        .str();
  });
  add("E13", "wall shot at 120 m/s", [=](const M& m) {
    SceneText s = start(m, 0.05, 0.5);
    s.plane(up).box("shot", Vec3(0.3, 0.3, 0.3), Vec3(-1, 0.7, 0.6), velocity(Vec3(120, 0, 0)));
    return cubes(s, 1, 4, 3, 0.4, 0);
  }).size = 0.3;
  add("E14", "stack of 30", [=](const M& m) { return cubes(start(m, 1, 0.5).plane(up), 1, 1, 30, 1, 0); });
  add("E15", "needle, aspect 1e4", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up)
        .box("N", Vec3(10, 0.001, 0.001), Vec3(0, 0, 1), turned(Vec3(0, 0.2, 0)) + spin(Vec3(0, 0.3, 1)))
        .str();
  }).size = 0.001;
  add("E16", "plates 10 m x 1 mm, ten of them", [=](const M& m) {
    SceneText s = start(m, 0.3, 0.5);
    s.plane(up);
    for (int i = 0; i < 10; ++i)
      s.box(fmt::format("P{}", i), Vec3(10, 10, 0.001), Vec3(0, 0, 0.0005 + 0.002 * i));
    return s.str();
  }).size = 0.001;
  add("E17", "1000 rad/s at 1e-4 above a plane", [=](const M& m) {
    return start(m, 0.1, 0.5)
        .plane(up)
        .box("B", unit, Vec3(0, 0, half + 1e-4), spin(Vec3(600, 500, 624)))
        .str();
  }).paper_step = 1e-4;
  auto& far = add("E18", "origin 1e6 m away", [=](const M& m) {
    return start(m, 1, 0.5)
        .plane(up)
        .box("B", unit, Vec3(1e6, -1e6, 1.5), velocity(Vec3(3, 0, 0)) + spin(Vec3(1, 2, 3)))
        .str();
  });
  far.more = [=](CaseRun& c, const Outcome& o) {
    const Outcome near =
        c.run(start(Method::by_accuracy(1e-3), 1, 0.5)
                  .plane(up)
                  .box("B", unit, Vec3(0, 0, 1.5), velocity(Vec3(3, 0, 0)) + spin(Vec3(1, 2, 3)))
                  .str());
    c.absolute("origin 1e6 m away: against the origin [m]", "within the accuracy", 0,
               (o.last().position[0] - Vec3(1e6, -1e6, 0) - near.last().position[0]).norm(), 1e-3);
  };
  for (const double scale : {1e-6, 1e6}) {
    Stress& q =
        add(fmt::format("E19-{:g}", scale), fmt::format("lengths times {:g}", scale), [=](const M& m) {
          return start(m, std::sqrt(scale), 0.5)
              .plane(up)
              .box("a", scale * unit, Vec3(0, 0, 0.5 * scale))
              .box("B", scale * unit, scale * Vec3(0.3, 0.2, 1.9), spin(Vec3(1, 2, 3) / std::sqrt(scale)))
              .str();
        });
    q.size = scale;
    q.paper_step = 1e-3 * std::sqrt(scale);
  }
  for (const double h : {1e-5, 1e-2, 1.0}) {
    Stress& q = add(fmt::format("E20-{:g}", h), fmt::format("step {:g} s", h), [=](const M& m) {
      SceneText s =
          start(m, std::clamp(300 * h, 0.01, 5.0), 0.5, "normal_stiffness = \"hard\"", {0, 0, -9.81}, 5);
      return cubes(s.plane(up), 2, 1, 2, 1, 0.0005, 0.1, 0.3);
    });
    q.method = M::fixed_step(h);
    q.paper_step = h;
  }
  for (const double k : {1e6, 1e10, 1e14}) {
    Stress& q = add(fmt::format("E21-{:g}", k), fmt::format("springs of {:g} N/m", k), [=](const M& m) {
      return start(m, 0.5, 0.5, "normal_stiffness = \"" + number(k) + " N/m\"")
          .plane(up)
          .box("B", unit, Vec3(0, 0, 0.6))
          .str();
    });
    q.overlap = 1.05 * (2600 * 9.81 / 4 / k +
                        std::sqrt(2600.0 / 4 / k) * 1.5);  // weight, and what is left of the fall
  }
  for (const double mu : {0.0, 1.0, 10.0})
    add(fmt::format("E22-{:g}", mu), fmt::format("friction {:g}", mu), [=](const M& m) {
      return start(m, 1, mu)
          .plane(Vec3(0.5, 0, 1))
          .box("a", unit, Vec3(0, 0, 1.2), spin(Vec3(0, 1, 0)))
          .box("B", unit, Vec3(0.2, 0.3, 2.6), spin(Vec3(1, 2, 3)))
          .str();
    });
  for (const double e : {0.0, 1.0})
    add(fmt::format("E23-{:g}", e), fmt::format("100 impacts at once, e = {:g}", e), [=](const M& m) {
      return cubes(start(m, 0.3, 0.3, "normal_stiffness = \"hard\"\nrestitution = " + number(e)).plane(up), 5,
                   5, 1, 1, 0.2, 0.0);
    });
  add("E24", "moduli 1e6 apart, deformable", [=](const M& m) {
    SceneText s(m, 0.1);
    s.history(0.005)
        .material("soft", 2000, "young = \"1 MPa\"\npoisson = 0.25")
        .material("stiff", 2000, "young = 1e12\npoisson = 0.25")
        .interface("soft", "stiff", 0.5)
        .interface("soft", "ground", 0.5)
        .interface("stiff", "ground", 0.5);
    return s.plane(up)
        .box("a", unit, Vec3(0, 0, 0.55), "deformable = true\n", "soft")
        .box("B", unit, Vec3(0.1, 0, 1.7), "deformable = true\n", "stiff")
        .str();
  });
  add("E25", "nu .499, deformable", [=](const M& m) {
    SceneText s(m, 0.1);
    s.history(0.005)
        .material("gum", 1000, "young = \"10 MPa\"\npoisson = 0.499")
        .interface("gum", "ground", 0.5)
        .interface("gum", "gum", 0.5);
    return s.plane(up).box("B", unit, Vec3(0, 0, 0.6), "deformable = true\n", "gum").str();
  });
  add("E26", "27 cubes touching exactly",
      [=](const M& m) { return cubes(start(m, 0.3, 0.5).plane(up), 3, 3, 3, 1, 0); });
  add("E27", "compactor of 1 MN on eight cubes", [=](const M& m) {
    SceneText s = start(m, 0.2, 0.5);
    s.material("press", 1e6 / 9.81 / 8, stone)
        .interface("press", "rock", 0.3)
        .interface("press", "ground", 0.3)
        .plane(up)
        .box("press", Vec3(4, 4, 0.5), Vec3(0.5, 0.5, 2.5), {}, "press");
    return cubes(s, 2, 2, 2, 1, 0, 0.02);
  });
  add("E28", "arch of seven, thick enough", [](const M& m) { return arch_text(m, 7, 0.2, 0.7, 0.5); }).size =
      0.2;
  add("E29", "arch of seven, too thin: it falls", [](const M& m) {
    return arch_text(m, 7, 0.05, 0.7, 0.5);
  }).size = 0.05;
  add("E30", "pile of eight dodecahedra", [=](const M& m) {
    SceneText s = start(m, 1, 0.5);
    s.plane(up).plane(Vec3(1, 0, 0.5), Vec3(-1, 0, 0)).plane(Vec3(-1, 0, 0.5), Vec3(1, 0, 0));
    std::string list;
    for (int i = 0; i < 8; ++i)
      list += fmt::format(
          "[[block]]\nname = \"D{}\"\nmaterial = \"rock\"\nshape = \"dodecahedron\"\nvolume = 0.05\nposition "
          "= {}\ndeformable = false\n",
          i, vector(Vec3(0.1 * (i % 3) - 0.1, 0.05 * i, 0.6 + 0.6 * i)));
    return s.raw(list).str();
  }).size = 0.3;
  add("E31", "brick wall of 20 at rest, running bond",
      [=](const M& m) { return cubes(start(m, 0.3, 0.5).plane(up), 5, 1, 4, 1, 0, 0, 0.5); });
  auto& dovetail = add("E50", "dovetail, pulled out of its socket and along it", [=](const M& m) {
    // Half width 0.5 below, 0.3 above: it hangs by flanks that lean over it.
    SceneText s = start(m, 1, 0.1, "normal_stiffness = \"hard\"", {0, 4, 9.81});
    const auto prism_of = [](std::vector<Vec3> section, double from, double to) {
      std::vector<Vec3> points;
      for (const Vec3& x : section)
        for (const double y : {from, to}) points.push_back(x + y * Vec3::UnitY());
      return points;
    };
    for (const double side : {-1.0, 1.0}) {
      const std::vector<Vec3> section{
          {side * 0.5, 0, 0}, {side * 1.5, 0, 0}, {side * 1.5, 0, 0.5}, {side * 0.3, 0, 0.5}};
      const double x = (0.5 * 1.0 * 1.0 + 0.05 * (0.5 - 0.2 / 3)) / 0.55,
                   z = (0.5 * 0.25 + 0.05 * 0.5 * 2 / 3) / 0.55;
      s.hull(side < 0 ? "left" : "right", prism_of(section, -2, 4), Vec3(side * x, 1, z), held);
    }
    return s
        .hull("key", prism_of({{-0.5, 0, 0}, {0.5, 0, 0}, {0.3, 0, 0.5}, {-0.3, 0, 0.5}}, -0.5, 0.5),
              Vec3(0, 0, 0.5 / 3 * (1 + 2 * 0.6) / 1.6))
        .str();
  });
  dovetail.size = 0.5;
  dovetail.more = [](CaseRun& c, const Outcome& o) {
    const double pressed = 9.81 * std::hypot(0.5, 0.2) / 0.2;  // on both flanks, over the mass
    const Vec3 moved = o.last().position.back() - o.rows.front().position.back();
    c.relative("dovetail: path along the socket [m]", "(g_y - mu N / m) t^2 / 2", 0.5 * (4 - 0.1 * pressed),
               moved.y(), 1e-6);
    c.absolute("dovetail: out of the socket [m]", "held", 0, moved.z(), 1e-8);
  };
  const auto heap = [=](const M& m, int stride) {
    SceneText s = start(m, 0.5, 0.4);
    for (int i = 0; i < 20; ++i) {
      const int n = stride * i % 20;
      s.box(fmt::format("B{}", n), Vec3::Constant(0.5),
            Vec3(0.52 * (n % 2), 0.53 * (n / 2 % 2), 0.3 + 0.6 * (n / 4)), spin(Vec3(0.3 * n, 1, 0.2)));
    }
    return s.plane(up).str();
  };
  auto& permuted = add("E53", "pile of twenty cubes", [=](const M& m) { return heap(m, 1); });
  permuted.size = 0.5;
  permuted.more = [=](CaseRun& c, const Outcome& o) {
    const Outcome other = run_scene(heap(M::by_accuracy(1e-3), 7));
    bool same = other.ok();
    for (std::size_t i = 0; same && i < 20; ++i) {
      const std::size_t n = 7 * i % 20;
      same = other.last().position[i] == o.last().position[n] &&
             other.last().orientation[i] == o.last().orientation[n] &&
             other.last().velocity[i] == o.last().velocity[n];
    }
    c.holds("pile of twenty cubes: the same bits when listed in another order", "same bits", same);
  };
  const auto heavy = [&](const std::string& id, const std::string& title, double size,
                         const std::function<std::string(const M&)>& text) -> Stress& {
    Stress& q = add(id, title, text);
    q.size = size;
    q.quick = false;
    q.paper_step = 0;
    return q;
  };
  heavy("E51", "stack of 1000", 1, [=](const M& m) {
    return cubes(start(m, 10, 0.5, "normal_stiffness = \"hard\"", {0, 0, -9.81}, 5).plane(up), 1, 1, 1000, 1,
                 0);
  });
  heavy("E52", "packing of 64 loose cubes, step 1 s", 1, [=](const M& m) {
    SceneText s = start(m, 5, 0.5, "normal_stiffness = \"hard\"", {0, 0, -9.81}, 5);
    for (const Vec3& wall : {Vec3(1, 0, 0), Vec3(0, 1, 0)})
      s.plane(wall, -1.5 * wall).plane(-wall, 5.5 * wall);
    return cubes(s.plane(up), 4, 4, 4, 1, 0.05, 0.1, 0.1);
  }).method = M::fixed_step(1.0);
  return all;
}

}  // namespace

std::vector<Case> stability_cases() {
  std::vector<Case> cases;
  for (Stress& q : scenes()) {
    Case c{"stability", q.id, q.title, "invariants", q.quick, {}};
    c.body = [q](CaseRun& run) {
      judge(run, q, q.method);
      if (run.quick() || q.paper_step <= 0) return;
      try {
        judge(run, q, Method::paper(q.paper_step));
      } catch (const std::exception& e) { run.holds(q.title + ": scene", e.what(), false).note = e.what(); }
    };
    cases.push_back(std::move(c));
  }
  return cases;
}

}  // namespace talus::verify
