#include "io/results.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "io/bytes.hpp"
#include "io/files.hpp"
#include "io/journal.hpp"
#include "io/line_rows.hpp"
#include "io/records.hpp"
#include "io/result_writers.hpp"

namespace talus::io {
namespace {

using sim::ContactRow;
using sim::HistoryRow;
using sim::RunHeader;

struct Count {
  RunHeader header;  // with all fragments
  std::size_t rows = 0, contacts = 0, fields = 0;
  std::optional<Outcome> outcome;
};

Count count(const std::filesystem::path& journal, std::uint64_t limit) {
  Count c;
  JournalReader reader(journal, limit);
  RecordKind kind;
  std::string payload;
  while (reader.next(kind, payload)) {
    switch (kind) {
      case RecordKind::header: c.header = decode_header(payload); break;
      case RecordKind::extend:
        for (auto& b : decode_blocks(payload)) c.header.blocks.push_back(std::move(b));
        break;
      case RecordKind::history: ++c.rows; break;
      case RecordKind::contacts: c.contacts += ByteReader(payload).take<std::uint64_t>(); break;
      case RecordKind::field: ++c.fields; break;
      case RecordKind::warning:
      case RecordKind::lines:
      case RecordKind::column:
      case RecordKind::crossings: break;
      case RecordKind::outcome: c.outcome = decode_outcome(payload); break;
    }
  }
  return c;
}

/// From what the recorder kept of the scene. Only the wording of a remedy depends on it: without it steps
/// count as by accuracy.
Steps steps_of(const std::filesystem::path& directory) {
  const std::filesystem::path file = directory / "scene.resolved.json";
  if (!std::filesystem::exists(file)) return Steps::by_accuracy;
  const nlohmann::json scene = nlohmann::json::parse(read_file(file), nullptr, false);
  const nlohmann::json::json_pointer method("/simulation/method"), step("/simulation/step");
  if (scene.contains(method) && scene.at(method) == "dda-1988") return Steps::scheme_1988;
  return scene.contains(step) ? Steps::fixed : Steps::by_accuracy;
}

Taken taken_of(const std::filesystem::path& directory) {
  const std::filesystem::path file = directory / "scene.resolved.json";
  if (!std::filesystem::exists(file)) return Taken::both_ways;
  const nlohmann::json scene = nlohmann::json::parse(read_file(file), nullptr, false);
  const nlohmann::json::json_pointer scheme("/coupling/scheme");
  if (!scene.contains(scheme)) return Taken::both_ways;
  return scene.at(scheme) == "one-way" ? Taken::one_way
         : scene.at(scheme) == "rigid" ? Taken::nothing
                                       : Taken::both_ways;
}

BuiltResults build(const std::filesystem::path& directory, const Outcome* outcome, std::uint64_t limit,
                   const sim::FinalState* state) {
  const std::filesystem::path journal = directory / "journal.bin";
  Count c = count(journal, limit);
  if (outcome == nullptr && c.outcome) outcome = &*c.outcome;
  PartFile part(directory / "results.h5");
  BuiltResults built{.summary_json = {}, .rows = c.rows, .contacts = c.contacts, .fields = c.fields};
  std::vector<XdmfFrame> frames;
  {
    Hdf5File file = Hdf5File::create(part.path());
    file.attribute("/", "program", std::string("talus"));
    file.attribute("/", "schema", std::int64_t{1});
    file.attribute("/", "title", c.header.title);
    file.attribute("/", "crs", c.header.crs);
    HistoryWriter history(file, c.header, c.rows);
    ContactWriter contacts(file, c.contacts);
    write_geometry(file, c.header);
    FieldWriter fields(file, c.header, journal);
    std::optional<SummaryBuilder> summary;
    const Steps steps = steps_of(directory);
    const Taken taken = taken_of(directory);
    RecordCodec codec;
    JournalReader reader(journal, limit);
    RecordKind kind;
    std::string payload;
    std::vector<double> field_times;
    std::vector<std::string> line_names;
    std::vector<LineRow> line_rows;
    while (reader.next(kind, payload)) {
      switch (kind) {
        case RecordKind::header: summary.emplace(decode_header(payload), steps, taken); break;
        case RecordKind::extend:
          if (summary) summary->extend(decode_blocks(payload));
          break;
        case RecordKind::history: {
          const HistoryRow row = codec.decode_history(payload);
          history.add(row);
          if (summary) summary->add(row);
          break;
        }
        case RecordKind::contacts: {
          const std::vector<ContactRow> rows = decode_contacts(payload);
          for (const ContactRow& r : rows) contacts.add(r);
          if (summary) summary->add(rows);
          break;
        }
        case RecordKind::field: {
          const FieldRow& row = codec.decode_field(payload);
          field_times.push_back(row.time);
          fields.add(row);
          break;
        }
        case RecordKind::lines: line_names = decode_line_names(payload); break;
        case RecordKind::crossings: {
          const std::vector<LineRow> rows = decode_line_rows(payload);
          line_rows.insert(line_rows.end(), rows.begin(), rows.end());
          break;
        }
        case RecordKind::warning:
          if (summary) summary->add_warning(payload);
          break;
        case RecordKind::column:
        case RecordKind::outcome: break;
      }
    }
    history.flush();
    contacts.flush();
    file.write<double>("/fields/time", field_times, {field_times.size()}, "s", "time of each frame group");
    if (summary) {
      built.summary_json = summary->text(outcome);
      const std::vector<double> left = summary->left();
      if (!left.empty())
        file.write<double>("/history/blocks/left", left, {left.size()}, "s",
                           "when the block left the model over the edge of the terrain; NaN: it did not");
    }
    write_lines(file, line_names, line_rows, c.header.crs);
    if (state != nullptr) write_final_state(file, *state);
    file.close();
    frames = fields.frames();
  }
  part.swap_in();
  const XdmfTerrain terrain{c.header.terrain.vertices.size(), c.header.terrain.triangles.size()};
  write_file(directory / "results.xdmf", xdmf_text(frames, terrain));
  return built;
}

}  // namespace

BuiltResults build_results(const std::filesystem::path& directory, const Outcome* outcome,
                           std::uint64_t limit, const sim::FinalState* state) {
  try {
    return build(directory, outcome, limit, state);
  } catch (const std::out_of_range& e) {  // whole by its checksum, and yet no record of ours
    throw bad_file(directory / "journal.bin", {},
                   fmt::format("holds a record that cannot be read: {}", e.what()), "run the scene again");
  }
}

namespace {

void outcome_fields(auto& o, auto&& f) {
  f(o.status), f(o.message), f(o.audit_made), f(o.counters);
  f(o.audit.worst_force_imbalance), f(o.audit.worst_moment_imbalance), f(o.audit.impulse_defect),
      f(o.audit.work_on_blocks), f(o.audit.work_on_structure), f(o.audit.impulse_on_structure);
}

}  // namespace

std::string encode_outcome(const Outcome& o) {
  ByteWriter w;
  outcome_fields(o, [&](const auto& value) { w.put(value); });
  for (const coupling::Met& met : o.audit.met) w.put(met.first), w.put(met.impulse);
  return w.bytes();
}

Outcome decode_outcome(std::string_view bytes) {
  ByteReader r(bytes);
  Outcome o;
  outcome_fields(o, [&](auto& value) { r.get(value); });
  while (r.left() > 0) {
    coupling::Met& met = o.audit.met.emplace_back();
    r.get(met.first), r.get(met.impulse);
  }
  return o;
}

}  // namespace talus::io
