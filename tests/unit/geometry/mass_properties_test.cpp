#include "geometry/mass_properties.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "geometry/mesh.hpp"
#include "geometry/shape.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {
Mesh box(const Vec3& lo, const Vec3& hi) {
  std::vector<Vec3> p;
  for (int i = 0; i < 8; ++i)
    p.emplace_back(i & 1 ? hi.x() : lo.x(), i & 2 ? hi.y() : lo.y(), i & 4 ? hi.z() : lo.z());
  return convex_hull(p);
}
}  // namespace

TEST(MassProperties, BoxHasItsClosedForm) {
  const Vec3 lo(1, 2, 3), size(4, 5, 5.75);
  const Mesh m = box(lo, lo + size);
  const auto p = mass_properties(m.vertices, m.triangles, 2500);
  const double mass = 2500 * size.prod();
  EXPECT_NEAR(p.mass, mass, 1e-12 * mass);
  EXPECT_NEAR((p.centroid - lo - size / 2).norm(), 0, 1e-13);
  const Mat3 s = (size.array().square() * mass / 12).matrix().asDiagonal();
  EXPECT_NEAR((p.second_moment - s).norm() / s.norm(), 0, 1e-13);
  EXPECT_NEAR(p.inertia()(0, 0), mass / 12 * (25 + 5.75 * 5.75), 1e-12 * mass);
  EXPECT_EQ(p.bounds.min(), lo);
}

TEST(MassProperties, TetrahedronHasItsClosedForm) {
  // Corner tetrahedron of legs a, b, c: V = abc/6, second moment about the centroid m/80 * (3 a^2 ..., -ab
  // ...).
  const double a = 2, b = 3, c = 5;
  const Mesh m = convex_hull({{0, 0, 0}, {a, 0, 0}, {0, b, 0}, {0, 0, c}});
  const auto p = mass_properties(m.vertices, m.triangles, 7);
  const double mass = 7 * a * b * c / 6;
  Mat3 s;
  s << 3 * a * a, -a * b, -a * c, -a * b, 3 * b * b, -b * c, -a * c, -b * c, 3 * c * c;
  s *= mass / 80;
  EXPECT_NEAR(p.mass, mass, 1e-13 * mass);
  EXPECT_NEAR((p.centroid - Vec3(a, b, c) / 4).norm(), 0, 1e-14);
  EXPECT_NEAR((p.second_moment - s).norm() / s.norm(), 0, 1e-13);
}

TEST(MassProperties, FarFromTheOriginNothingIsLost) {
  const Mesh near = box({-0.5, -1, -1.5}, {0.5, 1, 1.5});
  Mesh far = near;
  for (Vec3& v : far.vertices) v += Vec3(1 << 20, 1 << 21, 1 << 19);  // exact in binary
  const auto p = mass_properties(near.vertices, near.triangles, 1),
             q = mass_properties(far.vertices, far.triangles, 1);
  EXPECT_NEAR((p.second_moment - q.second_moment).norm(), 0, 1e-13 * p.second_moment.norm());
  EXPECT_NEAR(p.volume, q.volume, 1e-13);
}

TEST(MassProperties, OpenTurnedAndFlatSurfacesAreNamed) {
  Mesh open = box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  try {
    mass_properties(open.vertices, open.triangles, 1);
    FAIL() << "an open surface has no volume";
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems().size(), 3u);
    EXPECT_EQ(e.problems()[0].key.rfind("mesh edge ", 0), 0u) << e.what();
    EXPECT_FALSE(e.problems()[0].remedy.empty());
  }
  Mesh turned = box({0, 0, 0}, {1, 1, 1});
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_THROW(mass_properties(turned.vertices, turned.triangles, 1), InputError);
  Mesh inside_out = box({0, 0, 0}, {1, 1, 1});
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_THROW(mass_properties(inside_out.vertices, inside_out.triangles, 1), InputError);
  const Mesh good = box({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(mass_properties(good.vertices, good.triangles, 0), InputError);
}
