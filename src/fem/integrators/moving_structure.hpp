/// What an integrator moves: the structure, its motion and forces, and who keeps account of it.
#pragma once
#include "fem/integrators/energy_account.hpp"
#include "fem/members/member_loads.hpp"

namespace talus::fem {

struct MovingStructure {
  StructureBody& body_;
  NodalFields& fields_;
  Forces& forces_;
  EnergyAccount& energy_;
  MemberLoads& loads_;
};

}  // namespace talus::fem
