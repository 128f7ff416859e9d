#include "contact/linear/solver_order.hpp"

#include <bit>
#include <numeric>

#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

/// Per body those that it shares contacts with, once for every run of its contacts with the same one.
void VisitingOrder::list_neighbours(const System& system) {
  first_neighbour_.assign(1, 0);
  neighbours_.clear();
  for (int b = 0; b < static_cast<int>(system.body.size()); ++b) {
    for (int e = system.first_of_body[b]; e < system.first_of_body[b + 1]; ++e) {
      const Touch& t = system.touch[system.of_body[e].contact];
      for (int k = t.first; k < t.first + t.count; ++k) {
        const int other = system.terms[k].body;
        const bool again =
            static_cast<int>(neighbours_.size()) > first_neighbour_.back() && neighbours_.back() == other;
        if (other != b && !again) neighbours_.push_back(other);
      }
    }
    first_neighbour_.push_back(static_cast<int>(neighbours_.size()));
  }
}

/// Orders a node's bodies by the number of contacts that lie between them and the start, which is one of
/// them.
void VisitingOrder::spread(std::span<int> bodies, int node, int start) {
  reached_.clear();
  std::size_t next = 0;
  const auto reach_from = [&](int body) {
    const auto reach = [&](int b) {
      if (node_[b] != node) return;
      node_[b] = -node;
      reached_.push_back(b);
    };
    for (reach(body); next < reached_.size(); ++next)
      for (int k = first_neighbour_[reached_[next]]; k < first_neighbour_[reached_[next] + 1]; ++k)
        reach(neighbours_[k]);
  };
  reach_from(start);
  for (const int b : bodies) reach_from(b);  // what no contacts lead to
  for (std::size_t k = 0; k < bodies.size(); ++k) node_[bodies[k] = reached_[k]] = node;
}

/// Parts a node's bodies in halves of as many contacts each, those of the one as near to each other as
/// contacts go, down to `parts` nodes.
void VisitingOrder::part(const System& system, std::span<int> bodies, int node, int parts) {
  if (node >= parts || bodies.empty()) return;
  spread(bodies, node, bodies.front());
  spread(bodies, node, bodies.back());  // from one end to the other
  const auto contacts_of = [&](int b) { return system.first_of_body[b + 1] - system.first_of_body[b]; };
  long all = 0, filled = 0;
  for (const int b : bodies) all += contacts_of(b);
  std::size_t half = 0;
  while (half < bodies.size() && 2 * filled < all) filled += contacts_of(bodies[half++]);
  for (std::size_t k = 0; k < bodies.size(); ++k) node_[bodies[k]] = 2 * node + (k < half ? 0 : 1);
  part(system, bodies.first(half), 2 * node, parts);
  part(system, bodies.subspan(half), 2 * node + 1, parts);
}

void VisitingOrder::find(const System& system) {
  const int nc = system.contacts();
  visits_.resize(nc);
  int parts = 1;
  while (nc >= 2 * parts * contacts_of_part) parts *= 2;
  if (parts == 1) {
    std::iota(visits_.begin(), visits_.end(), 0);
    groups_.assign(1, {0, nc});
    first_ = {0, 1};
    return;
  }
  bodies_.resize(system.body.size());
  std::iota(bodies_.begin(), bodies_.end(), 0);
  node_.assign(bodies_.size(), 1);
  list_neighbours(system);
  part(system, bodies_, 1, parts);
  // A contact belongs to the least node that holds its bodies; groups are the nodes, from the parts to the
  // root.
  group_of_.resize(nc);
  groups_.assign(2 * static_cast<std::size_t>(parts) - 1, {0, 0});
  for (int i = 0; i < nc; ++i) {
    const Touch& t = system.touch[i];
    int node = t.count > 0 ? node_[system.terms[t.first].body] : 1;
    for (int k = t.first + 1; k < t.first + t.count; ++k)
      for (int other = node_[system.terms[k].body]; node != other;) (node > other ? node : other) /= 2;
    const int of_level = static_cast<int>(std::bit_floor(static_cast<unsigned>(node)));  // as many nodes
    group_of_[i] = 2 * (parts - of_level) + node - of_level;
    ++groups_[group_of_[i]].second;
  }
  int begin = 0;
  for (auto& [from, to] : groups_) {
    const int count = to;
    from = to = begin;
    begin += count;
  }
  for (int i = 0; i < nc; ++i) visits_[groups_[group_of_[i]].second++] = i;
  first_.assign(1, 0);
  for (int of_level = parts; of_level > 0; of_level /= 2) first_.push_back(first_.back() + of_level);
}

}  // namespace talus::contact::detail
