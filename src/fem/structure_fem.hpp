/// The finite-element structure behind talus::Structure.
#pragma once
#include <memory>
#include <optional>

#include "contact/structures/refinable.hpp"
#include "contact/structures/structure.hpp"
#include "fem/integrators/integrators.hpp"
#include "fem/integrators/permanent_load.hpp"
#include "fem/members/capacity.hpp"

namespace talus::fem {

class FemStructure : public Structure, public RefinableStructure {
 public:
  using Zones = std::vector<StructureSpec::Refinement>;
  /// `before`: the same structure with larger cells, whose first frequency it takes. `struck`: where its
  /// cells are halved beyond what the specification asks for.
  FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck = {},
               const FemStructure* before = nullptr);

  const StructureSkin& skin() const override { return skin_; }
  const StructureLoads& loads() const override { return loads_; }
  CondensedSteps& condensed() override { return motion_.condensed; }
  MemberCapacity& capacity() override { return capacity_; }

  double critical_step() const override { return body_.critical_step; }
  void predict(double t, double h) override {
    motion_.modal.leave();
    motion_.leapfrog.predict(t, h);
  }
  void correct(double t, double h, std::span<const NodeImpulse> impulses) override {
    motion_.leapfrog.correct(t, h, impulses);
  }
  std::string advance_alone(double t, double duration) override { return motion_.advance_alone(t, duration); }
  bool quiet() const override { return motion_.quiet(); }
  bool free() const override { return body_.supports.none; }
  StructureEnergy energy() const override { return energy_.total(); }
  Damage damage() const override;
  std::vector<BarLine> bars() const override;
  long dofs() const override { return body_.free_dofs; }
  long elements() const override;
  double memory_of_steps(double duration) const override { return motion_.modal.memory(duration); }
  std::string plan() const override;
  std::vector<Fragment> take_fragments() override { return fracture_.take_fragments(); }
  Unsupported unsupported() override { return fracture_.unsupported(); }
  void start_over() override;
  void shape(const TakePart& take) const override;
  void values(const TakePart& take) const override;
  bool refinable() const override;
  std::vector<Box3> kept_cells() const override;
  bool larger_cells(std::span<const StructureSpec::Refinement> zones) const override;
  std::unique_ptr<Structure> refined(std::span<const StructureSpec::Refinement> zones) override;
  double permanent_energy() const override { return permanent_.energy; }

  /// For tests and verification: the mesh, and the fundamental circular frequencies [rad/s].
  const HexMesh& mesh() const { return body_.mesh; }
  std::vector<double> frequencies(int count);

 private:
  bool harmed() const;
  bool stays(int cell) const;  // of one that is harmed: as it is, whatever is asked for
  void take_over(FemStructure& before);
  void take_harm(const FemStructure& before);
  void write(std::vector<double>& state, bool here) const override;
  void read(std::span<const double> state, bool here) override;

  StructureBody body_;
  NodalFields fields_{body_.mesh};
  mutable Forces forces_{body_, fields_};  // found when they are asked for
  EnergyAccount energy_{body_, fields_, forces_};
  ContactSurface skin_{body_, fields_};
  MemberLoads loads_{body_, fields_, forces_};
  Fracture fracture_{body_, fields_, forces_, energy_, skin_, loads_.stresses()};
  Integrators motion_{*this, {body_, fields_, forces_, energy_, loads_}, fracture_};
  PermanentLoad permanent_{{body_, fields_, forces_, energy_, loads_}};
  CapacityTests capacity_{*this};
  friend CapacityTests;
};

}  // namespace talus::fem
