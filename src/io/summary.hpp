/// summary.json: what happened in a run, in a few hundred lines that a person or a program can read. Keys: docs/output.md.
///
/// An impact is the contact of one block with one structure, from its first contact row to the last one before a gap of more than
/// `impact_gap`. Over its coupled steps, with F the sum of the contact forces of a step (means over the step):
///
///   impulse = sum F dt  [N s],   peak force = max |F|  [N],   mean force = |impulse| / duration  [N]
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "io/member_track.hpp"
#include "sim/frame.hpp"

namespace talus::io {

/// How a run ended, as handed to Recorder::finish.
struct Outcome {
  std::string status = "done";  // done, at rest, interrupted, failed
  std::string message;          // why, for interrupted and failed
  sim::RunCounters counters;
  sim::InterfaceAudit audit;
  bool audit_made = false;      // false: no coupled step was made, the audit is left out
};

inline constexpr double impact_gap = 0.02;  // [s]

struct Impact {
  int structure = 0, block = 0;
  double start = 0, end = 0;             // [s]
  Vec3 velocity = Vec3::Zero();          // of the block in the last history row before it [m/s]
  Vec3 spin = Vec3::Zero();              // [rad/s]
  double kinetic = 0;                    // of the block then [J]
  Vec3 point = Vec3::Zero();             // centre of the contact forces, weighted by |F| dt [m]
  Vec3 normal = Vec3::Zero();            // of the contacts, weighted by |F| dt [N s]
  Vec3 impulse = Vec3::Zero();           // on the structure [N s]
  double peak_force = 0, peak_time = 0;  // [N], [s]
};

/// Fed with the rows in their order; holds only what the summary needs.
class SummaryBuilder {
 public:
  explicit SummaryBuilder(const sim::RunHeader& header);
  void extend(std::span<const sim::RunHeader::BlockInfo> blocks);
  void add(const sim::HistoryRow& row);
  void add(std::span<const sim::ContactRow> rows);
  const std::vector<Impact>& impacts() const { return impacts_; }
  /// The text of summary.json. `outcome` null: the run is still going on, or was cut off.
  std::string text(const Outcome* outcome);

 private:
  struct BlockTrack {
    Vec3 start, end, velocity, spin;
    bool born = false;
    double birth = 0, path = 0, max_speed = 0, max_kinetic = 0, kinetic = 0, max_spin = 0;
  };
  struct ProbeTrack { double peak = 0, peak_time = 0; Vec3 last = Vec3::Zero(); };
  struct StructureTrack {
    double peak_reaction = 0, peak_reaction_time = 0, peak_shear = 0, peak_shear_time = 0, peak_moment = 0, peak_moment_time = 0, damage = 0, damaged_volume = 0, spalled_volume = 0;
    double peak_force = 0, peak_force_time = 0;
    Vec3 first_force = Vec3::Zero(), first_moment = Vec3::Zero(), impulse = Vec3::Zero();
    bool seen = false;
    std::vector<ProbeTrack> probes;
    std::vector<MemberTrack> members;
    double step_time = -1;       // of the coupled step being summed
    Vec3 step_force = Vec3::Zero();
  };
  struct Open { int impact = -1; double time = 0; Vec3 force = Vec3::Zero(); double weight = 0; };
  /// The sentences that stand on top of the report.
  std::vector<std::string> headline() const;
  void structure_lines(std::size_t structure, std::vector<std::string>& lines) const;
  void block_lines(std::vector<std::string>& lines) const;
  std::vector<std::string> warnings() const;
  nlohmann::ordered_json of_structures() const;
  nlohmann::ordered_json of_blocks() const;
  nlohmann::ordered_json of_energy() const;
  nlohmann::ordered_json of_confidence() const;
  void close_step(Open& open);
  void close_step(StructureTrack& s);

  sim::RunHeader header_;  // without terrain
  std::vector<BlockTrack> blocks_;
  std::vector<StructureTrack> structures_;
  std::vector<Impact> impacts_;
  std::vector<std::vector<Open>> open_of_;
  sim::LedgerRow first_, last_;
  bool any_ = false;
  double algorithmic_step_ = 0, algorithmic_from_ = 0, algorithmic_to_ = 0, ledger_time_ = 0;   // between which rows the scheme made or took most [J], [s]
  double time_ = 0, kinetic_peak_ = 0, residual_worst_ = 0, residual_worst_time_ = 0;
};

/// What a summary.json warns of, a sentence each.
std::vector<std::string> summary_warnings(const std::string& summary_json);

}  // namespace talus::io
