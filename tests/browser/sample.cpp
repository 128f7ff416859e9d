// talus_sample_report DIR: made-up runs and their reports, for the browser test. DIR/one: a boulder, a pier
// that bears a deck, a line; DIR/many: a thousand blocks without a structure; DIR/none: no block at all.
#include <cstdio>
#include <exception>

#include "io/report.hpp"
#include "synthetic.hpp"

using talus::test::SyntheticRun;

namespace {

void make(const SyntheticRun& run, const std::filesystem::path& directory) {
  talus::io::RecorderOptions options;
  options.directory = directory;
  options.paraview = false;
  talus::io::Recorder recorder(options, run.header());
  run.record(recorder, 0, run.rows() - 1, [](int) {});
  talus::io::Outcome outcome;
  outcome.counters.steps = run.rows() * 10L;
  outcome.counters.wall_seconds = 12.5;
  outcome.audit_made = run.structure;
  recorder.finish(outcome);
  const auto path = talus::io::write_report(directory);
  std::printf("%s %ju bytes\n", path.c_str(), static_cast<std::uintmax_t>(std::filesystem::file_size(path)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const std::filesystem::path dir = argv[1];
    SyntheticRun one;
    one.blocks = 3;
    one.cells = {8, 8, 48};
    one.bars = one.members = one.line = true;
    make(one, dir / "one");
    SyntheticRun many;
    many.blocks = 1000;
    many.structure = false;
    many.history_interval = 0.1;
    many.field_interval = 1.0;
    many.terrain_nodes = 401;
    make(many, dir / "many");
    SyntheticRun none;
    none.blocks = 0;
    none.end = 1;
    none.fragment = false;
    make(none, dir / "none");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
