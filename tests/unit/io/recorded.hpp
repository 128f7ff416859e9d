/// Synthetic runs as a recorder leaves them on disk.
#pragma once
#include <filesystem>
#include <string>

#include "helpers/place.hpp"
#include "io/recorder.hpp"
#include "synthetic.hpp"

namespace talus::test {

inline io::RecorderOptions recorder_options(const std::filesystem::path& directory) {
  io::RecorderOptions o;
  o.directory = directory;
  o.resolved_json = "{}";
  return o;
}

/// Records all rows of a run into a directory of its own; returns that.
inline std::filesystem::path whole_run(const Place& scratch, const SyntheticRun& run,
                                       const std::string& name = "out") {
  const std::filesystem::path dir = scratch.path() / name;
  io::Recorder recorder(recorder_options(dir), run.header());
  run.record(recorder, 0, run.rows() - 1, [](int) {});
  recorder.finish({});
  return dir;
}

}  // namespace talus::test
