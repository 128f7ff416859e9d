/// What goes into report.html, gathered from results.h5 and summary.json by the add_... functions. Internal
/// to io.
///
/// Arrays go to `blob` (not in docs/output.md: the page is their only reader), everything else to
/// `meta`. Points are stored relative to the local origin that add_site() chooses from `region`, so that it
/// comes after all that has a place.
#pragma once
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/check_indices.hpp"
#include "io/files.hpp"
#include "io/report_parts.hpp"

namespace talus::io {

struct ReportData {
  explicit ReportData(const std::filesystem::path& directory);
  Hdf5File file;
  nlohmann::ordered_json summary;  // its order is the order of the page
  nlohmann::ordered_json meta = nlohmann::ordered_json::object();
  Blob blob;
  std::vector<double> time;             // of the history rows [s]
  std::vector<std::string> names;       // of the blocks
  Windows windows;                      // around the impacts
  Box3 region;                          // what happened [m]
  std::vector<double> block_positions;  // [frames, blocks, 3] [m]
  std::size_t frames = 0;
  struct Pending {
    std::string key;
    std::vector<Vec3> nodes;
  };
  std::vector<Pending> pending;  // points that wait for the origin
};

void add_poses(ReportData& d);
void add_structures(ReportData& d);
void add_site(ReportData& d);
void add_shapes(ReportData& d);
void add_curves(ReportData& d);

}  // namespace talus::io
