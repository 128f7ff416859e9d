/// The hits of an ensemble on a structure, one for each member of the ensemble, in clusters of alike hits,
/// and the coupled runs that are drawn from them (fragility.hpp).
#pragma once
#include <cstdint>
#include <vector>

#include "contact/structures/structure.hpp"
#include "ensemble/member.hpp"

namespace talus::ensemble {

/// A member of the ensemble that hits the structure, by its strongest hit.
struct Event {
  std::int64_t member = 0;
  Hit hit;
  double energy = 0;     // of the translation just before [J]
  int struck = -1;       // member of the structure
  double height = 0;     // of the contact above the member's base, along its axis; without members its z [m]
  double direction = 0;  // of the velocity in plan, clockwise from north (+y) [rad]
};

struct Cluster {
  int struck = -1;
  std::vector<Event> events;  // by energy
  int runs = 0;               // coupled runs that it gets
};

/// A coupled run.
struct Task {
  int cluster = 0;
  int turn = 0;    // place among the runs of its cluster
  int serial = 0;  // of the runs of one event, which differ by their perturbation
  const Event* event = nullptr;
};

/// `members`: of the structure, in the order of its results.
Event event_of(std::int64_t member, const Hit& hit, const std::vector<talus::Member>& members);

/// The events by the member struck, then divided where they differ most as long as there are three runs a
/// cluster; runs in proportion to the root of the number of events, one each at least as far as they go.
std::vector<Cluster> cluster_events(const std::vector<Event>& events,
                                    const std::vector<talus::Member>& members, int runs);

/// The runs of all clusters, of events that chance takes; they point into `clusters`.
std::vector<Task> draw_tasks(const std::vector<Cluster>& clusters, std::uint32_t seed);

/// Numbers of the tasks in the order in which they are run: the first of each cluster, then the second of
/// each, that with most events first, so that what is done when the runs are stopped stands for most hits.
std::vector<std::size_t> order_of_runs(const std::vector<Task>& tasks, const std::vector<Cluster>& clusters);

}  // namespace talus::ensemble
