/// What the bodies of an island may touch within a step. Pairs whose bodies have not moved since the last
/// search keep what it found.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "coupling/search/surface_focus.hpp"
#include "coupling/springs/spring_carry.hpp"
#include "coupling/touch/pair_watch.hpp"

namespace talus::coupling {

/// How far a block may come within h [m].
double reach_of(const IslandContext& in, int block, double h);

class ContactSearch {
 public:
  ContactSearch(const IslandContext& in, Step& step, const SurfaceFocus& focus);
  /// Of a macro step.
  void begin();
  /// The touches of the present state within the reach of h, with what their springs go on from.
  void find(double h) { find(h, true); }
  /// Those at the end of a step of length h; the step's own stay.
  std::vector<Touch> find_at_end(double h);
  /// The touches again after a projection moved blocks from their last poses, between blocks and with what is
  /// fixed: searched again, or where the two have so little moved since against each other, or turned
  /// (`carried`, per pair [m]), that its square is below what is projected to, carried along.
  void find_moved(const std::vector<Pose>& last, std::vector<double>& carried);
  /// Concave blocks can hide an overlap from the search until a corner comes out of a notch. What no motion
  /// of this step can have made is not thrown out, which would be a blow that nobody struck: it stays where
  /// it is, as where a piece was born inside another.
  void keep_late_overlaps();
  /// Rows for what a solution met: the touches of pairs ahead that lay beyond the reach of the step, at its
  /// start, and the features that it met unforeseen. `features`: per pair. All others keep the impulses of
  /// the last solution.
  void add_rows(const std::vector<std::vector<Touch>>& features);
  /// Other parts of the skins are followed: what is known of their pairs is void.
  void forget_surfaces();

  /// Calls use(pair) for every pair, in any order, on several threads where it pays.
  void each_pair(const std::function<void(std::size_t)>& use) const;
  /// First of a pair's touches in those of the step; of one pair more: behind the last.
  std::size_t first_of(std::size_t pair) const { return first_of_pair_[pair]; }
  std::span<Touch> of_pair(std::size_t pair) const {
    return std::span(step_.touches).subspan(first_of(pair), first_of(pair + 1) - first_of(pair));
  }
  /// It had touches, all of them internal edges.
  bool flush(std::size_t pair) const { return flush_pair_[pair] != 0; }
  /// Some touches were not searched for at the present state but went along with their blocks, by less than
  /// tolerances().same_point: features that have come near since are not among them.
  bool carried() const { return carried_; }
  /// No feature farther apart than this is among the pair's touches [m].
  double margin(std::size_t pair) const { return margins_[pair]; }
  /// Least gap of the features within the margin that are not among the touches, since they cannot close [m].
  double left_out(std::size_t pair) const { return left_out_[pair]; }
  /// A solution of this step met the feature before.
  bool was_met(std::size_t pair, contact::FeatureKey key) const;
  /// Springs that vanished loaded since the last step.
  const std::vector<LooseSpring>& loose() const { return loose_; }

 private:
  void find(double h, bool at_start);
  void search_pair(std::size_t pair);
  void drop_distant(std::size_t pair);
  void gather();
  void carry();
  void carry_out_of_reach();
  void carry_pair(std::size_t pair, const std::vector<Pose>& last);
  void take_carried();

  const IslandContext& in_;
  Step& step_;
  const SurfaceFocus& focus_;
  std::vector<std::vector<Touch>> touches_of_;  // per pair, before internal edges were dropped
  std::vector<std::size_t> first_of_pair_;      // of touches_of_ one after the other, while they are gathered
  std::vector<Touch> touches_at_surfaces_;
  std::vector<double> margins_, left_out_;  // per pair
  std::vector<char> flush_pair_;            // per pair
  std::vector<LooseSpring> loose_;
  std::vector<PairWatch> watches_;  // per pair, while skins are followed
  bool carried_ = false;
  bool at_start_ = true;  // the touches are those of the state that the memory belongs to
};

}  // namespace talus::coupling
