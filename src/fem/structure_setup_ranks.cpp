// A structure on several ranks: what each holds and computes.
#include <algorithm>

#include "contact/structures/refinable.hpp"
#include "core/error.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/structure_setup.hpp"

namespace talus::fem {

namespace {

constexpr std::size_t least_cells = 256;  // per rank; a smaller structure is computed whole by every rank

bool worth_dividing(const HexMesh& mesh) {
  return ranks() != nullptr && mesh.hexes.size() >= least_cells * static_cast<std::size_t>(ranks()->size());
}

}  // namespace

/// Whether each rank can hold its own part alone: nothing is factored, and nothing reaches over the parts.
bool StructureSetup::divides_memory(const HexMesh& whole) const {
  if (!worth_dividing(whole) || !body_.struck_zones.empty() || impact_refinement(body_.spec).cell_size > 0 ||
      (refines_locally(body_.spec) && !body_.spec.refinements.empty()))
    return false;
  long free = 0;
  for (const auto& held : body_.supports.held) free += 3 - (held[0] + held[1] + held[2]);
  const bool explicit_alone =
      body_.spec.integrator == "explicit" || body_.supports.none || free > largest_factored_system;
  // Smaller ones are brought to rest, and their first frequency found, by factors.
  const bool no_statics = body_.supports.none || (!(body_.spec.damping_ratio > 0) &&
                                                  !(body_.spec.gravity_preload && body_.gravity.norm() > 0));
  return explicit_alone && (no_statics || free > largest_factored_system);
}

void StructureSetup::make_partition(const HexMesh& whole, bool everywhere) {
  body_.partition =
      std::make_unique<Partition>(whole, body_.bearings ? body_.bearings->cells() : std::vector<int>{},
                                  std::vector<double>(whole.nodes.size(), 1.0), everywhere, *ranks());
}

/// Keeps of the whole mesh, of which supports, probes, members and feet are known, this rank's part.
void StructureSetup::take_part(HexMesh&& whole) {
  make_partition(whole, false);
  const Partition& part = *body_.partition;
  Supports all = std::move(body_.supports);
  body_.supports = {{}, part.nodes_here(all.nodes), all.centroid, all.none};
  loads_.take_part(all.nodes);
  const std::vector<ElementOperator::Lane> lanes = ElementOperator::lanes_of(whole);
  const auto around = body_.bars ? body_.bars->surroundings(part, whole) : nullptr;
  HexMesh mine = part.part_of(whole);
  std::vector<ElementOperator::Lane> lanes_here;
  for (std::size_t cell = 0; cell < mine.hexes.size(); ++cell)
    lanes_here.push_back(lanes[static_cast<std::size_t>(part.whole_cell(static_cast<int>(cell)))]);
  for (std::size_t n = 0; n < mine.nodes.size(); ++n)
    body_.supports.held.push_back(all.held[static_cast<std::size_t>(part.whole_node(static_cast<int>(n)))]);
  whole = HexMesh{};
  body_.discretisation.reinit(std::move(mine));
  body_.discretisation.forget_cells();
  body_.elements = std::make_unique<ElementOperator>(body_.mesh, body_.shear, body_.bulk,
                                                     body_.spec.damage != "none", lanes_here);
  body_.elements->restrict_to(part.local_cells());
  body_.elements->count_only(part.own_cells());
  if (body_.bars) body_.bars->divide(*body_.partition, body_.mesh, around);
  if (body_.bearings) body_.bearings->divide(*body_.partition, body_.mesh);
  body_.own = part.own_nodes();
}

/// Divides the work of a structure that every rank holds whole.
void StructureSetup::divide() {
  if (body_.divided()) return skin_.watch();  // its masses are known now
  if (!body_.mesh.hanging.empty() || !worth_dividing(body_.mesh)) return;
  make_partition(body_.mesh, true);
  body_.own = body_.partition->own_nodes();
  body_.elements->restrict_to(body_.partition->local_cells());
  body_.elements->count_only(body_.partition->own_cells());
  if (body_.bars) {
    body_.bars->divide(*body_.partition, body_.mesh, body_.bars->surroundings(*body_.partition, body_.mesh));
    loads_.find_segments();
  }
  std::vector<char> touched(body_.mesh.nodes.size(), 0);
  body_.mark_nodes(touched);
  body_.touched = ranges_of(touched);
  if (body_.damage) body_.damage->restrict_to(*body_.partition);
  skin_.watch();
}

}  // namespace talus::fem
