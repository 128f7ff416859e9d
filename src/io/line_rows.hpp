/// Crossings of lines by the paths of blocks in a run: rows of the journal, and /lines/NAME/ of results.h5.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/types.hpp"

namespace talus::io {

class Hdf5File;

/// The path of a block's centroid cuts a segment of a line in plan.
struct LineRow {
  int line = 0, block = 0;                                                     // by their places in the scene
  double time = 0;                                                             // [s]
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero(), spin = Vec3::Zero();  // [m], [m/s], [rad/s]
  double translational = 0, rotational = 0;                                    // kinetic energies [J]
  double height = 0;  // of the centroid above the ground, NaN off it [m]
};

std::string encode_line_names(std::span<const std::string> names);
std::vector<std::string> decode_line_names(std::string_view bytes);
std::string encode_line_rows(std::span<const LineRow> rows);
std::vector<LineRow> decode_line_rows(std::string_view bytes);

/// A group for every line, also for one that nothing crosses; `crs` is an attribute of each.
void write_lines(Hdf5File& file, std::span<const std::string> names, std::span<const LineRow> rows,
                 const std::string& crs);

}  // namespace talus::io
