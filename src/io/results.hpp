/// results.h5 and results.xdmf from the journal, in two passes: the first counts, the second writes, a batch
/// of rows at a time, so that memory does not grow with the length of the run. Dataset names, shapes and
/// order: docs/output.md.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "io/final_state.hpp"
#include "io/hdf5_file.hpp"
#include "io/summary.hpp"

namespace talus::io {

struct BuiltResults {
  std::string summary_json;  // with the outcome if one was recorded or given
  std::size_t rows = 0, contacts = 0, fields = 0;
};

/// Writes results.h5 and results.xdmf of `directory` (each swapped in by rename). Reads the journal up to
/// `limit` bytes. `state`: of a run that has ended, for a later run to start from.
BuiltResults build_results(const std::filesystem::path& directory, const Outcome* outcome = nullptr,
                           std::uint64_t limit = ~std::uint64_t{0}, const sim::FinalState* state = nullptr);

/// What does not change with time: /geometry, names, materials, the plan.
void write_geometry(Hdf5File& file, const sim::RunHeader& header);

std::string encode_outcome(const Outcome& outcome);
Outcome decode_outcome(std::string_view bytes);

}  // namespace talus::io
