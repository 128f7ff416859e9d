#include <gtest/gtest.h>

#include <set>

#include "contact/narrow/narrow_axes.hpp"
#include "core/turn.hpp"
#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

std::vector<ContactPoint> contacts(const Polyhedron& a, const Pose& pa, const Polyhedron& b, const Pose& pb,
                                   double margin) {
  std::vector<ContactPoint> out;
  const int n = block_block(a, pa, b, pb, margin, out);
  EXPECT_EQ(n, static_cast<int>(out.size()));
  std::set<FeatureKey> keys;
  for (const auto& c : out) {
    EXPECT_NEAR(c.normal.norm(), 1.0, 1e-12);
    EXPECT_NEAR(c.gap, c.normal.dot(c.point_b - c.point_a), 1e-9);
    EXPECT_LE(c.gap, margin + 1e-12);
    EXPECT_TRUE(keys.insert(c.key).second) << "a key appears twice";
  }
  return out;
}

Vec3 pressure_centre(const std::vector<ContactPoint>& c) {
  Vec3 m = Vec3::Zero();
  for (const auto& p : c) m += p.area * p.point_b;
  return m / total_area(c);
}

double least_gap(const std::vector<ContactPoint>& c) {
  double g = 1e300;
  for (const auto& p : c) g = std::min(g, p.gap);
  return g;
}

constexpr double tiny = 1e-12;

/// Calls f for all 27 offsets of +-1e-12 and 0.
template <class F>
void for_offsets(F f) {
  for (const double x : {-tiny, 0.0, tiny})
    for (const double y : {-tiny, 0.0, tiny})
      for (const double z : {-tiny, 0.0, tiny}) f(Vec3(x, y, z));
}

TEST(ConvexContact, FaceOnFaceAligned) {
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(0, 0, 1) + d}, 1e-3);
    ASSERT_EQ(c.size(), 4u);
    EXPECT_NEAR(total_area(c), 1.0, 1e-11);
    for (const auto& p : c) {
      EXPECT_NEAR((p.normal - Vec3::UnitZ()).norm(), 0, 1e-15);
      EXPECT_NEAR(p.gap, d.z(), 1e-15);
      EXPECT_NEAR(p.area, 0.25, 1e-11);
    }
  });
}

TEST(ConvexContact, KeysDoNotDependOnRoundOff) {
  std::set<std::vector<FeatureKey>> seen;
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(0, 0, 1) + d}, 1e-3);
    std::vector<FeatureKey> k;
    for (const auto& p : c) k.push_back(p.key);
    std::sort(k.begin(), k.end());
    seen.insert(k);
  });
  EXPECT_EQ(seen.size(), 1u);
}

TEST(ConvexContact, FaceOnFaceOverhangingKeepsAreaAndCentroid) {
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(0.3, -0.2, 1) + d}, 1e-3);
    ASSERT_EQ(c.size(), 4u);
    EXPECT_NEAR(total_area(c), 0.7 * 0.8, 1e-11);
    EXPECT_NEAR((pressure_centre(c) - Vec3(0.15, -0.1, 0.5)).norm(), 0, 1e-11);
  });
}

TEST(ConvexContact, TurnedFacesClipToAnOctagon) {
  const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(0, 0, 1), turn(Vec3::UnitZ(), M_PI / 4)}, 1e-3);
  ASSERT_EQ(c.size(), 8u);
  EXPECT_NEAR(total_area(c), 2 * std::sqrt(2.0) - 2, 1e-12);
}

TEST(ConvexContact, ManySidedFacesAreThinnedToEightWithTheFullArea) {
  std::vector<std::pair<double, double>> outline;
  Triangles cap;
  const int n = 24;
  for (int i = 0; i < n; ++i) outline.emplace_back(std::cos(2 * M_PI * i / n), std::sin(2 * M_PI * i / n));
  for (int i = 1; i + 1 < n; ++i) cap.push_back({0, i, i + 1});
  const auto p = prism(outline, cap, -0.5, 0.5);
  ASSERT_TRUE(p.convex);
  const auto c = contacts(p, {Vec3::Zero()}, p, {Vec3(0, 0, 1)}, 1e-3);
  EXPECT_EQ(c.size(), 8u);
  EXPECT_NEAR(total_area(c), 0.5 * n * std::sin(2 * M_PI / n), 1e-12);
}

TEST(ConvexContact, CrossLaidBeams) {
  const auto along = box(10, 1, 1), across = box(1, 10, 1);
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(along, {Vec3::Zero()}, across, {Vec3(2, 0, 1) + d}, 1e-3);
    ASSERT_EQ(c.size(), 4u);
    EXPECT_NEAR(total_area(c), 1.0, 1e-10);
    EXPECT_NEAR((pressure_centre(c) - Vec3(2, 0, 0.5)).norm(), 0, 1e-10);
  });
}

TEST(ConvexContact, EdgeOnFaceGivesTwoPoints) {
  const auto slab = box(10, 10, 1);
  for (const double lift : {0.0, 1e-4}) {
    for_offsets([&](const Vec3& d) {
      const auto c =
          contacts(slab, {Vec3::Zero()}, cube,
                   {Vec3(0.1, 0.2, 0.5 + std::sqrt(0.5) + lift) + d, turn(Vec3::UnitX(), M_PI / 4)}, 1e-3);
      ASSERT_EQ(c.size(), 2u);
      EXPECT_EQ(total_area(c), 0.0);
      for (const auto& p : c) {
        EXPECT_NEAR(p.normal.z(), 1, 1e-15);
        EXPECT_NEAR(p.gap, lift + d.z(), 1e-14);
        EXPECT_NEAR(std::abs(p.point_b.x() - 0.1), 0.5, 1e-11);
      }
    });
  }
}

TEST(ConvexContact, VertexOnFace) {
  const auto slab = box(10, 10, 1);
  const Mat3 R = turn_between(Vec3(1, 1, 1).normalized(), Vec3::UnitZ()).toRotationMatrix();
  for (const double lift : {-1e-5, 0.0, 1e-4}) {
    for_offsets([&](const Vec3& d) {
      const auto c =
          contacts(slab, {Vec3::Zero()}, cube, {Vec3(0, 0, 0.5 + std::sqrt(0.75) + lift) + d, R}, 1e-3);
      ASSERT_EQ(c.size(), 1u);
      EXPECT_NEAR(c[0].normal.z(), 1, 1e-15);
      EXPECT_NEAR(c[0].gap, lift + d.z(), 1e-14);
      const auto swapped =
          contacts(cube, {Vec3(0, 0, 0.5 + std::sqrt(0.75) + lift) + d, R}, slab, {Vec3::Zero()}, 1e-3);
      ASSERT_EQ(swapped.size(), 1u);
      EXPECT_NEAR(swapped[0].normal.z(), -1, 1e-15);
      EXPECT_NEAR(swapped[0].gap, c[0].gap, 1e-14);
    });
  }
}

TEST(ConvexContact, CrossingEdges) {
  const Mat3 rx = turn(Vec3::UnitX(), M_PI / 4), ry = turn(Vec3::UnitY(), M_PI / 4);
  for (const double lift : {-1e-4, 0.0, 1e-3}) {
    for_offsets([&](const Vec3& d) {
      const auto c =
          contacts(cube, {Vec3::Zero(), rx}, cube, {Vec3(0, 0, std::sqrt(2.0) + lift) + d, ry}, 1e-2);
      ASSERT_EQ(c.size(), 1u);
      EXPECT_NEAR((c[0].normal - Vec3::UnitZ()).norm(), 0, 1e-9);
      EXPECT_NEAR(c[0].gap, lift + d.z(), 1e-14);
      EXPECT_NEAR((c[0].point_a - Vec3(0, 0, std::sqrt(0.5))).norm(), 0, 1e-10);
    });
  }
}

TEST(ConvexContact, TetrahedraTurnedAlikeMeetWithTheNearEdges) {
  // Upper and lower edge of each are at right angles, so that both pairs of directions have the normal z.
  const Polyhedron tetrahedron = hull({Vec3(1, 1, 1), Vec3(-1, -1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1)});
  for (const double lift : {-1e-6, 0.0, 1e-3}) {
    const auto c = contacts(tetrahedron, {Vec3::Zero(), Mat3::Identity()}, tetrahedron,
                            {Vec3(0.1, 0.2, 2 + lift), Mat3::Identity()}, 1e-2);
    ASSERT_EQ(c.size(), 1u);
    EXPECT_NEAR(c[0].gap, lift, 1e-14);
    EXPECT_NEAR((c[0].normal - Vec3::UnitZ()).norm(), 0, 1e-12);
    EXPECT_NEAR(c[0].point_a.z(), 1, 1e-12);
  }
}

TEST(ConvexContact, ParallelEdgesSeparatedDiagonally) {
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(1.01, 0.25, 1.01) + d}, 0.1);
    ASSERT_EQ(c.size(), 2u);
    for (const auto& p : c) {
      EXPECT_NEAR(p.gap, 0.01 * std::sqrt(2.0), 1e-11);
      EXPECT_NEAR((p.normal - Vec3(1, 0, 1).normalized()).norm(), 0, 1e-9);
    }
    EXPECT_NEAR(std::abs(c[0].point_a.y() - c[1].point_a.y()), 0.75, 1e-9);
  });
}

TEST(ConvexContact, VerticesSeparatedDiagonally) {
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(1.01, 1.01, 1.01) + d}, 0.1);
    ASSERT_EQ(c.size(), 1u);
    EXPECT_NEAR(c[0].gap, 0.01 * std::sqrt(3.0), 1e-11);
    EXPECT_NEAR((c[0].normal - Vec3(1, 1, 1).normalized()).norm(), 0, 1e-9);
  });
}

TEST(ConvexContact, VertexBesideEdge) {
  // A cube standing on a vertex, beside the upper edge of another.
  const Mat3 R = turn_between(Vec3(1, 1, 1).normalized(), Vec3(1, 0, 1).normalized()).toRotationMatrix();
  const Vec3 direction = Vec3(1, 0, 1).normalized();
  const Vec3 centre = Vec3(0.5, 0.1, 0.5) + direction * (std::sqrt(0.75) + 0.02);
  const auto c = contacts(cube, {Vec3::Zero()}, cube, {centre, R}, 0.1);
  ASSERT_EQ(c.size(), 1u);
  EXPECT_NEAR(c[0].gap, 0.02, 1e-12);
  EXPECT_NEAR((c[0].normal - direction).norm(), 0, 1e-9);
  EXPECT_NEAR((c[0].point_a - Vec3(0.5, 0.1, 0.5)).norm(), 0, 1e-9);
}

TEST(ConvexContact, TouchingAlongAnEdgeTakesAFaceNormal) {
  for_offsets([&](const Vec3& d) {
    const auto c = contacts(cube, {Vec3::Zero()}, cube, {Vec3(1, 0, 1) + d}, 0.1);
    ASSERT_GE(c.size(), 1u);
    for (const auto& p : c) {
      EXPECT_NEAR(p.normal.cwiseAbs().maxCoeff(), 1, 1e-12);
      EXPECT_NEAR(p.gap, 0, 3e-12);
    }
  });
}

TEST(ConvexContact, ReversedOrderMirrorsTheContacts) {
  std::mt19937 rng(8);
  std::uniform_real_distribution<double> u(-0.9, 0.9);
  for (int i = 0; i < 300; ++i) {
    const Pose pa{Vec3::Zero(), random_rotation(rng)},
        pb{Vec3(u(rng), u(rng), u(rng)).normalized() * 1.3, random_rotation(rng)};
    const auto c = contacts(cube, pa, cube, pb, 0.2), r = contacts(cube, pb, cube, pa, 0.2);
    ASSERT_EQ(c.empty(), r.empty());
    if (c.empty()) continue;
    EXPECT_NEAR(least_gap(c), least_gap(r), 1e-9);
    EXPECT_NEAR((c[0].normal + r[0].normal).norm(), 0, 1e-6);
  }
}

TEST(ConvexContact, FarFromTheOriginTheSame) {
  const Vec3 far(1e6, -2e6, 5e5);
  const auto c = contacts(cube, {far}, cube, {far + Vec3(0.25, 0, 1)}, 1e-3);
  ASSERT_EQ(c.size(), 4u);
  EXPECT_NEAR(total_area(c), 0.75, 1e-9);
}

TEST(ConvexContact, ScalesWithTheUnitOfLength) {
  for (const double k : {1e-6, 1e6}) {
    const auto small = box(k, k, k);
    const auto c = contacts(small, {Vec3::Zero()}, small, {Vec3(0.25 * k, 0, 1.0001 * k)}, 1e-3 * k);
    ASSERT_EQ(c.size(), 4u);
    EXPECT_NEAR(total_area(c) / (k * k), 0.75, 1e-9);
    EXPECT_NEAR(c[0].gap / k, 1e-4, 1e-12);
  }
}

// ---- brute force ----

double point_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a).normalized();
  if ((b - a).cross(x - a).dot(n) >= 0 && (c - b).cross(x - b).dot(n) >= 0 &&
      (a - c).cross(x - c).dot(n) >= 0)
    return std::abs(n.dot(x - a));
  double d = 1e300;
  const auto side = [&](const Vec3& p, const Vec3& q) {
    const double t = std::clamp((x - p).dot(q - p) / (q - p).squaredNorm(), 0.0, 1.0);
    d = std::min(d, (x - p - t * (q - p)).norm());
  };
  side(a, b), side(b, c), side(c, a);
  return d;
}

double line_gap(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Minimum over both parameters by nested ternary search would do; here the interior stationary point or
  // nothing.
  const Vec3 u = b - a, v = d - c, w = a - c;
  Eigen::Matrix2d m;
  m << u.dot(u), -u.dot(v), -u.dot(v), v.dot(v);
  if (m.determinant() < 1e-14 * u.squaredNorm() * v.squaredNorm()) return 1e300;
  const Eigen::Vector2d st = m.inverse() * Eigen::Vector2d(-u.dot(w), v.dot(w));
  if (st.minCoeff() < 0 || st.maxCoeff() > 1) return 1e300;
  return (w + st[0] * u - st[1] * v).norm();
}

/// Distance of separated hulls, exhaustively; signed separation over all face and edge axes otherwise.
double brute_gap(const Polyhedron& A, const Pose& pa, const Polyhedron& B, const Pose& pb) {
  std::vector<Vec3> a, b;
  for (const auto& x : A.vertices) a.push_back(pa.world(x));
  for (const auto& x : B.vertices) b.push_back(pb.world(x));
  const auto separation = [&](const Vec3& n) {
    double hi = -1e300, lo = 1e300;
    for (const auto& x : a) hi = std::max(hi, n.dot(x));
    for (const auto& x : b) lo = std::min(lo, n.dot(x));
    return lo - hi;
  };
  double best = -1e300;
  for (const auto& n : A.face_normals) best = std::max(best, separation(pa.F * n));
  for (const auto& n : B.face_normals) best = std::max(best, separation(-(pb.F * n)));
  for (const auto& e : A.edges)
    for (const auto& f : B.edges) {
      const Vec3 n = (a[e.v1] - a[e.v0]).cross(b[f.v1] - b[f.v0]);
      if (n.norm() < 1e-9) continue;
      best = std::max({best, separation(n.normalized()), separation(-n.normalized())});
    }
  if (best <= 0) return best;
  double d = 1e300;
  for (const auto& x : a)
    for (const auto& t : B.triangles) d = std::min(d, point_triangle(x, b[t[0]], b[t[1]], b[t[2]]));
  for (const auto& x : b)
    for (const auto& t : A.triangles) d = std::min(d, point_triangle(x, a[t[0]], a[t[1]], a[t[2]]));
  for (const auto& e : A.edges)
    for (const auto& f : B.edges) d = std::min(d, line_gap(a[e.v0], a[e.v1], b[f.v0], b[f.v1]));
  return d;
}

/// Regular pentagonal prism, its centre at the origin.
Polyhedron pentagon() {
  std::vector<std::pair<double, double>> outline;
  for (int k = 0; k < 5; ++k) outline.emplace_back(std::cos(0.4 * M_PI * k), std::sin(0.4 * M_PI * k));
  return prism(outline, {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}, -0.5, 0.5);
}

TEST(ConvexContact, FacesApartWhoseRimsAreNearestHaveAllTheirCorners) {
  // Turned by 36 degrees each has its corners beyond the other's face: the closest points lie on the rims,
  // wherever the upper one leans to.
  const Polyhedron p = pentagon();
  for (const double lean : {1e-9, 1e-8, 1e-7, 1e-5, 1e-3})
    for (int k = 0; k < 7; ++k) {
      const Vec3 about(std::cos(0.9 * k), std::sin(0.9 * k), 0);
      const Mat3 turned =
          (Eigen::AngleAxisd(lean, about) * Eigen::AngleAxisd(0.2 * M_PI, Vec3::UnitZ())).toRotationMatrix();
      const auto c = contacts(p, {Vec3::Zero()}, p, {Vec3(0, 0, 1 + 1.5 * lean), turned}, 1e-2);
      EXPECT_GE(c.size(), 8u) << lean << " " << k;
      EXPECT_GT(least_gap(c), 0) << lean << " " << k;
      EXPECT_GT(total_area(c), 1.5) << lean << " " << k;
      // No corner of what they share is far from a point that was found.
      for (int corner = 0; corner < 10; ++corner) {
        const double angle = 0.2 * M_PI * corner + 0.1 * M_PI,
                     rim = std::cos(0.2 * M_PI) / std::cos(0.1 * M_PI);
        double nearest = 1;
        for (const auto& q : c)
          nearest = std::min(
              nearest,
              (q.point_a.head<2>() - rim * Eigen::Vector2d(std::cos(angle), std::sin(angle))).norm());
        EXPECT_LE(nearest, 0.6) << lean << " " << k << " " << corner;
      }
    }
}

void compare_with_brute_force(const std::vector<Polyhedron>& shapes, int pairs, double lo, double hi) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> u(lo, hi);
  int near = 0, overlapping = 0;
  for (int i = 0; i < pairs; ++i) {
    const auto &A = shapes[rng() % shapes.size()], &B = shapes[rng() % shapes.size()];
    const Pose pa{Vec3(3, 4, 5), random_rotation(rng)};
    const Pose pb{pa.c + u(rng) * (random_rotation(rng) * Vec3::UnitX()), random_rotation(rng)};
    const double margin = 0.15, exact = brute_gap(A, pa, B, pb);
    const auto c = contacts(A, pa, B, pb, margin);
    if (exact > margin) {
      EXPECT_TRUE(c.empty()) << i;
      continue;
    }
    ASSERT_FALSE(c.empty()) << i << " gap " << exact;
    ++near;
    overlapping += exact < 0;
    if (exact > 1e-6)
      EXPECT_NEAR(least_gap(c), exact, 1e-9) << i;
    else  // deep overlap: a face is preferred within two per cent
      EXPECT_NEAR(least_gap(c), exact, 1e-9 + 0.03 * std::abs(exact)) << i;
  }
  EXPECT_GT(near, pairs / 20);
  EXPECT_GT(overlapping, pairs / 50);
}

TEST(ConvexContact, RandomBoxesAgreeWithBruteForce) {
  compare_with_brute_force({cube, box(1, 2, 0.3), box(0.5, 0.5, 0.5)}, 4000, 0.4, 1.8);
}

TEST(ConvexContact, RandomHullsAgreeWithBruteForce) {
  std::mt19937 rng(2);
  std::vector<Polyhedron> shapes;
  for (int i = 0; i < 4; ++i) shapes.push_back(hull(sphere_points(8 + 6 * i, 1.0, rng)));
  shapes.push_back(hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  compare_with_brute_force(shapes, 600, 1.2, 2.2);
}

/// The contacts are complete: every small rigid motion that keeps all of them open (to first order, plus what
/// second order can take) keeps the bodies apart.
TEST(ConvexContact, OpenContactsKeepTheBodiesApart) {
  std::mt19937 rng(21);
  std::normal_distribution<double> g;
  struct Case {
    Polyhedron a, b;
    Pose pb;
  };
  const std::vector<Case> cases{
      {cube, cube, {Vec3(0.3, 0.1, 1)}},
      {box(10, 1, 1), box(1, 10, 1), {Vec3(0, 0, 1)}},
      {cube, cube, {Vec3(0.2, 0.1, 0.5 + std::sqrt(0.5)), turn(Vec3::UnitX(), M_PI / 4)}},
      {cube, cube, {Vec3(0.7, 0, 0.5 + std::sqrt(0.5)), turn(Vec3::UnitX(), M_PI / 4)}},
      {cube, cube, {Vec3(0, 0, 1), turn(Vec3::UnitZ(), 0.5)}},
      {cube, cube, {Vec3(0.4, 0.4, 1), turn(Vec3::UnitZ(), M_PI / 4)}},
  };
  const double h = 1e-4;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const auto& q = cases[k];
    const auto c = contacts(q.a, {Vec3::Zero()}, q.b, q.pb, 1e-2);
    int kept = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 d = h * Vec3(g(rng), g(rng), 0.3 * g(rng)), w = h * Vec3(g(rng), g(rng), g(rng));
      bool open = true;
      for (const auto& p : c) open = open && p.gap + p.normal.dot(d + w.cross(p.point_b - q.pb.c)) >= 0;
      if (!open) continue;
      ++kept;
      const Pose moved{q.pb.c + d, turn(w, w.norm()) * q.pb.F};
      EXPECT_GT(brute_gap(q.a, {Vec3::Zero()}, q.b, moved), -40 * h * h) << "case " << k;
    }
    EXPECT_GT(kept, 50) << "case " << k;
  }
}

TEST(PlaneContact, CubeLiesOnItsFaceEdgeAndVertex) {
  const Plane plane{Vec3(0, 0, 2), Vec3::UnitZ()};
  std::vector<ContactPoint> c;
  EXPECT_EQ(plane_block(plane, cube, {Vec3(1, 1, 2.5)}, 1e-3, c), 4);
  EXPECT_NEAR(total_area(c), 1, 1e-14);
  c.clear();
  EXPECT_EQ(
      plane_block(plane, cube, {Vec3(1, 1, 2 + std::sqrt(0.5)), turn(Vec3::UnitX(), M_PI / 4)}, 1e-3, c), 2);
  EXPECT_EQ(total_area(c), 0);
  c.clear();
  const Mat3 R = turn_between(Vec3(1, 1, 1).normalized(), Vec3::UnitZ()).toRotationMatrix();
  EXPECT_EQ(plane_block(plane, cube, {Vec3(1, 1, 2 + std::sqrt(0.75)), R}, 1e-3, c), 1);
  EXPECT_NEAR(c[0].gap, 0, 1e-15);
}

TEST(PlaneContact, StretchedBlockPressesOnItsStretchedFace) {
  Mat3 F = Mat3::Identity();
  F(0, 0) = 1.01;
  F(1, 1) = 0.98;
  std::vector<ContactPoint> c;
  plane_block(Plane{}, cube, {Vec3(0, 0, 0.5), turn(Vec3::UnitZ(), 0.3) * F}, 1e-3, c);
  EXPECT_NEAR(total_area(c), 1.01 * 0.98, 1e-13);
}

TEST(PlaneContact, NeedleTouchesWithItsTip) {
  const auto needle = hull({{0, 0, -1}, {1e-4, 0, 1}, {-5e-5, 8e-5, 1}, {-5e-5, -8e-5, 1}});
  std::vector<ContactPoint> c;
  double low = 0;
  for (const auto& x : needle.vertices) low = std::min(low, x.z());
  EXPECT_EQ(plane_block(Plane{}, needle, {Vec3(0, 0, -low + 1e-4)}, 1e-3, c), 1);
  EXPECT_NEAR(c.at(0).gap, 1e-4, 1e-15);
}

/// Boxes, some with corners rounded to 0.1 mm, whose sides are two nearly coplanar triangles, meet on all
/// kinds of nearly flat features: the least gap of their contacts is how far they are apart, or how deep they
/// overlap along the best of all axes.
TEST(ConvexContact, LeastGapIsThatOfThePair) {
  std::mt19937 rng(6);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto rounded = [&] {
    const Vec3 half(1 + 0.5 * u(rng), 1 + 0.5 * u(rng), 0.5 + 0.4 * u(rng));
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k) {
      Vec3 x = half.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
      for (int i = 0; i < 3; ++i) x[i] += 1e-4 * u(rng);
      corners.push_back(x);
    }
    return hull(corners);
  };
  constexpr double margin = 1e-6;
  int off = 0, overlaps = 0, near = 0;
  double worst = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Polyhedron a = trial % 3 == 0 ? box(1.3, 2.1, 0.7) : rounded(),
                     b = trial % 3 == 1 ? box(1.1, 1.9, 0.9) : rounded();
    // Nearly aligned three times out of four, so that edges lie along faces and each other.
    const Mat3 Qa = random_rotation(rng),
               tilt = turn(Vec3(u(rng), u(rng), u(rng)), std::pow(10, -5 + 3 * u(rng))),
               Qb = trial % 4 != 0 ? Mat3(tilt * Qa) : random_rotation(rng);
    const Vec3 aside = Qa * Vec3(1.5 * u(rng), 1.5 * u(rng), 0), way = Qa.col(2);
    narrow::Hull ha, hb;
    ha.set(a, Vec3::Zero(), Qa);
    const auto depth = [&](double s) {  // along the best axis, negative: overlap
      hb.set(b, aside + s * way, Qb);
      return narrow::signed_axis(ha, hb).gap;
    };
    double apart = 8, in = 0;
    while (apart - in > 1e-12) {
      const double s = 0.5 * (apart + in);
      (depth(s) > 0 ? apart : in) = s;
    }
    for (const double s : {1e-7, 1e-8, 1e-10, -1e-10, -1e-9, -1e-8, -1e-7, -1e-6, -1e-5, -1e-4}) {
      std::vector<ContactPoint> points;
      block_block(a, {Vec3::Zero(), Qa}, b, {aside + (apart + s) * way, Qb}, margin, points);
      if (points.empty() && s > 0) break;  // they pass each other; the axes do not tell
      const double least = least_gap(points), right = depth(apart + s);
      ++(right < 0 ? overlaps : near);
      // Apart the axes tell less than the distance, which falls by no more than the motion.
      const double error =
          right < 0 ? std::abs(least - right) : std::max({0.0, right - least, least - s - 1e-9});
      worst = std::max(worst, error);
      off += error > 4e-9 + 1e-4 * std::abs(right);
    }
  }
  EXPECT_GT(overlaps, 20000);
  EXPECT_GT(near, 8000);
  EXPECT_EQ(off, 0) << "of " << overlaps + near << ", the worst by " << worst << " m";
}

}  // namespace
}  // namespace talus::contact::testing
