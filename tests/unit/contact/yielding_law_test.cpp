// A crushing law whose pressure grows with depth and whose layer ends: force, work and what is lost agree
// with each other.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/laws/normal_law.hpp"

namespace talus::contact {
namespace {

ContactLaw layer(double gradient, double thickness) {
  ContactLaw law;
  law.kind = ContactLaw::Kind::crushing;
  law.stiffness = ContactLaw::Stiffness::per_area;
  law.normal_stiffness = 50e6;
  law.crushing_pressure = 2e5;
  law.yield_gradient = gradient;
  law.yield_thickness = thickness;
  return law;
}

NormalLaw at_point(const ContactLaw& law, double area, const std::vector<CornerArea::Triangle>& corner = {}) {
  NormalLaw n;
  n.law = &law;
  n.stiffness = law.normal_stiffness * area;
  if (!corner.empty()) n.corner = std::make_shared<const CornerArea>(corner);
  n.limit = law.crushing_pressure * area;
  return n;
}

TEST(YieldingLaw, ForceIsTheSlopeOfTheWorkAndNothingComesBackOfWhatCrushed) {
  using Cell = std::vector<CornerArea::Triangle>;
  const Cell face, tip{{1, {0, 0.04, 0.04}}}, edge{{1, {0, 0, 0.05}}, {1, {0, 0.05, 0.05}}},
      apart{{0.3, {0, 0.01, 0.03}}, {0.7, {0.02, 0.06, 0.2}}};
  for (const Cell& corner : {face, tip, edge, apart})
    for (const double gradient : {0.0, 5e6})
      for (const double thickness : {0.0, 0.05}) {
        const ContactLaw law = layer(gradient, thickness);
        NormalLaw n = at_point(law, 0.2, corner);
        for (const double crushed : {0.0, 0.01, 0.03}) {
          n.crushed = crushed;
          double lost = 0;
          for (double x = crushed + 1e-4; x < 0.12; x += 1.73e-3) {
            const double d = 1e-7, slope = (n.work(x + d) - n.work(x - d)) / (2 * d);
            EXPECT_NEAR(slope, n.force(x), 2e-5 * (1 + n.force(x)))
                << "x " << x << " crushed " << crushed << " gradient " << gradient << " thickness "
                << thickness << " triangles " << corner.size();
            EXPECT_NEAR((n.force(x + d) - n.force(x - d)) / (2 * d), n.slope(x), 1e-3 * n.slope(x) + 1e4);
            EXPECT_GE(n.crushing(x), lost - 1e-6);
            lost = n.crushing(x);
            EXPECT_GE(n.stored(x), 0);
            // Unloaded to where it was crushed to, all that is stored has come back.
            NormalLaw after = n;
            after.crushed = n.crushed_after(x);
            EXPECT_NEAR(after.stored(x), n.stored(x), 1e-9 * (1 + n.stored(x)));
            EXPECT_NEAR(after.force(x), n.force(x), 1e-6 * (1 + n.force(x)));
            EXPECT_NEAR(after.crushing(x), 0, 1e-5 * (1 + lost));
          }
        }
      }
}

TEST(YieldingLaw, ColumnsHardenAndEnd) {
  // One column of unit area: k (s - y) = p + G y, y <= H.
  const double k = 50e6, p = 2e5, G = 5e6, H = 0.05;
  const ContactLaw law = layer(G, H);
  const NormalLaw n = at_point(law, 1);
  for (const double y : {0.0, 0.01, 0.03, 0.0499}) {
    const double s = y + (p + G * y) / k;
    EXPECT_NEAR(n.force(s), p + G * y, 1e-6 * p);
    EXPECT_NEAR(n.crushed_after(s), y, 1e-12);
    EXPECT_NEAR(n.crushing(s), p * y + 0.5 * G * y * y, 1e-8 * p);
  }
  const double end = H + (p + G * H) / k;
  EXPECT_NEAR(n.force(end + 0.01), p + G * H + 0.01 * k, 1e-6 * k);
  EXPECT_NEAR(n.crushed_after(end + 0.01), H, 1e-12);
  EXPECT_NEAR(n.crushing(end + 0.01), p * H + 0.5 * G * H * H, 1e-8 * p);
}

}  // namespace
}  // namespace talus::contact
