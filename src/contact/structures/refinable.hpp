/// A structure whose cells can be halved in the middle of a run, where a block is about to strike it; of its
/// specification, what the scene asks for.
#pragma once
#include <memory>
#include <span>

#include "contact/structures/structure.hpp"

namespace talus {

/// [[structure.refine]] where = "impact": edge of the cells, 0: nothing is halved, and how far around the
/// first contact, 0: by the block's size [m].
struct ImpactRefinement {
  double cell_size = 0, reach = 0;
  static constexpr const char *size_key = "impact_cell_size",
                              *reach_key = "impact_reach";  // of StructureSpec::parameters
};

inline ImpactRefinement impact_refinement(const StructureSpec& spec) {
  ImpactRefinement found;
  for (const auto& [name, value] : spec.parameters) {
    if (name == ImpactRefinement::size_key) found.cell_size = value;
    if (name == ImpactRefinement::reach_key) found.reach = value;
  }
  return found;
}

class RefinableStructure {
 public:
  virtual ~RefinableStructure() = default;
  /// Whether cells may still be halved.
  virtual bool refinable() const = 0;
  /// Boxes about the cells, as built, that stay as they are: those that have cracked or are gone. Each is a
  /// zone of cell size 0 in the lists below: from there on in the list its cell is not halved.
  virtual std::vector<Box3> kept_cells() const = 0;
  /// Whether any of its cells in the zones is larger than asked for, and may be halved.
  virtual bool larger_cells(std::span<const StructureSpec::Refinement> zones) const = 0;
  /// The same structure in the same motion with finer cells in all of `zones`, those it has been given before
  /// among them, in their order: u and v are interpolated; the state at rest under the permanent load is the
  /// finer mesh's own; cells that have cracked keep their histories, bars their states, what has gone stays
  /// gone. Linear momentum is kept, and the energy that the motion differs by is in
  /// StructureEnergy::algorithmic. Null if no cell there is larger than asked for.
  virtual std::unique_ptr<Structure> refined(std::span<const StructureSpec::Refinement> zones) = 0;
  /// Elastic and gravity energy of the state at rest [J].
  virtual double permanent_energy() const = 0;
};

}  // namespace talus
