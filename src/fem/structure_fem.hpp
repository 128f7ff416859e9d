/// The finite-element structure behind talus::Structure.
#pragma once
#include <memory>
#include <optional>

#include "contact/structures/divided.hpp"
#include "contact/structures/refinable.hpp"
#include "contact/structures/structure.hpp"
#include "fem/integrators/condensed_motion.hpp"
#include "fem/integrators/permanent_load.hpp"
#include "fem/members/capacity.hpp"

namespace talus::fem {

class FemStructure : public Structure, public RefinableStructure, public DividedStructure {
 public:
  using Zones = std::vector<StructureSpec::Refinement>;
  /// `before`: the same structure with larger cells, whose first frequency it takes. `struck`: where its
  /// cells are halved beyond what the specification asks for.
  FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck = {},
               const FemStructure* before = nullptr);

  const TriangleSurface& surface() const override { return skin_.surface(); }
  double node_mass(int node) const override { return skin_.node_mass(node); }
  Vec3 node_position(int node) const override { return skin_.node_position(node); }
  Vec3 node_built(int node) const override { return skin_.node_built(node); }
  Vec3 node_velocity(int node) const override { return skin_.node_velocity(node); }
  std::array<bool, 3> node_held(int node) const override { return skin_.node_held(node); }

  double young() const override { return body_.spec.young; }
  double critical_step() const override { return body_.critical_step; }
  void predict(double t, double h) override {
    modal_.leave();
    leapfrog_.predict(t, h);
  }
  Vec3 predicted_velocity(int node) const override { return skin_.predicted_velocity(node); }
  void correct(double t, double h, std::span<const NodeImpulse> impulses) override {
    leapfrog_.correct(t, h, impulses);
  }
  std::string advance_alone(double t, double duration) override;

  double condensed_step(double t, double accuracy) override {
    return condensed_.longest_step(t, accuracy, accuracy);
  }
  bool condensed_by_choice() const override { return condensed_.by_choice(); }
  void predict_condensed(double t, double h) override;
  MatX compliance(std::span<const int> nodes) override { return factors_.compliance(nodes); }
  bool correct_condensed(double t, double h, std::span<const NodeImpulse> impulses) override {
    return condensed_.correct(t, h, impulses);
  }
  void undo_condensed() override;
  bool may_begin(double t, double h, double accuracy) override {
    return condensed_.may_begin(t, h, accuracy);
  }
  void struck(double t) override { condensed_.struck(t); }

  bool quiet() const override;
  StructureEnergy energy() const override { return energy_.total(); }
  Vec3 base_force() const override;
  Vec3 base_moment() const override;
  std::vector<Vec3> probe_displacements() const override { return skin_.probe_displacements(); }
  double damage_max() const override;
  double damaged_volume() const override;
  double spalled_volume() const override { return body_.lost.eroded_volume + body_.lost.detached_volume; }
  const std::vector<Member>& members() const override { return loads_.members(); }
  std::vector<MemberState> member_states() const override { return loads_.states(); }
  LoadPeaks load_peaks() const override { return loads_.track().peaks(); }
  std::vector<PushDown> push_down() const override { return capacity_.push_down(); }
  std::vector<PushDown> push_over() const override { return capacity_.push_over(); }
  std::vector<SectionResistance> section_resistances() const override {
    return capacity_.section_resistances();
  }
  std::vector<BarLine> bars() const override;
  long dofs() const override { return body_.free_dofs; }
  long elements() const override;
  double memory_of_steps(double duration) override { return modal_.memory(duration); }
  std::string plan() const override;
  std::vector<Fragment> take_fragments() override { return fracture_.take_fragments(); }
  Unsupported unsupported() override { return fracture_.unsupported(); }
  void save(std::vector<double>& state) const override { save(state, false); }
  void restore(std::span<const double> state) override { restore(state, false); }
  void save_here(std::vector<double>& state) const override { save(state, true); }
  void restore_here(std::span<const double> state) override { restore(state, true); }
  void start_over() override;
  Vec6 permanent_reaction() const override { return loads_.track().permanent(); }
  void shape(const TakePart& take) const override;
  void values(const TakePart& take) const override;
  bool refinable() const override;
  std::unique_ptr<Structure> refined(std::span<const StructureSpec::Refinement> zones) override;
  double permanent_energy() const override { return permanent_.energy; }

  /// For tests and verification: the mesh, the fundamental circular frequencies [rad/s], and the internal
  /// force.
  const HexMesh& mesh() const { return body_.mesh; }
  const AlignedVector& displacement() const { return fields_.u; }
  std::vector<double> frequencies(int count);
  /// What its tables and fields take on this process [bytes], by name.
  std::vector<std::pair<std::string, std::size_t>> memory_consumption() const;

 private:
  void predict_condensed(double t, double h, bool smoothed);
  bool ring_on(double t, double duration);
  bool undisturbed(double t, double duration) const;  // at rest, and no load changes until t + duration
  double settling_time() const;  // for which kinetic energy has to stay small to mean rest [s]
  void take_over(FemStructure& before);
  void save(std::vector<double>& state, bool here) const;
  void restore(std::span<const double> state, bool here);
  void restore_cells(StateReader& state, bool here);

  StructureBody body_;
  NodalFields fields_{body_.mesh};
  mutable Forces forces_{body_, fields_};  // found when they are asked for
  EnergyAccount energy_{body_, fields_, forces_};
  ContactSurface skin_{body_, fields_};
  MemberLoads loads_{body_, fields_, forces_};
  Fracture fracture_{body_, fields_, forces_, energy_, skin_, loads_.stresses()};
  Leapfrog leapfrog_{body_, fields_, forces_, energy_, loads_, fracture_};
  mutable CapacityTests capacity_{*this};  // keeps what it found
  friend CapacityTests;
  CondensedFactors factors_{body_, loads_.stresses()};
  ModalMotion modal_{body_, fields_, forces_, energy_, loads_, leapfrog_, factors_};
  CondensedMotion condensed_{body_, fields_, forces_, energy_, loads_, leapfrog_, factors_, modal_};
  PermanentLoad permanent_{body_, fields_, forces_, energy_, loads_};
  std::vector<double> before_;  // state at the start of the condensed step at hand
};

}  // namespace talus::fem
