#include "ensemble/fragility/hits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "ensemble/random.hpp"
#include "ensemble/struck.hpp"

namespace talus::ensemble {
namespace {

constexpr std::size_t least_events = 3;  // of a cluster, where one is divided
constexpr int runs_a_cluster = 3;        // at least, over all clusters, where hits are divided further
/// Spreads that count as equal when a cluster is divided: of ln(energy), of the height over the member's
/// length, of the direction in plan [rad].
constexpr std::array<double, 3> alike{0.5, 0.15, 0.5};
constexpr double least_spread = 0.05;  // of these: hits that differ by less are one kind

/// Number of the sorted values that go to the lower part, so that the sum of squares about the means of both
/// parts is least.
std::size_t best_cut(const std::vector<double>& sorted) {
  const double all = std::accumulate(sorted.begin(), sorted.end(), 0.0),
               n = static_cast<double>(sorted.size());
  double sum = 0, most = -1;
  std::size_t best = sorted.size() / 2;
  for (std::size_t k = 1; k + least_events <= sorted.size(); ++k) {
    sum += sorted[k - 1];
    if (k < least_events) continue;
    const double low = static_cast<double>(k),
                 between = std::pow(sum / low - (all - sum) / (n - low), 2) * low * (n - low);
    if (between > most) most = between, best = k;
  }
  return best;
}

class Division {
 public:
  Division(const std::vector<Event>& events, const std::vector<talus::Member>& members, int runs)
      : events_(events), members_(members), runs_(runs) {}

  std::vector<Cluster> clusters() {
    divide();
    spread_runs();
    return std::move(clusters_);
  }

 private:
  /// What a cluster is divided by: ln(energy), height over the member's length, direction against the mean
  /// one.
  std::array<double, 3> features(const Event& e, const Eigen::Vector2d& mean) const {
    const double length = e.struck >= 0 ? members_[static_cast<std::size_t>(e.struck)].length : 1;
    return {std::log(std::max(e.energy, 1e-300)), e.height / std::max(length, 1e-300),
            std::remainder(e.direction - std::atan2(mean.x(), mean.y()), 2 * M_PI)};
  }

  /// The feature in which the hits of a cluster differ most, over what counts as equal, and by how much.
  std::pair<double, std::size_t> widest(const Cluster& c, std::vector<std::array<double, 3>>& all) const {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Event& e : c.events) mean += Eigen::Vector2d(std::sin(e.direction), std::cos(e.direction));
    all.clear();
    for (const Event& e : c.events) all.push_back(features(e, mean));
    std::pair<double, std::size_t> found{0, 0};
    for (std::size_t k = 0; k < alike.size(); ++k) {
      double sum = 0, squares = 0;
      for (const auto& f : all) sum += f[k], squares += f[k] * f[k];
      const double n = static_cast<double>(all.size()),
                   spread = std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) / alike[k];
      if (spread > found.first) found = {spread, k};
    }
    return found;
  }

  /// Hits by the member struck; then the cluster whose events differ most, each counted, is divided in what
  /// they differ most in, as long as the runs suffice for more clusters.
  void divide() {
    std::map<int, std::size_t> place;
    for (const Event& e : events_) {
      const auto [at, fresh] = place.try_emplace(e.struck, clusters_.size());
      if (fresh) clusters_.push_back({.struck = e.struck, .events = {}});
      clusters_[at->second].events.push_back(e);
    }
    std::vector<std::array<double, 3>> of;
    while (static_cast<int>(clusters_.size()) * runs_a_cluster < runs_) {
      double most = 0;
      std::size_t which = 0;
      for (std::size_t i = 0; i < clusters_.size(); ++i) {
        if (clusters_[i].events.size() < 2 * least_events) continue;
        const double spread = widest(clusters_[i], of).first;
        if (const double gain = static_cast<double>(clusters_[i].events.size()) * spread;
            spread > least_spread && gain > most)
          most = gain, which = i;
      }
      if (most == 0) break;
      const std::size_t by = widest(clusters_[which], of).second, n = clusters_[which].events.size();
      std::vector<std::size_t> order(n);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(of[a][by], clusters_[which].events[a].member) <
               std::pair(of[b][by], clusters_[which].events[b].member);
      });
      Cluster low{.struck = clusters_[which].struck, .events = {}}, high = low;
      std::vector<double> sorted;
      for (const std::size_t k : order) sorted.push_back(of[k][by]);
      const std::size_t cut = best_cut(sorted);
      for (std::size_t k = 0; k < n; ++k)
        (k < cut ? low : high).events.push_back(clusters_[which].events[order[k]]);
      clusters_[which] = std::move(low);
      clusters_.push_back(std::move(high));
    }
    for (Cluster& c : clusters_)
      std::sort(c.events.begin(), c.events.end(), [](const Event& a, const Event& b) {
        return std::pair(a.energy, a.member) < std::pair(b.energy, b.member);
      });
    std::stable_sort(clusters_.begin(), clusters_.end(),
                     [](const Cluster& a, const Cluster& b) { return a.struck < b.struck; });
  }

  void spread_runs() {
    // One run each, the rest one by one to the cluster that is behind its share most.
    double roots = 0;
    for (const Cluster& c : clusters_) roots += std::sqrt(static_cast<double>(c.events.size()));
    std::vector<std::size_t> order(clusters_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return clusters_[a].events.size() > clusters_[b].events.size();
    });
    for (int k = 0; k < runs_; ++k) {
      Cluster* next = nullptr;
      double most = -std::numeric_limits<double>::infinity();
      for (const std::size_t i : order) {
        Cluster& c = clusters_[i];
        const double behind =
            c.runs == 0 ? 1e9 : runs_ * std::sqrt(static_cast<double>(c.events.size())) / roots - c.runs;
        if (behind > most) most = behind, next = &c;
      }
      ++next->runs;
    }
  }

  const std::vector<Event>& events_;
  const std::vector<talus::Member>& members_;
  int runs_;
  std::vector<Cluster> clusters_;
};

}  // namespace

Event event_of(std::int64_t member, const Hit& hit, const std::vector<talus::Member>& members) {
  Event e{.member = member,
          .hit = hit,
          .energy = 0.5 * hit.mass * hit.velocity.squaredNorm(),
          .struck = struck_by(hit.point, members),
          .height = hit.point.z(),
          .direction = std::atan2(hit.velocity.x(), hit.velocity.y())};
  if (e.struck >= 0) {
    const talus::Member& m = members[static_cast<std::size_t>(e.struck)];
    e.height = std::clamp((hit.point - m.base).dot(m.axis_x.cross(m.axis_y).normalized()), 0.0, m.length);
  }
  return e;
}

std::vector<Cluster> cluster_events(const std::vector<Event>& events,
                                    const std::vector<talus::Member>& members, int runs) {
  return Division(events, members, runs).clusters();
}

std::vector<Task> draw_tasks(const std::vector<Cluster>& clusters, std::uint32_t seed) {
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const Cluster& c = clusters[i];
    // Events in an order of chance; over again, with another perturbation, if there are fewer than runs.
    std::vector<std::pair<std::uint64_t, std::size_t>> lots;
    for (std::size_t e = 0; e < c.events.size(); ++e)
      lots.emplace_back(bits(seed, for_clusters, static_cast<std::uint64_t>(c.events[e].member), 0, 0), e);
    std::sort(lots.begin(), lots.end());
    for (int k = 0; k < c.runs; ++k) {
      const auto at = static_cast<std::size_t>(k);
      tasks.push_back({static_cast<int>(i), k, k / static_cast<int>(lots.size()),
                       &c.events[lots[at % lots.size()].second]});
    }
  }
  return tasks;
}

std::vector<std::size_t> order_of_runs(const std::vector<Task>& tasks, const std::vector<Cluster>& clusters) {
  std::vector<std::size_t> order(tasks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto events = [&](const Task& t) {
    return clusters[static_cast<std::size_t>(t.cluster)].events.size();
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return tasks[a].turn != tasks[b].turn ? tasks[a].turn < tasks[b].turn
                                          : events(tasks[a]) > events(tasks[b]);
  });
  return order;
}

}  // namespace talus::ensemble
