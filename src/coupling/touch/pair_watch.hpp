/// What the last search of a pair found, for as long as its bodies have not left what was searched. Sub-steps
/// of a structure are a thousand times shorter than the motion that changes what touches what.
///
/// A search about poses P reaches a slack beyond the margin that is asked for. While no point of the two has
/// moved against the other by more than the slack, nothing else can have come within the margin. What was
/// found goes along with its bodies: gaps are right to second order in that motion, which for a pair that
/// touches is kept below carried_way of the smaller radius, the error of a gap so below its square.
#pragma once
#include <cstdint>
#include <vector>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {

class PairWatch {
 public:
  /// The pair's points within `margin` now; searched anew where the last search does not tell. `reach`: how
  /// far the bodies may come in the next step; `skin_path`: bound on how far any vertex of the skins has
  /// moved since the watch began [m].
  void look(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&, double margin,
            double reach, double skin_path, std::vector<FoundPoint>& out);
  void forget() { searched_ = -1; }
  /// Which pairs it is for: hard contact, and no bed. The energy of a spring is sensitive to round-off of its
  /// gap.
  static bool serves(const dda::Model&, const Environment&, const CandidatePair&);

 private:
  struct Kept {
    FoundPoint found;
    Vec3 weight, beside;  // of a skin: barycentric on its triangle, and where the point lies from there [m]
  };
  double moved(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&) const;
  double own_way(const dda::Model&, const dda::State&, int block) const;
  void search(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&, double margin,
              double reach, double skin_path);
  void carry(const dda::State&, const Environment&, const CandidatePair&, double margin,
             std::vector<FoundPoint>& out) const;

  double searched_ = -1;  // margin of the last search [m]; negative: none
  double least_ = 0;      // least gap that it found, its margin where it found none [m]
  Pose a_, b_;            // then
  std::vector<Kept> points_;
  std::vector<int> vertex_;  // of the skin, near the block
  std::vector<Vec3> place_;  // where they were
  double skin_path_ = 0,
         skin_slack_ = 0;       // vertices farther off are not looked at before they can have come so far [m]
  std::uint64_t revision_ = 0;  // of the skin
};

}  // namespace talus::coupling
