#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "core/error.hpp"
#include "drive.hpp"
#include "fem/materials/material_cdpm2.hpp"

namespace talus::material {
namespace {

using test::scaled;
using test::strain_of;

/// f_c 30 MPa, f_t 3 MPa: the concrete of the reference values.
Cdpm2::Parameters reference(double cell = 0.1) {
  Cdpm2::Parameters p;
  ConcreteInput in;
  in.f_cm = 30e6;
  in.f_t = 3e6;
  p.concrete = mc2010(in);
  p.cell = CellFrame::cube(cell);
  p.rate_effect = false;
  return p;
}

/// Scale at which start + x direction reaches the surface with q_h1 = q_h2 = 1.
double reach(const Cdpm2& law, const Sym& start, const Sym& direction, double top) {
  double low = 0, high = top;
  for (int i = 0; i < 100; ++i) {
    const double x = 0.5 * (low + high);
    Sym s = start;
    for (int k = 0; k < 6; ++k) s[k] += x * direction[k];
    (law.yield(s, 1, 1) < 0 ? low : high) = x;
  }
  return low;
}

TEST(Cdpm2, SurfaceParametersAndUniaxialStrengths) {
  const Cdpm2 law(reference());
  EXPECT_NEAR(law.eccentricity(), 0.5229, 1e-4);
  EXPECT_NEAR(law.friction(), 10.198, 1e-3);
  EXPECT_NEAR(reach(law, {}, {-1, 0, 0, 0, 0, 0}, 1e9), 30e6, 1);
  EXPECT_NEAR(reach(law, {}, {0, 1, 0, 0, 0, 0}, 1e8), 3e6, 30e3);
}

TEST(Cdpm2, BiaxialAndConfinedReferenceValues) {
  const Cdpm2 law(reference());
  EXPECT_NEAR(reach(law, {}, {-1, -0.25, 0, 0, 0, 0}, 1e9) / 30e6, 1.203, 1e-3);
  EXPECT_NEAR(reach(law, {}, {-1, -0.5, 0, 0, 0, 0}, 1e9) / 30e6, 1.303, 1e-3);
  EXPECT_NEAR(reach(law, {}, {-1, -1, 0, 0, 0, 0}, 1e9) / 30e6, 1.160, 1e-3);
  EXPECT_NEAR(reach(law, {}, {-1, 0.1, 0, 0, 0, 0}, 1e9) / 30e6, 0.620, 1e-3);
  const double pressure[5] = {1, 3, 5, 10, 30}, peak[5] = {35.7, 45.6, 54.3, 72.9, 130.4};
  for (int i = 0; i < 5; ++i) {
    const double p = pressure[i] * 1e6;
    EXPECT_NEAR((p + reach(law, {-p, -p, -p, 0, 0, 0}, {-1, 0, 0, 0, 0, 0}, 1e9)) / 1e6, peak[i], 0.06)
        << pressure[i];
  }
}

/// Drives the axial strain with the lateral stress held at -p; returns the axial stress (tension positive).
struct Triaxial {
  const Cdpm2& law;
  double pressure;
  Cdpm2::State state{};
  double lateral = 0;
  Response last{};
  double step(double axial) {
    const auto at = [&](double e, Cdpm2::State& out) {
      return law({axial, e, e, 0, 0, 0}, Sym{}, state, out);
    };
    Cdpm2::State out;
    double a = lateral, b = lateral + 1e-9;
    Response ra = at(a, out);
    double fa = ra.stress[1] + pressure;
    for (int i = 0; i < 60; ++i) {
      const Response rb = at(b, out);
      const double fb = rb.stress[1] + pressure;
      if (std::abs(fb) < 10) break;
      const double slope = (fb - fa) / (b - a);
      const double move = std::clamp(-fb / (slope > 1e8 ? slope : 1e10), -2e-4, 2e-4);
      a = b;
      fa = fb;
      b += move;
      if (a == b) break;
    }
    last = at(b, out);
    state = out;
    lateral = b;
    return last.stress[0];
  }
};

/// Damage in tension grows in compression, too, where nothing is cracked: a cell that leans is pressed as
/// another.
TEST(Cdpm2, CellsThatLeanArePressedAsOthers) {
  const Cdpm2 law(reference());
  Triaxial free{law, 0};
  Mat3 edges = 0.1 * Mat3::Identity();
  edges(2, 0) = 0.08;
  const CellFrame leaning = CellFrame::of(edges);
  ASSERT_TRUE(leaning.leans);
  Cdpm2::State cell[8]{};
  for (int i = 1; i <= 600; ++i) {
    const double pressed = free.step(-1e-5 * i);
    double strain[6][8]{}, stress[6][8];
    for (int q = 0; q < 8; ++q) strain[0][q] = -1e-5 * i, strain[1][q] = strain[2][q] = free.lateral;
    law.stress8(&strain[0][0], nullptr, leaning, cell, cell, &stress[0][0], nullptr, nullptr);
    ASSERT_NEAR(stress[0][0] / pressed, 1, 1e-5) << i;
    ASSERT_NEAR(stress[2][0], 0, 1e3) << i;
  }
  EXPECT_GT(cell[0].w_t, 0.1);
}

TEST(Cdpm2, SimulatedUniaxialCompressionAndConfinement) {
  const Cdpm2 law(reference());
  for (const auto& [pressure, expected] : {std::pair{0.0, 30e6}, {3e6, 45.6e6}, {10e6, 72.9e6}}) {
    Triaxial test{law, pressure};
    const double nu = law.parameters().concrete.poisson, e = law.parameters().concrete.young;
    const double hydrostatic = -pressure * (1 - 2 * nu) / e;
    test.lateral = hydrostatic;
    test.state = {};
    double peak = 0, at_peak = 0, end = 0;
    for (int i = 0; i <= 1200; ++i) {
      const double axial = hydrostatic - (pressure > 5e6 ? 5e-2 : 1e-2) * i / 1200;
      end = -test.step(axial);
      ASSERT_TRUE(std::isfinite(end));
      if (end > peak) {
        peak = end;
        at_peak = -axial;
      }
    }
    EXPECT_NEAR(peak / expected, 1.0, 0.06)
        << pressure;  // hardening beyond the reference surface lifts it, damage before the peak lowers it
    EXPECT_EQ(test.state.fallbacks, 0);
    if (pressure == 0) {
      EXPECT_GT(at_peak, 1e-3);
      EXPECT_LT(at_peak, 4e-3);
      EXPECT_LT(end, 0.6 * peak);  // softens
    }
  }
}

TEST(Cdpm2, UniaxialTensionPeaksAtTheStrengthAndDissipatesTheFractureEnergy) {
  for (const double h : {0.05, 0.1, 0.2}) {
    const Cdpm2 law(reference(h));
    const Concrete& c = law.parameters().concrete;
    Triaxial test{law, 0};
    double peak = 0, work = 0, before = 0, eps = 0;
    const int steps = 800;
    const double end = 15 * c.fracture_energy / (c.f_t * h);
    for (int i = 1; i <= steps; ++i) {
      const double next = end * std::pow(double(i) / steps, 3);
      const double s = test.step(next);
      peak = std::max(peak, s);
      work += 0.5 * (s + before) * (next - eps);
      before = s;
      eps = next;
    }
    EXPECT_NEAR(peak / c.f_t, 1, 0.02);
    EXPECT_NEAR(h * (work - test.last.energy) / c.fracture_energy, 1, 0.04)
        << h;  // 3 % at 0.2 m: hardening before the peak is per volume
    EXPECT_GT(test.state.w_t, 0.99);
  }
}

TEST(Cdpm2, CrackClosesAndCompressionIsNotWeakened) {
  const Cdpm2 law(reference());
  Triaxial test{law, 0};
  for (int i = 1; i <= 300; ++i) test.step(1e-3 * i / 300);
  EXPECT_GT(test.state.w_t, 0.9);
  double peak = 0;
  for (int i = 1; i <= 1500; ++i) peak = std::min(peak, test.step(1e-3 - 8e-3 * i / 1500));
  EXPECT_NEAR(-peak / 30e6, 1, 0.08);
}

TEST(Cdpm2, LargeAndRandomStepsStayOnOrInsideTheSurface) {
  Cdpm2::Parameters p = reference();
  p.damage = false;
  const Cdpm2 law(p);
  std::mt19937 generator(9);
  std::normal_distribution<double> u(0, 1);
  int scaled_back = 0, calls = 0;
  for (int path = 0; path < 200; ++path) {
    Cdpm2::State state;
    Sym e{};
    const double size = std::pow(10.0, -5 + 3.0 * (path % 20) / 20);
    for (int i = 0; i < 20; ++i) {
      for (double& x : e) x += size * u(generator);
      const Response r = law(e, Sym{}, state, state);
      ++calls;
      for (const double x : r.stress) ASSERT_TRUE(std::isfinite(x));
      const double k = state.kappa, k1 = std::min(k, 1.0);
      const double q1 = k >= 1 ? 1
                               : 0.3 + 0.7 * (k1 * k1 * k1 - 3 * k1 * k1 + 3 * k1) -
                                     0.01 * (k1 * k1 * k1 - 3 * k1 * k1 + 2 * k1);
      ASSERT_LE(law.yield(r.stress, q1, k < 1 ? 1 : 1 + 0.01 * (k - 1)), 1e-6);
    }
    scaled_back += state.fallbacks > 0;
  }
  EXPECT_EQ(scaled_back, 0) << "of 200 paths, " << calls << " calls";
}

TEST(Cdpm2, ElasticBoundIsSafe) {
  const Cdpm2 law(reference());
  const Concrete& c = law.parameters().concrete;
  const double lambda = c.young * c.poisson / ((1 + c.poisson) * (1 - 2 * c.poisson)),
               mu = c.young / (2 * (1 + c.poisson));
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < 5000; ++i) {
    Sym e;
    for (double& x : e) x = u(generator);
    const double twice = contract(hooke(lambda, mu, e), e);
    Cdpm2::State state;
    law(scaled(e, std::sqrt(law.elastic_bound() / twice)), Sym{}, state, state);
    ASSERT_EQ(state.kappa, 0);
  }
  EXPECT_GT(law.elastic_bound(), 0);
}

TEST(Cdpm2, RateRaisesBothStrengths) {
  Cdpm2::Parameters p = reference();
  p.rate_effect = true;
  const Cdpm2 law(p);
  const Concrete& c = p.concrete;
  Cdpm2::State state;
  double best = 0;
  for (int i = 1; i <= 2000; ++i)
    best = std::max(best, law(strain_of({c.young * i * 1e-7, 0, 0, 0, 0, 0}, c.young, c.poisson),
                              {10, -2, -2, 0, 0, 0}, state, state)
                              .stress[0]);
  EXPECT_NEAR(best / c.f_t, 1.337, 0.05);
}

}  // namespace
}  // namespace talus::material
