/// summary.json: what happened in a run, in a few hundred lines that a person or a program can read. Keys:
/// docs/output.md.
///
/// An impact is the contact of one block with one structure, from its first contact row to the last one
/// before a gap of more than `impact_gap`. Over its coupled steps, with F the sum of the contact forces of a
/// step (means over the step):
///
///   impulse = sum F dt  [N s],   peak force = max |F|  [N],   mean force = |impulse| / duration  [N]
///
/// and the filtered force of force_track.hpp. The blow itself is over once the impulse along the normal is 2
/// m v_n, m v_n to stop the block and as much again at most to throw it back: what it does later, resting or
/// pushed by the structure, has nothing to do with the speed at which it came. What a piece does to the
/// structure it came off is part of that structure's forces, but no impact.
///
/// A block has left the model once it is beside the terrain and lower than the ground it was last over: its
/// figures are those of the last row before. Scenes with planes have no edge to leave over.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "io/force_track.hpp"
#include "io/ground_raster.hpp"
#include "io/member_track.hpp"
#include "sim/frame.hpp"

namespace talus::io {

/// How a run ended, as handed to Recorder::finish.
struct Outcome {
  std::string status = "done";  // done, at rest, all left, interrupted, failed
  std::string message;          // why, for interrupted and failed
  sim::RunCounters counters;
  sim::InterfaceAudit audit;
  bool audit_made = false;  // false: no coupled step was made, the audit is left out
};

/// Of a status: there is nothing to go on with.
bool has_ended(const std::string& status);

inline constexpr double impact_gap = 0.02;  // [s]

struct Impact {
  int structure = 0, block = 0;
  double start = 0, end = 0;             // [s]
  Vec3 velocity = Vec3::Zero();          // of the block as it came [m/s]
  Vec3 spin = Vec3::Zero();              // [rad/s]
  double kinetic = 0, rotational = 0;    // of the block then, and what of it is of its rotation [J]
  Vec3 point = Vec3::Zero();             // centre of the contact forces, weighted by |F| dt [m]
  Vec3 normal = Vec3::Zero();            // of the contacts, weighted by |F| dt [N s]
  Vec3 impulse = Vec3::Zero();           // on the structure [N s]
  double peak_force = 0, peak_time = 0;  // [N], [s]
  double blow_force = 0;                 // greatest until the blow is over, blow_part() [N]
  ForceTrack force;
  double filtered_force = 0;  // greatest mean over load_window, set when the text is made [N]
};

/// The member whose axis the point lies nearest to, among those that reach to its height: what lies below a
/// span, such as the end of a cap beam, is the pier's. Null: none does (a mesh without members).
const Member* struck_member(const sim::RunHeader::StructureInfo& structure, const Vec3& point);

/// What the lengths of a run's steps go by: simulation.accuracy, simulation.step, or the step that the scheme
/// of 1988 is given.
enum class Steps { by_accuracy, fixed, scheme_1988 };

/// coupling.scheme: what structures take of what strikes them.
enum class Taken { both_ways, one_way, nothing };

/// Fed with the rows in their order; holds only what the summary needs.
class SummaryBuilder {
 public:
  explicit SummaryBuilder(const sim::RunHeader& header, Steps steps = Steps::by_accuracy,
                          Taken taken = Taken::both_ways);
  void extend(std::span<const sim::RunHeader::BlockInfo> blocks);
  void add(const sim::HistoryRow& row);
  void add(std::span<const sim::ContactRow> rows);
  /// A warning of the run.
  void add_warning(std::string text) { header_.warnings.push_back(std::move(text)); }
  /// When each block left the model [s]; NaN: it did not.
  std::vector<double> left() const;
  const std::vector<Impact>& impacts() const { return impacts_; }
  /// The text of summary.json. `outcome` null: the run is still going on, or was cut off.
  std::string text(const Outcome* outcome);

 private:
  struct BlockTrack {
    Vec3 start, end, velocity, spin;
    double acceleration = 0;  // between the last two rows [m/s^2]
    bool born = false;
    double birth = 0, path = 0, kinetic = 0, rotational = 0;
    coupling::MotionPeaks peaks;
    double time = 0;    // of the last row that counts [s]
    bool left = false;  // the model
  };
  struct LastGround {
    BlockTrack there;
    double height = 0;
    bool beside = false;
  };  // of a block while it was over the terrain; or as it started beside it
  struct ProbeTrack {
    double peak = 0, peak_time = 0;
    Vec3 last = Vec3::Zero();
  };
  struct StructureTrack {
    double damage = 0, damaged_volume = 0, spalled_volume = 0;
    LoadPeaks loads;  // as of the last row
    double peak_force = 0, peak_force_time = 0;
    Vec3 first_force = Vec3::Zero(), first_moment = Vec3::Zero(), impulse = Vec3::Zero();
    bool seen = false;
    double lost_before = 0;  // spalled volume of the first row [m^3]
    double first_loss = -1;  // when the first piece came off or the first cell was crushed [s]; < 0: never
    std::vector<ProbeTrack> probes;
    std::vector<MemberTrack> members;
    double step_time = -1;     // of the coupled step being summed
    double last_contact = -1;  // of the last contact force; < 0: none [s]
    Vec3 step_force = Vec3::Zero();
  };
  struct Open {
    int impact = -1;
    double time = 0, dt = 0;
    Vec3 force = Vec3::Zero();
    double weight = 0;
  };
  /// The sentences that stand on top of the report.
  std::vector<std::string> headline() const;
  void structure_lines(std::size_t structure, std::vector<std::string>& lines) const;
  void not_hit_line(std::size_t structure, std::vector<std::string>& lines) const;
  /// The structure through which one that no block struck was loaded by a strike on another, and when that
  /// was struck [s]; < 0: none.
  struct Through {
    int structure = -1;
    double struck = 0;
  };
  Through loaded_through(std::size_t structure) const;
  /// What a structure got from others that it touched; null: nothing.
  const coupling::Met* met(std::size_t structure) const;
  /// Those of them, "A, B".
  std::string others_met(std::size_t structure) const;
  bool elastic(std::size_t structure) const;
  /// How bad: damage class and V_dyn / V_Rd of every member, the worst first.
  void member_lines(std::size_t structure, std::vector<std::string>& lines) const;
  void function_line(std::size_t structure, std::vector<std::string>& lines) const;
  void piece_line(std::size_t structure, std::vector<std::string>& lines) const;
  void block_lines(std::vector<std::string>& lines) const;
  bool moves(std::size_t block) const;
  bool struck(std::size_t block) const;
  bool started_beside(std::size_t block) const;
  void left_line(std::vector<std::string>& lines) const;
  void add_block(std::size_t i, const sim::HistoryRow& row);
  void add_structure(std::size_t i, const sim::HistoryRow& row);
  /// Freezes a block that is beside the terrain and below its edge.
  void watch_edge(std::size_t i);
  double ground_at(const Vec3& x) const;
  bool is_own(int block, int structure) const;
  const Impact* first_strike(std::size_t structure) const;
  /// The blow with the most kinetic energy just before it; of a piece of another structure only where no
  /// block struck. Null: none.
  const Impact* hardest_strike(std::size_t structure) const;
  /// Part of the force of the step being summed that belongs to the blow.
  double blow_part(const Impact& impact, const Open& open) const;
  /// When the structure began to fail before any block was at it [s]; < 0: it did not.
  double failed_before_strike(std::size_t structure) const;
  std::string elastic_warning(std::size_t structure) const;  // empty: its concrete bears what the run found
  std::string against_algorithmic() const;
  bool scheme_takes_too_much() const;  // numerical dissipation beyond the limit of its warning
  std::string algorithmic_warning() const;
  /// The most energy that was moved, of which numerical energy errors are: the largest kinetic energy, what
  /// springs, cells and bars took up or gave (prestress that is let go, a structure that settles), or the
  /// work of loads (one that is put on slowly moves little at a time); in words as well [J].
  double moved_energy() const {
    return std::max({kinetic_peak_, strain_moved_, std::abs(last_.external_work)});
  }
  const char* moved_name() const;
  double least_kinetic() const;  // kinetic energy below which nothing moves that could be judged [J]
  std::vector<std::string> warnings(const nlohmann::ordered_json& formulas,
                                    const sim::RunCounters& counters) const;
  nlohmann::ordered_json of_structures() const;
  nlohmann::ordered_json of_blocks() const;
  nlohmann::ordered_json of_energy() const;
  nlohmann::ordered_json of_confidence() const;
  void close_step(Open& open);
  void close_step(StructureTrack& s);
  static void settle(Impact& impact);
  void add_to_structure(StructureTrack& s, const sim::ContactRow& row);

  sim::RunHeader header_;  // without terrain
  Steps steps_;
  Taken taken_;
  std::vector<BlockTrack> blocks_;
  std::vector<LastGround> ground_of_;  // empty without an edge
  Raster ground_;                      // heights of the terrain, coarse
  double lowest_ground_ = 0;
  std::vector<StructureTrack> structures_;
  std::vector<Impact> impacts_;
  std::vector<std::vector<Open>> open_of_;
  sim::LedgerRow first_, last_;
  std::vector<coupling::Met> met_;      // by structure, of the run's end
  bool any_ = false, springs_ = false;  // a row was there; contacts held energy
  double algorithmic_step_ = 0, algorithmic_from_ = 0, algorithmic_to_ = 0,
         ledger_time_ = 0;  // between which rows the numerical energy error was largest [J], [s]
  double time_ = 0, kinetic_peak_ = 0, strain_moved_ = 0, residual_worst_ = 0, residual_worst_time_ = 0;
};

/// What a summary.json warns of, a sentence each.
std::vector<std::string> summary_warnings(const std::string& summary_json);
/// The sentences that it begins with.
std::vector<std::string> summary_headline(const std::string& summary_json);

}  // namespace talus::io
