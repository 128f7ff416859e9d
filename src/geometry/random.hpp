/// Random numbers that are the same on every machine and library (SplitMix64 and transforms written out): the
/// standard library leaves its distributions to each implementation.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/types.hpp"

namespace talus::geometry {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 0x2545f4914f6cdd1dull) {}
  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  /// In (0, 1).
  double uniform() { return (static_cast<double>(bits() >> 11) + 0.5) * 0x1p-53; }
  double uniform(double a, double b) { return a + (b - a) * uniform(); }
  double normal() {  // Box-Muller; the second value is dropped to keep the order of calls plain
    const double u = uniform(), v = uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }
  double exponential() { return -std::log(uniform()); }
  Vec3 direction() {
    const double z = uniform(-1, 1), a = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(a), r * std::sin(a), z};
  }
  /// Fisher's distribution on the sphere about `mean` (unit) with concentration kappa > 0.
  Vec3 fisher(const Vec3& mean, double kappa) {
    const double u = uniform(), a = uniform(0, 2 * std::numbers::pi);
    const double c = 1 + std::log(u + (1 - u) * std::exp(-2 * kappa)) / kappa,
                 s = std::sqrt(std::max(0.0, 1 - c * c));
    const Vec3 e = mean.unitOrthogonal(), f = mean.cross(e);
    return (c * mean + s * (std::cos(a) * e + std::sin(a) * f)).normalized();
  }

 private:
  std::uint64_t state_;
};

}  // namespace talus::geometry
