// A structure on several ranks: what each holds and computes, and what it must hear from the others before it
// tells of the whole.
#include <algorithm>

#include "core/error.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {

constexpr std::size_t least_cells = 256;  // per rank; a smaller structure is computed whole by every rank

bool worth_dividing(const HexMesh& mesh) {
  return ranks() != nullptr && mesh.hexes.size() >= least_cells * static_cast<std::size_t>(ranks()->size());
}

}  // namespace

/// Whether each rank can hold its own part alone: nothing is factored, and nothing reaches over the parts.
bool FemStructure::divides_memory(const HexMesh& whole) const {
  if (!worth_dividing(whole) || !struck_zones_.empty() || impact_refinement(spec_).cell_size > 0 ||
      (refines_locally(spec_) && !spec_.refinements.empty()))
    return false;
  long free = 0;
  for (const auto& held : supports_.held) free += 3 - (held[0] + held[1] + held[2]);
  const bool explicit_alone =
      spec_.integrator == "explicit" || supports_.none || free > largest_factored_system;
  // Smaller ones are brought to rest, and their first frequency found, by factors.
  const bool no_statics =
      supports_.none || (!(spec_.damping_ratio > 0) && !(spec_.gravity_preload && gravity_.norm() > 0));
  return explicit_alone && (no_statics || free > largest_factored_system);
}

void FemStructure::make_partition(const HexMesh& whole, bool everywhere) {
  partition_ =
      std::make_unique<Partition>(whole, bearings_ ? bearings_->cells() : std::vector<int>{},
                                  std::vector<double>(whole.nodes.size(), 1.0), everywhere, *ranks());
}

/// Keeps of the whole mesh, of which supports, probes, members and feet are known, this rank's part.
void FemStructure::take_part(HexMesh&& whole) {
  make_partition(whole, false);
  const Partition& part = *partition_;
  Supports all = std::move(supports_);
  supports_ = {{}, part.nodes_here(all.nodes), all.centroid, all.none};
  std::vector<int> feet;
  for (std::size_t i = 0; i < all.nodes.size(); ++i)
    if (part.node_here(all.nodes[i]) >= 0 && !foot_of_.empty()) feet.push_back(foot_of_[i]);
  foot_of_ = std::move(feet);
  const std::vector<ElementOperator::Lane> lanes = ElementOperator::lanes_of(whole);
  const auto around = bars_ ? bars_->surroundings(part, whole) : nullptr;
  HexMesh mine = part.part_of(whole);
  std::vector<ElementOperator::Lane> lanes_here;
  for (std::size_t cell = 0; cell < mine.hexes.size(); ++cell)
    lanes_here.push_back(lanes[static_cast<std::size_t>(part.whole_cell(static_cast<int>(cell)))]);
  for (std::size_t n = 0; n < mine.nodes.size(); ++n)
    supports_.held.push_back(all.held[static_cast<std::size_t>(part.whole_node(static_cast<int>(n)))]);
  for (MemberPlace& m : member_places_) {
    m.place.cells = part.cells_here(m.place.cells);
    for (std::vector<int>* nodes : {&m.place.foot, &m.place.top}) *nodes = part.nodes_here(*nodes);
    for (Cut& cut : m.place.cuts) {
      cut.cells = part.cells_here(cut.cells);
      for (std::vector<int>* nodes : {&cut.nodes, &cut.above}) *nodes = part.nodes_here(*nodes);
    }
  }
  whole = HexMesh{};
  discretisation_.reinit(std::move(mine));
  discretisation_.forget_cells();
  operator_ = std::make_unique<ElementOperator>(mesh_, shear_, bulk_, spec_.damage != "none", lanes_here);
  operator_->restrict_to(part.local_cells());
  operator_->count_only(part.own_cells());
  if (bars_) bars_->divide(*partition_, mesh_, around);
  if (bearings_) bearings_->divide(*partition_, mesh_);
  own_ = part.own_nodes();
}

/// Divides the work of a structure that every rank holds whole.
void FemStructure::divide() {
  if (divided()) return watch();  // its masses are known now
  if (!mesh_.hanging.empty() || !worth_dividing(mesh_)) return;
  make_partition(mesh_, true);
  own_ = partition_->own_nodes();
  operator_->restrict_to(partition_->local_cells());
  operator_->count_only(partition_->own_cells());
  std::vector<char> touched(mesh_.nodes.size(), 0);
  operator_->mark_nodes(touched);
  if (bars_) {
    bars_->divide(*partition_, mesh_, bars_->surroundings(*partition_, mesh_));
    find_segments();
    bars_->mark_nodes(touched);
  }
  if (bearings_)
    for (int node : bearings_->nodes()) touched[node] = 1;
  touched_ = ranges_of(touched);
  if (damage_) damage_->restrict_to(*partition_);
  watch();
}

void FemStructure::watch() {
  std::vector<int> nodes = skin_node_;
  for (const TriangleSurface::NodeWeights& w :
       surface_.nodes)  // those that hanging ones follow may lie within
    nodes.insert(nodes.end(), w.node.begin(), w.node.begin() + w.count);
  for (const ProbePoint& p : probes_) nodes.insert(nodes.end(), p.node.begin(), p.node.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  watched_ = WatchedNodes(std::move(nodes), *partition_);
  AlignedVector reference(4 * mesh_.nodes.size()), rest(reference.size());
  for (std::size_t n = 0; n < mesh_.nodes.size(); ++n) {
    std::copy_n(mesh_.nodes[n].data(), 3, &reference[4 * n]);
    const auto& held = supports_.held[n];
    rest[4 * n] = mass_.empty() ? 0.0 : mass_[n], rest[4 * n + 1] = held[0] + 2 * held[1] + 4 * held[2];
  }
  const std::array<const AlignedVector*, 2> fields{&reference, &rest};
  watched_.gather(fields, seen_.built);
  skin_shared_ = false;
}

long FemStructure::count_of(long count) const {
  auto value = static_cast<double>(count);
  sum({&value, 1});
  return static_cast<long>(value);
}

void FemStructure::sum(std::span<double> values) const {
  if (partition_) partition_->sum(values);
}

double FemStructure::largest(double value) const { return partition_ ? partition_->largest(value) : value; }

void FemStructure::motion_changed() { skin_shared_ = prediction_shared_ = !partition_; }

// What is seen from outside is whole for whoever asks; which numbers have already been fetched is not part of
// the state.
const double* FemStructure::seen(int node) const {
  if (!skin_shared_) {
    const std::array<const AlignedVector*, 2> fields{&u_, &v_};
    watched_.gather(fields, seen_.motion);
    skin_shared_ = true;
  }
  return &seen_.motion[6 * seen_place(node)];
}

std::size_t FemStructure::seen_place(int node) const {
  const int place = watched_.place(node);
  if (place < 0)
    throw NumericalFailure("structure " + spec_.name + ": a node was asked for that is not on its surface");
  return static_cast<std::size_t>(place);
}

void FemStructure::share_prediction() const {
  if (prediction_shared_) return;
  const AlignedVector* const field = &v_hat_;
  watched_.gather({&field, 1}, seen_.prediction);
  prediction_shared_ = true;
}

/// u_, v_ everywhere, of a structure that every rank holds whole.
void FemStructure::share_motion() {
  if (!partition_) return;
  const std::array<AlignedVector*, 2> fields{&u_, &v_};
  partition_->gather(fields);
}

std::vector<std::pair<std::string, std::size_t>> FemStructure::memory_consumption() const {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  std::size_t fields = of(mass_) + of(built_mass_) + of(cells_at_node_) + of(live_) + of(cell_mass_) +
                       of(shortest_edge_) + of(supports_.held) + of(dofs_.number);
  for (const AlignedVector* field :
       {&u_, &v_, &f_int_, &f_visc_, &f_ext_, &v_hat_, &inverse_mass_, &contact_impulse_, &jump_})
    fields += of(*field);
  std::size_t elements = operator_->memory_consumption();
  for (const MemberPlace& m : member_places_)
    for (const ElementPack& pack : m.cut_packs) elements += pack.memory_consumption();
  const std::size_t skin = of(skin_) + of(skin_node_) + of(surface_.vertices) + of(surface_.velocities) +
                           of(surface_.triangles) + of(surface_.parent_face) + of(surface_.nodes) +
                           watched_.memory_consumption() + of(seen_.built) + of(seen_.motion) +
                           of(seen_.prediction);
  return {{"mesh", of(mesh_.nodes) + of(mesh_.local) + of(mesh_.hexes) + of(mesh_.across) +
                       of(mesh_.component) + of(mesh_.number)},
          {"fields", fields},
          {"elements", elements},
          {"damage", damage_ ? damage_->memory_consumption() : 0},
          {"bars", bars_ ? bars_->memory_consumption() : 0},
          {"skin", skin},
          {"partition", partition_ ? partition_->memory_consumption() : 0}};
}

std::vector<int> FemStructure::joined(const std::vector<int>& cells) const {
  std::vector<int> all = cells;
  if (partition_) {
    std::vector<double> mine;
    for (const int cell : cells) mine.push_back(partition_->whole_cell(cell));
    const std::vector<double> values = partition_->collect(mine);
    all.assign(values.begin(), values.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace talus::fem
