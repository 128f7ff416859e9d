/// Results of an ensemble: ensemble.h5, summary.json, details.json, and the scenes of members that went
/// wrong.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ensemble/ensemble.hpp"
#include "ensemble/precision.hpp"

namespace talus::ensemble {

struct LineSummary {
  std::string name;
  long crossings = 0;  // rows
  long members = 0;    // finished ones that cross
  Estimate probability;
  std::array<std::array<Estimate, 4>, 3> percentiles;  // of energy, speed, height: p50, p90, p95, p99
};

struct StructureSummary {
  std::string name;
  long members = 0;  // finished ones that hit it
  Estimate probability;
  struct Struck {
    std::string name;  // of its pier, column or span
    long members = 0;  // that hit this one
    Estimate probability;
  };
  std::vector<Struck> struck;  // of what is hit at all
};

struct Summary {
  long asked = 0, done = 0, failed = 0, over_limit = 0, suspect = 0;
  long left = 0;   // finished ones of which a block left the terrain: reach and deposits end at its limits
  double cpu = 0;  // [s]
  std::vector<LineSummary> lines;
  std::vector<StructureSummary> structures;
  std::optional<Precision> precision;  // where one is asked for
};

/// That blocks left the terrain, in a sentence; empty if none did.
std::string left_text(const Summary& summary);

/// Throws InputError if the directory holds no finished ensemble.
void require_finished(const std::filesystem::path& directory);

/// Of the first `members` members in the directory's journals.
Summary write_results(Ensemble& ensemble, const std::filesystem::path& directory, long members);

}  // namespace talus::ensemble
