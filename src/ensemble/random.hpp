/// Random numbers by counter: a draw is a function of (seed, member, variable, attempt) and of nothing else,
/// so that members may be made in any order, by any thread, and again after a stop.
///
/// Philox4x32-10 [Salmon et al. 2011].
#pragma once
#include <array>
#include <cstdint>

namespace talus::ensemble {

using Counter = std::array<std::uint32_t, 4>;

/// Ten rounds of Philox4x32 with the key (a, b).
inline Counter philox(Counter x, std::uint32_t a, std::uint32_t b) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p = 0xD2511F53ull * x[0], q = 0xCD9E8D57ull * x[2];
    x = {static_cast<std::uint32_t>(q >> 32) ^ x[1] ^ a, static_cast<std::uint32_t>(q),
         static_cast<std::uint32_t>(p >> 32) ^ x[3] ^ b, static_cast<std::uint32_t>(p)};
    a += 0x9E3779B9u;
    b += 0xBB67AE85u;
  }
  return x;
}

/// 64 bits for (seed, purpose; index, variable, attempt).
inline std::uint64_t bits(std::uint32_t seed, std::uint32_t purpose, std::uint64_t index,
                          std::uint32_t variable, std::uint32_t attempt) {
  const Counter x =
      philox({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32), variable, attempt},
             seed, purpose);
  return (static_cast<std::uint64_t>(x[1]) << 32) | x[0];
}

/// In (0, 1).
inline double uniform_of(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

/// Purposes: streams that have nothing to do with each other.
enum Purpose : std::uint32_t {
  for_draws = 1,
  for_places = 2,
  for_seeds = 3,
  for_scrambling = 4,
  for_bootstrap = 5,
  for_clusters = 6,
  for_runs = 7
};

}  // namespace talus::ensemble
