// Contact of the 1988 scheme on a plane: incline, stop, restitution, ledger, stack.
#include <gtest/gtest.h>

#include "scene1988.hpp"

using namespace talus;
using namespace talus::dda;
using namespace talus::dda::test;

namespace {

/// Cube of 1 m on a plane inclined by `angle` about y, resting on its four lower corners; x down the slope.
Scene incline(double angle, double friction, double kn, double ks) {
  Scene s(friction, kn, ks);
  const Quat q(Eigen::AngleAxisd(angle, Vec3::UnitY()));
  s.planes.push_back({Vec3::Zero(), q * Vec3::UnitZ(), 0});
  s.add_box(Vec3(1, 1, 1), q * Vec3(0, 0, 0.5), q);
  return s;
}

/// The scalar recurrence of the scheme for a mass on a spring: rebound speed over impact speed of a mass that
/// starts `height` above touch with speed v0 downwards, without gravity. Starts open; closes where the free
/// step would overlap.
double scalar_restitution(double height, double v0, double k, double m, double dt) {
  double d = height, v = -v0;
  for (int n = 0; n < 100000; ++n) {
    double D = dt * v;
    if (d + D < 0) D = (2 * m / dt * v - k * d) / (2 * m / (dt * dt) + k);
    v = 2 / dt * D - v;
    d += D;
    if (d > 0 && v > 0) break;
  }
  return v / v0;
}

struct Bounce {
  double restitution;
  double ledger_defect;  // worst over the steps, relative to the kinetic energy before
  double dissipated;     // relative to the kinetic energy before
};

Bounce bounce(double height, double v0, double k_total, double dt) {
  Scene s(0.5, k_total / 4, k_total / 10);
  s.model.gravity.setZero();
  s.planes.push_back({});
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 0.5 + height), Quat::Identity(), 2500,
            1e15);  // rigid beside the springs
  s.state.v[0].z() = -v0;
  const Shi1988 method;
  const double start = 0.5 * 2500 * v0 * v0;
  double total = start, defect = 0;
  for (int n = 0; n < 100000; ++n) {
    const Shi1988Report r = s.step(method, dt);
    EXPECT_TRUE(r.settled());
    total -= Scene::dissipated(r);
    defect = std::max(defect, std::abs(total - Scene::total(r)) / start);
    if (r.closed == 0 && s.state.v[0].z() > 0) break;
  }
  return {s.state.v[0].z() / v0, defect, 1 - total / start};
}

}  // namespace

struct Slide {
  double way;
  double friction_work;
  int unsettled;
  double ledger_defect;  // relative to the potential energy turned over
};

Slide slide(Scene s, double duration, double dt, const Shi1988Settings& settings = {}) {
  const Vec3 start = s.state.c[0], down = s.state.q[0] * Vec3::UnitX();
  const double weight = s.model.blocks[0].mass * 9.81;
  double total = weight * start.z();
  Slide out{0, 0, 0, 0};
  const Shi1988 method(settings);
  const long n = std::lround(duration / dt);
  for (long k = 0; k < n; ++k) {
    const Shi1988Report r = s.step(method, dt);
    total -= Scene::dissipated(r);
    out.friction_work += r.friction_work;
    out.unsettled += r.unsettled;
    out.ledger_defect = std::max(out.ledger_defect, std::abs(total - Scene::total(r)) / weight);
  }
  out.way = down.dot(s.state.c[0] - start);
  return out;
}

TEST(Contact1988, InclineSlidesToATenthOfAPercent) {  // A1, with the springs of the paper's Table 4
  const double angle = 35 * M_PI / 180, mu = std::tan(28 * M_PI / 180), g = 9.81, t = 3.84;
  const double expected = 0.5 * g * (std::sin(angle) - mu * std::cos(angle)) * t * t;
  for (const double dt : {1e-3, 2.5e-4}) {
    const Slide s = slide(incline(angle, mu, 30e9, 3.5e9), t, dt);
    std::printf("incline, dt %.2e: %.6f of %.6f m, error %.4f %%\n", dt, s.way, expected,
                100 * (s.way / expected - 1));
    EXPECT_NEAR(s.way, expected, 1e-3 * expected);
    EXPECT_EQ(s.unsettled, 0);
    EXPECT_LT(s.ledger_defect, 1e-9);
    const double work = mu * 2500 * g * std::cos(angle) * s.way;
    EXPECT_NEAR(s.friction_work, work, 1e-3 * work);
  }
}

TEST(Contact1988, SoftSpringsMissTheInclineByTheirStart) {
  // The block falls on its springs first: what it gains before friction bites stays with it.
  const double angle = 35 * M_PI / 180, mu = std::tan(28 * M_PI / 180), t = 3.84;
  const double expected = 0.5 * 9.81 * (std::sin(angle) - mu * std::cos(angle)) * t * t;
  const double error = slide(incline(angle, mu, 1e8, 4e7), t, 1e-3).way / expected - 1;
  std::printf("incline, 0.1 GN/m: error %.4f %%\n", 100 * error);
  EXPECT_GT(error, 2e-3);
  EXPECT_LT(error, 2e-2);
}

TEST(Contact1988, MovingSurfaceCarriesTheBlock) {
  // A skin that rises at constant speed takes the block along; its work closes the ledger.
  TriangleSurface mesh;
  mesh.vertices = {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.velocities.assign(4, Vec3(0.1, 0, 0.2));
  contact::SurfaceIndex index(mesh);
  Scene s(0.8, 1e8, 4e7);
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 0.5));
  s.surfaces.push_back(&index);
  const Shi1988 method;
  const double dt = 1e-3, weight = 2500 * 9.81;
  double total = weight * 0.5, partner = 0;
  for (int k = 0; k < 1000; ++k) {
    const Shi1988Report r = s.step(method, dt);
    for (Vec3& v : mesh.vertices) v += dt * Vec3(0.1, 0, 0.2);
    index.refit(mesh);
    total -= Scene::dissipated(r);
    partner += r.partner_work;
    EXPECT_NEAR(total, Scene::total(r), 1e-9 * weight);
  }
  EXPECT_LT((s.state.v[0] - Vec3(0.1, 0, 0.2)).norm(), 5e-3);
  EXPECT_NEAR(partner, weight * 0.2, 0.05 * weight * 0.2);
}

TEST(Contact1988, SticksBelowAndSlidesAboveTheFrictionAngle) {  // A2
  const double angle = std::atan(0.5);
  const double stuck = slide(incline(angle, 0.55, 30e9, 3.5e9), 2.5, 1e-3).way;
  const double slid = slide(incline(angle, 0.49, 30e9, 3.5e9), 2.5, 1e-3).way;
  const double expected = 0.5 * 9.81 * (std::sin(angle) - 0.49 * std::cos(angle)) * 2.5 * 2.5;
  std::printf("stuck: %.3g m; sliding: %.5f of %.5f m\n", stuck, slid, expected);
  EXPECT_LT(std::abs(stuck), 1e-5);
  EXPECT_NEAR(slid, expected, 0.02 * expected);
}

TEST(Contact1988, SlackRelockingCreeps) {
  // Shi's program lets a contact that stops sliding lock with a slack spring: the block lurches, overshoots,
  // slides and stops again, for ever, at friction up to nearly twice what equilibrium needs.
  Shi1988Settings slack;
  slack.relock_loaded = false;
  const double angle = std::atan(0.5);
  const double creep = slide(incline(angle, 0.55, 30e9, 3.5e9), 2.5, 1e-3, slack).way;
  std::printf("slack relocking: crept %.3g m in 2.5 s\n", creep);
  EXPECT_GT(creep, 1e-3);
}

TEST(Contact1988, TriangulatedSlopeActsAsThePlane) {
  // The same slide over a mesh: no bump at inner edges, history handed over from triangle to triangle.
  const double angle = 35 * M_PI / 180, mu = std::tan(28 * M_PI / 180);
  TriangleSurface mesh;
  const Quat q(Eigen::AngleAxisd(angle, Vec3::UnitY()));
  const int nx = 12, ny = 6;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) mesh.vertices.push_back(q * Vec3(-2 + 0.7 * i, -2.1 + 0.7 * j, 0));
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int a = j * (nx + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + nx + 2});
      mesh.triangles.push_back({a, a + nx + 2, a + nx + 1});
    }
  const contact::SurfaceIndex index(mesh);
  Scene on_plane = incline(angle, mu, 30e9, 3.5e9);
  Scene on_mesh = on_plane;
  on_mesh.planes.clear();
  on_mesh.surfaces.push_back(&index);
  const Slide a = slide(on_plane, 1.5, 1e-3), b = slide(on_mesh, 1.5, 1e-3);
  EXPECT_GT(a.way, 1.4);
  EXPECT_NEAR(a.way, b.way, 1e-6);
  EXPECT_LT(b.ledger_defect, 1e-9);
}

TEST(Contact1988, SlidingStops) {  // A3
  const double mu = 0.4, v = 3, g = 9.81, dt = 1e-4;
  Scene s(mu, 30e9, 3.5e9);
  s.planes.push_back({});
  // In equilibrium on its springs at the start.
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 0.5 - 2500 * g / 120e9));
  s.state.v[0].x() = v;
  const Shi1988 method;
  double stopped = 0;
  for (int k = 0; k < 10000; ++k) {
    s.step(method, dt);
    if (stopped == 0 && s.state.v[0].x() <= 0) stopped = (k + 1) * dt;
  }
  std::printf("sliding stop: %.6f m of %.6f, %.4f s of %.4f\n", s.state.c[0].x(), v * v / (2 * mu * g),
              stopped, v / (mu * g));
  EXPECT_NEAR(s.state.c[0].x(), v * v / (2 * mu * g), 1e-3 * v * v / (2 * mu * g));
  EXPECT_NEAR(stopped, v / (mu * g), 2e-3 * v / (mu * g));
  EXPECT_LT(std::abs(s.state.v[0].x()), 1e-3);
}

TEST(Contact1988, RestitutionIsThatOfItsOwnRecurrence) {
  // e depends on Omega = dt sqrt(k/m) and, for long steps, on where in the step the touch falls.
  const double m = 2500, v = 1, dt = 1e-3;
  for (const double omega : {0.032, 0.1, 0.5, 1.0, 3.0, 6.0, 14.9}) {
    const double k = m * omega * omega / (dt * dt);
    for (const double phase : {0.13, 0.5, 0.87}) {
      const double height = (2 + phase) * v * dt;
      const double expected = scalar_restitution(height, v, k, m, dt);
      const Bounce b = bounce(height, v, k, dt);
      EXPECT_NEAR(b.restitution, expected, 1e-4) << "Omega " << omega << " phase " << phase;
      EXPECT_LT(b.ledger_defect, 1e-9);
      EXPECT_NEAR(b.dissipated, 1 - b.restitution * b.restitution, 1e-3);
      if (omega <= 0.1) { EXPECT_NEAR(b.restitution, std::exp(-M_PI * omega / 4), 0.01); }
      std::printf("Omega %6.3f phase %.2f: e %.5f, recurrence %.5f, exp(-pi Omega/4) %.5f, ledger %.1e\n",
                  omega, phase, b.restitution, expected, std::exp(-M_PI * omega / 4), b.ledger_defect);
    }
  }
}

TEST(Contact1988, RestitutionOfLongStepsIsAnArtefact) {
  // Omega > 4: the same fall gives anything between 0 and 1, by where in the step the touch falls.
  const double m = 2500, v = 1, dt = 1e-3, omega = 14.9, k = m * omega * omega / (dt * dt);
  double least = 1, most = 0;
  for (int i = 0; i < 40; ++i) {
    const double e = bounce((2 + (i + 0.5) / 40) * v * dt, v, k, dt).restitution;
    least = std::min(least, e);
    most = std::max(most, e);
  }
  std::printf("Omega 14.9: e from %.4f to %.4f\n", least, most);
  EXPECT_LT(least, 0.05);
  EXPECT_GT(most, 0.9);
}

TEST(Contact1988, StackCarriesItsWeight) {  // A15
  const int n = 4;
  const double g = 9.81, kn = 1e8;
  Scene s(0.5, kn, kn / 2.5);
  s.planes.push_back({});
  for (int i = 0; i < n; ++i) s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 0.5 + i));
  const Shi1988 method;
  Shi1988Report r{};
  int unsettled = 0;
  for (int k = 0; k < 1500; ++k) {
    r = s.step(method, 2e-3);
    unsettled += r.unsettled;
  }
  std::vector<double> force(static_cast<std::size_t>(n), 0.0);
  for (const auto& c : s.history.contacts)
    force[static_cast<std::size_t>(c.b)] +=
        c.force.dot(c.normal);  // B is the upper block, the normal points up
  for (int i = 0; i < n; ++i) {
    const double carried = (n - i) * 2500 * g;
    EXPECT_NEAR(force[static_cast<std::size_t>(i)], carried, 1e-3 * carried) << "contact " << i;
  }
  std::printf("stack: iterations %d, unsettled %d, kinetic %.2e J\n", r.iterations, unsettled, r.kinetic);
}

TEST(Contact1988, RockingBlockStandsUpInTime) {  // A11, up to the first impact
  const double theta = std::atan(0.25) / 2, kn = 30e9, dt = 1e-3;
  Scene s(5, kn, kn / 2.5);
  s.planes.push_back({});
  const Quat q(Eigen::AngleAxisd(theta, Vec3::UnitY()));
  const Vec3 toe = q * Vec3(0.5, 0, -2);
  s.add_box(Vec3(1, 1, 4), Vec3(-toe.x(), 0, -toe.z() - 2500 * 4 * 9.81 / (2 * kn)), q);
  const Shi1988 method;
  double before = theta, upright = 0;
  for (int k = 0; k < 1000 && upright == 0; ++k) {
    s.step(method, dt);
    const Vec3 axis = s.state.q[0] * Vec3::UnitZ();
    const double angle = std::atan2(axis.x(), axis.z());
    if (angle <= 0) upright = dt * (k + before / (before - angle));
    before = angle;
  }
  std::printf("rocking block upright at %.5f s of 0.69834\n", upright);
  EXPECT_NEAR(upright, 0.69834320390792, 1e-3 * 0.698);
}

TEST(Contact1988, CohesionHoldsUntilBroken) {  // A8
  // Level plane, horizontal body force: holds below c A + N tan(phi), slips above, and then stays weak.
  const double g = 10, m = 2500, mu = 0.5, c = 2e4;
  for (const double factor : {0.95, 1.05}) {
    Scene s(mu, 1e8, 1e8);
    s.law().cohesion = c;
    s.planes.push_back({});
    s.add_box(Vec3(1, 1, 0.1), Vec3(0, 0, 0.05 - m * 0.1 * g / 4e8), Quat::Identity(), m);
    const double weight = 0.1 * m * g, strength = c + mu * weight;
    const Shi1988 method;
    const int ramp = 4000;
    for (int k = 0; k < ramp; ++k) {  // slowly, so that nothing swings
      s.model.gravity = Vec3(factor * strength / (0.1 * m) * (k + 1) / ramp, 0, -g);
      s.step(method, 1e-3);
    }
    std::printf("cohesion, %.2f of the strength: moved %.4g m\n", factor, s.state.c[0].x());
    if (factor < 1) {
      EXPECT_LT(s.state.c[0].x(), 1e-3);
    } else {
      EXPECT_GT(s.state.c[0].x(), 1e-2);
    }
  }
}

TEST(Contact1988, TensionHoldsUntilBroken) {
  // A cube under a held one hangs on its springs, as far down as the springs are stretched, or falls.
  const double g = 9.81, weight = 2500 * g, kn = 1e8;
  for (const double factor : {2.5, 0.95}) {
    Scene s(0.5, kn, kn);
    s.law().tension = s.law().cohesion = factor * weight;
    s.add_box(Vec3(2, 2, 1), Vec3(0, 0, 1));
    s.model.blocks[0].fixed = true;
    s.add_box(Vec3::Ones(), Vec3::Zero());
    s.model.gravity = Vec3(0, 0, -g);
    const Shi1988 method;
    double closed = s.model.blocks[0].mass * g;  // the held one's height
    for (int k = 0; k < 2000; ++k) {
      const auto r = s.step(method, 1e-3);
      closed -= Scene::dissipated(r);
      ASSERT_NEAR(closed, Scene::total(r), 1e-8 * weight) << k;
    }
    if (factor > 1)
      EXPECT_NEAR(s.state.c[1].z(), -weight / (4 * kn), 0.02 * weight / (4 * kn));  // and a little strain
    else
      EXPECT_NEAR(s.state.c[1].z(), -0.5 * g * 4, 0.05);  // 4 ms late: first its springs are drawn
  }
}

TEST(Contact1988, FixedPointsHold) {
  Scene s(0.5, 1e8, 4e7);
  s.add_box(Vec3(1, 1, 1), Vec3::Zero());
  auto& b = s.model.blocks[0];
  for (const Vec3& x : {Vec3(0.5, 0.5, 0.5), Vec3(-0.5, 0.5, 0.5), Vec3(0, -0.5, 0.5)}) {
    b.fixed_points.push_back(x);
    b.fixed_points_world.push_back(x);
  }
  Shi1988Settings settings;
  settings.fixed_point_penalty = 1e8;
  const Shi1988 method(settings);
  double total = 0;
  for (int k = 0; k < 3000; ++k) {
    const auto r = s.step(method, 1e-3);
    total -= Scene::dissipated(r);
    EXPECT_NEAR(total, Scene::total(r), 1e-9 * 2500 * 9.81);
  }
  EXPECT_LT(s.state.c[0].norm(), 1e-3);
  EXPECT_LT(s.state.c[0].z(), -0.5 * 2500 * 9.81 / 3e8);  // hangs on its springs
  EXPECT_LT(s.state.v[0].norm(), 1e-4);
}

TEST(Contact1988, PlanNamesWhatTheMethodCannotDo) {
  Scene s(0.5, 1e8, 4e7);
  s.add_box(Vec3(1, 1, 1), Vec3::Zero());
  const Shi1988 method;
  const std::size_t plain = method.plan(s.model, s.laws).size();
  s.model.blocks[0].young = 0;
  s.law().stiffness = ContactLaw::Stiffness::hard;
  s.law().restitution = 0.3;
  s.law().damping_ratio = 0.1;
  EXPECT_EQ(method.plan(s.model, s.laws).size(), plain + 4);
}

TEST(Contact1988, SavedAndRestoredHistoryGivesTheSameBits) {
  Scene a = incline(0.6, 0.5, 1e8, 4e7);
  const Shi1988 method;
  for (int k = 0; k < 50; ++k) a.step(method, 1e-3);
  std::vector<double> saved;
  a.history.save(saved);
  Scene b = a;
  b.history = {};
  EXPECT_EQ(b.history.restore(saved), saved.size());
  for (int k = 0; k < 50; ++k) {
    a.step(method, 1e-3);
    b.step(method, 1e-3);
  }
  EXPECT_EQ(a.state.c[0], b.state.c[0]);
  EXPECT_EQ(a.state.v[0], b.state.v[0]);
  EXPECT_EQ(a.history.map[0], b.history.map[0]);
}
