/// What the steps of one island need besides the system: private to it.
#pragma once
#include <atomic>
#include <span>
#include <vector>

#include "coupling/system/system.hpp"

namespace talus::coupling {

struct CoupledSystem::IslandRun {
  IslandIntegrator& integrator;
  const std::atomic<int>* stop;
  std::span<const double> rows;
};

/// A block as a stretch began.
struct CoupledSystem::Began {
  dda::BlockState state;
  double slid = 0, step = 0;
  std::vector<ContactMemory> contacts;
};

}  // namespace talus::coupling
