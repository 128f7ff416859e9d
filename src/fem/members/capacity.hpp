/// What the piers of a structure can carry from its present state, which is kept: by tests of copies, and by
/// sections.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "fem/members/member_loads.hpp"

namespace talus::fem {

class FemStructure;

class CapacityTests : public MemberCapacity {
 public:
  explicit CapacityTests(const FemStructure& whole);

  std::vector<PushDown> push_down() override;
  std::vector<PushDown> push_over() override;
  std::vector<SectionResistance> section_resistances() const override;

 private:
  std::size_t pier_count() const;  // of the members: they come first
  void needs_piers() const;
  bool unharmed(const PierPlace& place) const;  // no cell of it is gone or has a history
  std::unique_ptr<FemStructure> cut_out(const PierPlace& place, bool top_held) const;
  double weight_of(const PierPlace& place, const Vec3& axis) const;
  double bending_period(std::size_t member, double root) const;
  PushDown push_down(std::size_t member) const;
  PushDown push_over(std::size_t member, int axis) const;

  const FemStructure& whole_;
  const StructureBody& body_;
  const MemberLoads& loads_;
  std::vector<std::optional<PushDown>> unharmed_;  // by member: what it carried while it was unharmed
};

}  // namespace talus::fem
