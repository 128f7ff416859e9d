/// What the members and feet of a structure carry: sectional forces, drift, reactions, and the greatest of
/// them and of the displacements of probes so far.
#pragma once
#include "fem/integrators/forces.hpp"
#include "fem/members/load_track.hpp"
#include "fem/members/members.hpp"
#include "fem/members/stresses.hpp"

namespace talus::fem {

class MemberLoads : public StructureLoads {
 public:
  struct Place {
    Pier pier;
    PierPlace place;
    std::vector<int> segments;
    std::vector<std::vector<int>> layer_segments;  // of the layers of all cuts, one after the other
    std::vector<ElementPack> layer_packs;
    int deck = -1;
  };
  MemberLoads(const StructureBody& body, const NodalFields& fields, Forces& forces)
      : body_(body), fields_(fields), forces_(forces) {}

  /// Of members and feet.
  void find_places(const HexMesh& whole);
  void find_feet(const HexMesh& whole);
  /// Keeps what lies in this rank's part; `supported`: nodes of the whole mesh.
  void take_part(const std::vector<int>& supported);
  /// Once cells and bars are there.
  void complete();
  void find_segments();  // of members and their cuts
  void probe(std::vector<ProbePoint> points) { probes_ = std::move(points); }
  void begin();
  void begin_again();
  void watch(double t, double h);  // of the step that has come to t, its impulses in place
  void watch_probes(double t);     // as displaced at t
  void watch_stress(double t);     // of elastic concrete
  /// What the forces as they stand, without contact, make feet and members carry: reactions as
  /// foot_reactions(0), section forces, drifts, displacements of probes, one after the other.
  VecX carried() const;
  /// The first of them, which are forces; the others are displacements.
  long forces_carried() const;
  /// Of a step of `duration` that ends at t: mean forces, displacements at its end, as carried().
  void carry(double t, double duration, Eigen::Ref<const VecX> mean);
  void displace(double t, Eigen::Ref<const VecX> end);

  const std::vector<Member>& members() const override { return members_; }
  const Place& place(std::size_t member) const { return places_[member]; }
  const std::vector<MemberState>& states() const override;
  const LoadPeaks& peaks() const override { return track_.peaks(); }
  Vec3 base_force() const override { return present_reaction().head<3>(); }
  Vec3 base_moment() const override { return present_reaction().tail<3>(); }
  Vec6 permanent_reaction() const override { return track_.permanent(); }
  /// Force and moment on the supports by the forces as they stand, contact impulses over `step` among them,
  /// 0: without; then for each foot the moment on it about its centroid.
  std::vector<double> foot_reactions(double step) const;
  const LoadTrack& track() const { return track_; }
  LoadTrack& track() { return track_; }
  const Stresses& stresses() const { return stresses_; }
  std::size_t memory_of_packs() const;  // [bytes]

 private:
  Vec6 present_reaction() const;
  std::vector<Vec3> displaced_probes() const;
  std::vector<MemberState> find_states(bool widths) const;
  MemberState state(std::size_t member, AlignedVector& force, bool widths) const;
  /// Force and moment about `centre` that the part above hands down through a layer, of this rank's cells.
  Vec6 handed_down(Place& m, std::size_t layer_of_all, const Layer& layer, const Vec3& centre,
                   AlignedVector& force) const;
  std::vector<double> sums_over(const std::vector<const std::vector<int>*>& lists) const;

  const StructureBody& body_;
  const NodalFields& fields_;
  Forces& forces_;
  Stresses stresses_{body_, fields_};
  LoadTrack track_;
  std::vector<Member> members_;
  mutable std::vector<Place> places_;        // which lanes of their packs count is set for every use
  mutable std::vector<MemberState> states_;  // of a revision of the fields
  mutable long states_of_ = -1;
  std::vector<ProbePoint> probes_;
  std::vector<int> foot_of_;  // of each supported node, as Supports::nodes
  std::vector<Vec3> foot_centroid_;
};

}  // namespace talus::fem
