#include "io/recorder.hpp"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <utility>

#include "io/hdf5_file.hpp"
#include "io/journal.hpp"
#include "io/records.hpp"
#include "io/results.hpp"
#include "io/vtu.hpp"

namespace fs = std::filesystem;

namespace talus::io {

struct Recorder::Impl {
  std::optional<DirectoryLock> lock;
  RecorderOptions options;
  sim::RunHeader header;
  std::unique_ptr<JournalWriter> journal;
  std::unique_ptr<JsonLog> log;
  RecordCodec codec;
  FieldRow last_field;                 // to see what has not changed
  std::vector<std::string> stems;      // of the files of each structure
  std::vector<std::string> last_file;  // of each structure and its bars
  std::vector<Vec3> start;             // centroids when first seen
  sim::HistoryRow last_row;
  std::vector<PvdEntry> pvd;
  std::size_t fields = 0;
  std::uint64_t built_at = 0;  // journal position of the last results.h5
  bool finished = false;

  fs::path journal_path() const { return options.directory / "journal.bin"; }
  void remember(const sim::HistoryRow& row) {
    for (std::size_t i = start.size(); i < row.position.size(); ++i) start.push_back(row.position[i]);
    last_row = row;
  }
  void write_pvd() {
    if (options.paraview) write_file(options.directory / "results.pvd", pvd_text(pvd));
  }
  void paraview(const FieldRow& row, bool write);
  void grow();
};

namespace {

constexpr const char* terrain_file = "fields/terrain.vtu";

/// What the files of each structure begin with: its name, with "_" after it where the files of the blocks or
/// of another structure have it.
std::vector<std::string> file_stems(std::span<const sim::RunHeader::StructureInfo> structures) {
  std::set<std::string> taken = {"blocks"};
  std::vector<std::string> stems;
  for (const auto& s : structures) {
    std::string stem = safe_name(s.name);
    while (taken.count(stem) + taken.count(stem + "_bars") > 0) stem += "_";
    taken.insert({stem, stem + "_bars"});
    stems.push_back(std::move(stem));
  }
  return stems;
}

}  // namespace

/// Files and .pvd entries of one frame; with write = false only the entries (the files are there from before
/// a restart).
void Recorder::Impl::paraview(const FieldRow& row, bool write) {
  if (!options.paraview) return;
  const fs::path& dir = options.directory;
  int part = 0;
  if (!header.terrain.triangles.empty()) pvd.push_back({row.time, part++, "terrain", terrain_file});
  if (!row.poses.empty()) {
    const std::string file = fmt::format("fields/blocks_{:06}.vtu", fields);
    const bool now = last_row.time == row.time && !last_row.position.empty();
    if (write) write_blocks_vtu(dir / file, header.blocks, row.poses, start, now ? &last_row : nullptr);
    pvd.push_back({row.time, part++, "blocks", file});
  }
  if (stems.empty()) stems = file_stems(header.structures);
  last_file.resize(2 * row.structures.size());
  for (std::size_t i = 0; i < row.structures.size() && i < header.structures.size(); ++i) {
    const StructureField& s = row.structures[i];
    const bool bars = s.has(bars_column);
    const std::string& name = header.structures[i].name;
    // A structure that has not moved is not written again; the .pvd names the earlier file.
    if (last_file[2 * i].empty() || i >= last_field.structures.size() || !(last_field.structures[i] == s)) {
      last_file[2 * i] = fmt::format("fields/{}_{:06}.vtu", stems[i], fields);
      if (write) write_structure_vtu(dir / last_file[2 * i], journal_path(), s);
      last_file[2 * i + 1] = bars ? fmt::format("fields/{}_bars_{:06}.vtu", stems[i], fields) : "";
      if (write && bars) write_bars_vtu(dir / last_file[2 * i + 1], journal_path(), s);
    }
    pvd.push_back({row.time, part++, name, last_file[2 * i]});
    if (!last_file[2 * i + 1].empty())
      pvd.push_back({row.time, part++, name + " bars", last_file[2 * i + 1]});
  }
}

/// Rebuilds results.h5 if the journal has grown by half, a large one to the fourfold: the sum of all rebuilds
/// is then a geometric series.
void Recorder::Impl::grow() {
  constexpr std::uint64_t large = 256u << 20;
  if (journal->position() < (built_at < large ? built_at + built_at / 2 : 4 * built_at)) return;
  journal->sync();  // also detects a journal that was removed
  build_results(options.directory, nullptr, journal->position());
  write_pvd();
  built_at = journal->position();
}

Recorder::Recorder(RecorderOptions options, const sim::RunHeader& header) : impl_(std::make_unique<Impl>()) {
  // Read before the directory is cleared: it may be the copy that lies there.
  const std::string scene = options.scene_file.empty() ? std::string() : read_file(options.scene_file);
  impl_->lock = claim_directory(options.directory, Results::run);
  impl_->options = std::move(options);
  impl_->header = header;
  const fs::path& dir = impl_->options.directory;
  if (!impl_->options.scene_file.empty()) write_file(dir / "scene.toml", scene);
  if (!impl_->options.resolved_json.empty())
    write_file(dir / "scene.resolved.json", impl_->options.resolved_json);
  impl_->log = std::make_unique<JsonLog>((dir / "log.jsonl").string());
  impl_->journal = std::make_unique<JournalWriter>(impl_->journal_path(), 0);
  impl_->journal->append(RecordKind::header, encode_header(header));
  impl_->journal->flush();
  if (impl_->options.paraview) {
    fs::create_directories(dir / "fields");
    if (!header.terrain.triangles.empty()) write_surface_vtu(dir / terrain_file, header.terrain);
  }
}

Recorder::Recorder(RecorderOptions options, std::uint64_t position) : impl_(std::make_unique<Impl>()) {
  impl_->lock.emplace(options.directory);
  impl_->options = std::move(options);
  const fs::path journal = impl_->journal_path();
  if (!fs::exists(journal))
    throw bad_file(journal, {}, "is missing, and the checkpoint goes on from it",
                   "run the scene again without --resume");
  {
    JournalReader reader(journal, position);
    RecordKind kind;
    std::string payload;
    while (reader.next(kind, payload)) {
      switch (kind) {
        case RecordKind::header: impl_->header = decode_header(payload); break;
        case RecordKind::extend:
          for (auto& b : decode_blocks(payload)) impl_->header.blocks.push_back(std::move(b));
          break;
        case RecordKind::history: impl_->remember(impl_->codec.decode_history(payload)); break;
        case RecordKind::field: {
          const FieldRow& row = impl_->codec.decode_field(payload);
          impl_->paraview(row, false);
          impl_->last_field = row;
          ++impl_->fields;
          break;
        }
        case RecordKind::warning: impl_->header.warnings.push_back(payload); break;
        case RecordKind::contacts:
        case RecordKind::lines:
        case RecordKind::crossings:
        case RecordKind::column:
        case RecordKind::outcome: break;
      }
    }
    if (reader.position() != position)
      throw bad_file(journal, {},
                     fmt::format("ends or is damaged at byte {}, but the checkpoint goes up to byte {}",
                                 reader.position(), position),
                     "run the scene again without --resume");
  }
  impl_->log = std::make_unique<JsonLog>((impl_->options.directory / "log.jsonl").string(), true);
  impl_->journal = std::make_unique<JournalWriter>(journal, position);
  impl_->built_at = position;
  if (impl_->options.paraview) fs::create_directories(impl_->options.directory / "fields");
}

Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;

void Recorder::history(const sim::HistoryRow& row) {
  impl_->journal->append(RecordKind::history, impl_->codec.encode(row));
  impl_->remember(row);
}

void Recorder::contacts(std::span<const sim::ContactRow> rows) {
  if (!rows.empty()) impl_->journal->append(RecordKind::contacts, encode_contacts(rows));
}

void Recorder::lines(std::span<const std::string> names) {
  if (!names.empty()) impl_->journal->append(RecordKind::lines, encode_line_names(names));
}

void Recorder::crossings(std::span<const LineRow> rows) {
  if (!rows.empty()) impl_->journal->append(RecordKind::crossings, encode_line_rows(rows));
}

void Recorder::field(double time, std::span<const Pose> poses,
                     std::span<const Structure::Fields> structures) {
  FieldRow row{time, {poses.begin(), poses.end()}, {}};
  const std::vector<StructureField>& before = impl_->last_field.structures;
  for (std::size_t i = 0; i < structures.size(); ++i)
    row.structures.push_back(
        append_fields(*impl_->journal, structures[i], i < before.size() ? before[i] : StructureField{}));
  impl_->journal->append(RecordKind::field, impl_->codec.encode(row));
  impl_->journal->flush();
  impl_->paraview(row, true);
  impl_->last_field = std::move(row);
  ++impl_->fields;
}

void Recorder::extend(std::span<const sim::RunHeader::BlockInfo> fragments) {
  if (fragments.empty()) return;
  impl_->journal->append(RecordKind::extend, encode_blocks(fragments));
  impl_->header.blocks.insert(impl_->header.blocks.end(), fragments.begin(), fragments.end());
}

void Recorder::warning(const std::string& text) {
  impl_->journal->append(RecordKind::warning, text);
  impl_->header.warnings.push_back(text);
  log().warning("run", {{"text", text}});
}

const std::vector<std::string>& Recorder::warnings() const { return impl_->header.warnings; }

std::uint64_t Recorder::checkpoint() {
  impl_->journal->sync();
  impl_->grow();
  return impl_->journal->position();
}

std::string Recorder::finish(const Outcome& outcome, const sim::FinalState* state) {
  impl_->journal->append(RecordKind::outcome, encode_outcome(outcome));
  impl_->journal->sync();
  const BuiltResults built =
      build_results(impl_->options.directory, &outcome, impl_->journal->position(), state);
  impl_->write_pvd();
  write_file(impl_->options.directory / "summary.json", built.summary_json);
  if (has_ended(outcome.status)) {
    impl_->journal.reset();
    std::error_code error;
    fs::remove(impl_->journal_path(), error);  // all of it is in results.h5 now
  }
  return built.summary_json;
}

JsonLog& Recorder::log() { return *impl_->log; }
const fs::path& Recorder::directory() const { return impl_->options.directory; }
const sim::RunHeader& Recorder::header() const { return impl_->header; }

bool recover(const fs::path& directory) {
  std::error_code error;
  if (!fs::exists(directory / "journal.bin", error)) return false;
  const BuiltResults built = build_results(directory);
  write_file(directory / "summary.json", built.summary_json);
  return true;
}

}  // namespace talus::io
