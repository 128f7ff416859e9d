/// What statistics need of a member.
#pragma once
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "ensemble/member.hpp"
#include "ensemble/statistics.hpp"

namespace talus::ensemble {

inline constexpr std::array<const char*, 3> quantities{"energy", "speed", "height"};

struct Brief {
  Status status = Status::failed;
  struct Largest {
    bool crosses = false;
    std::array<double, 3> of{};  // of each quantity; height NaN if nowhere above ground
  };
  std::vector<Largest> lines;
};

inline Brief brief_of(const Member& m, std::size_t lines) {
  Brief b{m.status, std::vector<Brief::Largest>(lines)};
  for (const Crossing& c : m.crossings) {
    Brief::Largest& l = b.lines[static_cast<std::size_t>(c.line)];
    const std::array<double, 3> here{c.energy(), c.velocity.norm(), c.height};
    for (std::size_t q = 0; q < here.size(); ++q) l.of[q] = l.crosses ? std::fmax(l.of[q], here[q]) : here[q];
    l.crosses = true;
  }
  return b;
}

using Briefs = std::map<std::int64_t, Brief>;

/// Samples of a quantity at a line over the members that have finished.
inline std::vector<Sample> samples_of(const Briefs& briefs, std::size_t line, std::size_t quantity) {
  std::vector<Sample> samples;
  for (const auto& [index, brief] : briefs)
    if (finished(brief.status))
      samples.push_back({index, brief.lines[line].crosses && std::isfinite(brief.lines[line].of[quantity]),
                         brief.lines[line].of[quantity]});
  return samples;
}

}  // namespace talus::ensemble
