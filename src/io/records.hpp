/// The rows of sim/frame.hpp as bytes and back. A block whose numbers have not changed a bit since the row
/// before costs one bit, and a structure names its fields of that row (field_columns.hpp): sleeping rock
/// masses and quiet structures take next to no space. The
/// codec therefore carries the row before, and encoding and decoding the same sequence leaves it in the same
/// state.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/field_columns.hpp"
#include "sim/frame.hpp"

namespace talus::io {

/// Fields at one instant: poses per block, and where those of each structure are.
struct FieldRow {
  double time = 0;
  std::vector<Pose> poses;
  std::vector<StructureField> structures;
};

std::string encode_header(const sim::RunHeader& header);
sim::RunHeader decode_header(std::string_view bytes);
std::string encode_blocks(std::span<const sim::RunHeader::BlockInfo> blocks);
std::vector<sim::RunHeader::BlockInfo> decode_blocks(std::string_view bytes);
std::string encode_contacts(std::span<const sim::ContactRow> rows);
std::vector<sim::ContactRow> decode_contacts(std::string_view bytes);

/// Numbers of a block in a history row, in the order position, velocity, spin, orientation, strain, kinetic
/// energies.
inline constexpr std::size_t history_width = 3 + 3 + 3 + 4 + 6 + 2;
inline constexpr std::size_t peaks_width = 3;

class RecordCodec {
 public:
  std::string encode(const sim::HistoryRow& row);
  sim::HistoryRow decode_history(std::string_view bytes);
  std::string encode(const FieldRow& row);
  const FieldRow& decode_field(std::string_view bytes);

 private:
  std::vector<double> blocks_;  // history_width per block
  std::vector<double> peaks_;   // peaks_width per block
  FieldRow field_;
};

}  // namespace talus::io
