#include "ensemble/sobol.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <boost/random/sobol.hpp>

#include "core/error.hpp"
#include "ensemble/random.hpp"

namespace talus::ensemble {
namespace {

constexpr int depth = 32;  // bits of a coordinate that are scrambled one by one; those below are random

}  // namespace

/// Point k = XOR of the directions whose bits are set in the Gray code of k.
struct Sobol::Directions {
  std::vector<std::array<std::uint32_t, depth>> of;  // per dimension, by bit of the Gray code
};

Sobol::Sobol(int dimensions, std::uint32_t seed) : directions_(new Directions), seed_(seed) {
  constexpr int most = 3667;
  if (dimensions > most)
    throw InputError(Problem{.severity = Problem::Severity::error,
                             .file = {},
                             .line = 0,
                             .column = 0,
                             .key = "ensemble.design",
                             .value = "sobol",
                             .rule = fmt::format("{} coordinates are drawn, {} are known", dimensions, most),
                             .remedy = "take design \"random\""});
  directions_->of.resize(static_cast<std::size_t>(std::max(1, dimensions)));
  using Engine = boost::random::sobol_engine<std::uint32_t, depth>;
  for (int b = 0; b < depth; ++b) {
    Engine engine(directions_->of.size());
    // The library numbers points from 1 less: 2^(b+1) - 1 is the point whose Gray code is bit b alone.
    engine.seed(static_cast<std::uint32_t>((std::uint64_t{2} << b) - 2));
    for (auto& of : directions_->of) of[static_cast<std::size_t>(b)] = engine();
  }
}

Sobol::~Sobol() = default;

double Sobol::coordinate(std::uint64_t index, int dimension) const {
  const std::uint64_t point = index / replicates, gray = point ^ (point >> 1);
  std::uint32_t x = 0;
  for (int b = 0; b < depth; ++b)
    if ((gray >> b) & 1)
      x ^= directions_->of[static_cast<std::size_t>(dimension)][static_cast<std::size_t>(b)];
  // Each bit is turned or not by a coin of its own for each value of the bits above it.
  const auto replicate = static_cast<std::uint32_t>(index % replicates),
             d = static_cast<std::uint32_t>(dimension);
  std::uint32_t out = 0;
  for (int b = 0; b < depth; ++b) {
    const std::uint32_t above = b == 0 ? 0 : x >> (depth - b), bit = (x >> (depth - 1 - b)) & 1;
    const std::uint64_t coin =
        bits(seed_, for_scrambling, (static_cast<std::uint64_t>(above) << 8) | static_cast<std::uint64_t>(b),
             d, replicate);
    out = (out << 1) | (bit ^ static_cast<std::uint32_t>(coin & 1));
  }
  const std::uint64_t low =
      bits(seed_, for_scrambling, (static_cast<std::uint64_t>(x) << 8) | 255, d, replicate) >> depth;
  return uniform_of((static_cast<std::uint64_t>(out) << 32) | low);
}

}  // namespace talus::ensemble
