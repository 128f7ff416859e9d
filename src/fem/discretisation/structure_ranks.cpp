// A structure on several ranks: what each computes, and what it must hear from the others before it tells of the whole.
#include <algorithm>

#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr std::size_t least_cells = 256;   // per rank; a smaller structure is computed whole by every rank
}

void FemStructure::divide() {
  Ranks* const all = ranks();
  if (all == nullptr || !mesh_.hanging.empty() || mesh_.hexes.size() < least_cells * static_cast<std::size_t>(all->size())) return;
  const std::size_t n = mesh_.nodes.size();
  const std::vector<double> cost(n, 1.0);
  partition_ = std::make_unique<Partition>(mesh_, bearings_ ? bearings_->nodes() : std::vector<int>{}, cost, *all);
  own_ = partition_->own_nodes();
  operator_->restrict_to(partition_->local_cells(), partition_->own_cells());
  std::vector<char> touched(n, 0);
  operator_->mark_nodes(touched);
  if (bars_) {
    bars_->divide(*partition_);
    bars_->mark_nodes(touched);
  }
  if (bearings_)
    for (int node : bearings_->nodes()) touched[node] = 1;
  touched_ = ranges_of(touched);
  if (damage_) {
    std::vector<double> state;
    damage_->save(state);
    all_damage_ = make_damage_field(spec_.damage, mesh_, *concrete_, spec_.rate_effect, finite_, {}, "");
    all_damage_->restore(state);
    damage_->restrict_to(partition_->local_cells(), partition_->own_cells());
  }
  watch();
}

void FemStructure::watch() {
  watched_ = skin_node_;
  for (const ProbePoint& p : probes_) watched_.insert(watched_.end(), p.node.begin(), p.node.end());
  std::sort(watched_.begin(), watched_.end());
  watched_.erase(std::unique(watched_.begin(), watched_.end()), watched_.end());
  skin_shared_ = motion_shared_;
}

void FemStructure::sum(std::span<double> values) const {
  if (partition_) partition_->sum(values);
}

double FemStructure::largest(double value) const { return partition_ ? partition_->largest(value) : value; }

void FemStructure::motion_changed() { skin_shared_ = prediction_shared_ = motion_shared_ = bars_shared_ = damage_shared_ = !partition_; }

// The fields are whole for whoever reads them; which numbers have already been fetched is not part of the state.
void FemStructure::share_skin() const {
  if (skin_shared_) return;
  auto& self = const_cast<FemStructure&>(*this);
  const std::array<AlignedVector*, 2> fields{&self.u_, &self.v_};
  partition_->gather(fields, watched_);
  skin_shared_ = true;
}

void FemStructure::share_prediction() const {
  if (prediction_shared_) return;
  AlignedVector* const field = &const_cast<FemStructure&>(*this).v_hat_;
  partition_->gather({&field, 1}, watched_);
  prediction_shared_ = true;
}

void FemStructure::share_motion() const {
  if (motion_shared_) return;
  auto& self = const_cast<FemStructure&>(*this);
  const std::array<AlignedVector*, 2> fields{&self.u_, &self.v_};
  std::vector<int> nodes(mesh_.nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = static_cast<int>(i);
  partition_->gather(fields, nodes);
  motion_shared_ = skin_shared_ = true;
}

void FemStructure::share_bars() const {
  if (bars_shared_) return;
  if (bars_) bars_->share_states();
  bars_shared_ = true;
}

const DamageField& FemStructure::history() const {
  if (!partition_) return *damage_;
  if (!damage_shared_) {
    std::vector<double> records;
    damage_->save_records(records);
    all_damage_->restore(damage_->state_of(partition_->collect(records)));
    damage_shared_ = true;
  }
  return *all_damage_;
}

std::vector<int> FemStructure::joined(const std::vector<int>& cells) const {
  std::vector<int> all = cells;
  if (partition_) {
    const std::vector<double> mine(cells.begin(), cells.end()), values = partition_->collect(mine);
    all.assign(values.begin(), values.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<double> FemStructure::cell_energies(const std::vector<int>& cells) const {
  std::vector<double> energy;
  for (int cell : cells) energy.push_back(own_cell(cell) ? cell_energy(cell) : 0.0);
  sum(energy);
  return energy;
}

}  // namespace talus::fem
