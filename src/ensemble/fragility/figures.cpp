#include "ensemble/fragility/figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include <fmt/format.h>

#include "ensemble/fragility/logistic.hpp"
#include "ensemble/fragility/strata.hpp"
#include "ensemble/statistics.hpp"

namespace talus::ensemble {
namespace {

using Json = nlohmann::ordered_json;

constexpr int classes = 4;
constexpr std::array<const char*, classes + 1> class_names{"none", "slight", "moderate", "severe", "lost"};
constexpr int least_own_runs = 6;  // of hits on a member, of which a curve of its own is made
/// Days that a bridge is closed by the class of its worst member: an assumption that is written with the
/// results.
constexpr std::array<double, classes + 1> closure_days{0, 1, 14, 180, 365};

std::string figure(const Json& p) {
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", p["value"].get<double>(), p["low"].get<double>(),
                     p["high"].get<double>());
}

std::string kilojoules(double energy) {
  return energy >= 1e6 ? fmt::format("{:.0f}", energy / 1e3) : fmt::format("{:.4g}", energy / 1e3);
}

class Figures {
 public:
  explicit Figures(const FragilityRuns& runs) : runs_(runs) {}

  FragilityFigures make() {
    write_head();
    write_doubts();
    write_members();
    write_classes();
    write_closure();
    write_next_run();
    write_clusters();
    root_["limits"] = "blocks do not break on impact; other blocks of a member are left out of its window";
    return {std::move(root_), std::move(result_)};
  }

 private:
  void write_head() {
    double most_force = 0;
    for (const Outcome& o : runs_.outcomes) {
      if (!o.good) continue;
      ++result_.done;
      most_force = std::max(most_force, o.peak_force);
      if (names_.empty()) names_ = o.names;
    }
    result_.asked = runs_.request.runs;
    result_.failed = static_cast<int>(runs_.faults.size());
    root_["structure"] = runs_.request.structure;
    double seen = 0, all = 0;
    for (std::size_t i = 0; i < runs_.clusters.size(); ++i) {
      const auto events = static_cast<double>(runs_.clusters[i].events.size());
      all += events, seen += done_of(i) > 0 ? events : 0;
    }
    root_["runs"] = {{"asked", result_.asked},
                     {"done", result_.done},
                     {"failed", result_.failed},
                     {"window", runs_.request.window},
                     {"share_of_hits", all > 0 ? seen / all : 0}};
    if (result_.failed > 0)
      result_.lines.push_back(fmt::format(
          "{} run{} failed and {} left out; if these are of the strongest hits the figures are too "
          "low: {}",
          result_.failed, result_.failed == 1 ? "" : "s", result_.failed == 1 ? "is" : "are",
          runs_.faults.front()));
    unseen_ = result_.done > 0 ? 1 - seen / all : 0;
    root_["faults"] = runs_.faults;
    const Estimate struck = wilson(runs_.hits, runs_.finished);
    root_["events"] = {{"members", runs_.finished},
                       {"hits", runs_.hits},
                       {"probability_of_hit", struck.value},
                       {"probability_of_hit_interval", {struck.low, struck.high}}};
    root_["peak_force"] = {{"mean", mean_per_hit([](const Outcome& o) { return o.peak_force; })},
                           {"largest", most_force}};
    if (runs_.request.capacity)
      root_["capacity"] = {{"least_ratio", mean_per_hit([](const Outcome& o) { return o.capacity; })},
                           {"note",
                            "capacity now over that as built, of the member of a run with the least; 0: "
                            "lost; mean over hits"}};
    root_["classes"] = class_names;
  }

  /// What the runs themselves warn of, what their classes rest on, whether their cells are coarse.
  void write_doubts() {
    constexpr std::array kinds{
        std::pair{"numerical dissipation", "numerical dissipation beyond 1 % of the greatest kinetic energy"},
        std::pair{"numerical energy gain", "numerical energy gain beyond 1 % of the greatest kinetic energy"},
        std::pair{"is above Hertz's elastic", "force of a single sub-step above Hertz's elastic bound"},
        std::pair{"lost their support", "parts that have lost their support stay in the mesh"},
        std::pair{"fails under permanent load", "the structure fails under its permanent load"}};
    std::vector<std::pair<std::string, int>> counts;
    int severe = 0, by_shear = 0;
    for (const Outcome& o : runs_.outcomes) {
      if (!o.good) continue;
      std::vector<std::string> of_run;
      for (const std::string& w : o.warnings) {
        const auto known = std::find_if(kinds.begin(), kinds.end(),
                                        [&](const auto& k) { return w.find(k.first) != std::string::npos; });
        const std::string kind = known != kinds.end() ? known->second : w;
        if (std::find(of_run.begin(), of_run.end(), kind) == of_run.end()) of_run.push_back(kind);
      }
      for (const std::string& kind : of_run) {
        const auto at =
            std::find_if(counts.begin(), counts.end(), [&](const auto& c) { return c.first == kind; });
        if (at == counts.end())
          counts.emplace_back(kind, 1);
        else
          ++at->second;
      }
      constexpr int severe_class = 3;
      if (o.worst() < severe_class) continue;
      ++severe;
      by_shear += o.rests_on_shear();
    }
    root_["doubts"] = Json::array();
    const auto say = [&](const std::string& line) {
      root_["doubts"].push_back(line);
      result_.lines.push_back(line);
    };
    if (unseen_ > 0)
      say(fmt::format(
          "{:.0f} % of the hits are of kinds of which no run is done; for each member they are taken "
          "as the others on it, or as the others beside it",
          100 * unseen_));
    say(fmt::format("each run is {:g} s from just before the strike: what happens later is not in it",
                    runs_.request.window));
    for (const auto& [kind, count] : counts)
      say(fmt::format("warned of in {} of {} runs: {}", count, result_.done, kind));
    if (by_shear > 0)
      say(
          fmt::format("severe or worse in {} of {} runs, in {} of them for its shear force alone (mean over "
                      "1.5 ms against V_Rd with mean strengths), no crack, bar or volume beside it",
                      severe, result_.done, by_shear));
    if (!runs_.mesh.empty()) say(runs_.mesh);
  }

  void write_members() {
    root_["members"] = Json::array();
    for (std::size_t m = 0; m < names_.size(); ++m) root_["members"].push_back(member_curves(names_[m], m));
  }

  static int worst(const Outcome& o) { return o.worst(); }

  /// Of the structure as a whole: its worst member.
  void write_classes() {
    Json per_event = Json::array(), per_year = Json::array();
    const double yearly = runs_.releases_per_year;
    at_least_[0] = 1;
    for (int k = 1; k <= classes; ++k) {
      const Json p = probability(k, worst);
      per_event.push_back(p);
      if (!p["value"].is_number()) continue;  // no run was judged
      at_least_[static_cast<std::size_t>(k)] = p["value"].get<double>();
      if (yearly > 0) {
        Json y = p;
        for (const char* bound : {"value", "low", "high"})
          y[bound] = -std::expm1(-yearly * p[bound].get<double>());
        per_year.push_back(y);
      }
      result_.lines.push_back(fmt::format("P(class >= {}, {}) = {} per event", k,
                                          class_names[static_cast<std::size_t>(k)], figure(p)));
    }
    if (per_event.front()["value"].is_null())
      result_.lines.push_back(
          fmt::format("no damage class: {} has no damage law (structure.damage), or no run was judged",
                      runs_.request.structure));
    else
      for (const Json& m : root_["members"]) {
        const Json& p = m["per_event"][2];
        const std::string name = m["name"].get<std::string>();
        result_.lines.push_back(
            p["value"].is_number()
                ? fmt::format("P({} severe) = {} per event", name, figure(p))
                : fmt::format("P({} severe) is not known: no run is done of the hits on it, or of all others",
                              name));
      }
    root_["per_event"] = per_event;
    if (yearly > 0) root_["per_year"] = per_year;
  }

  void write_closure() {
    double closure = 0;
    for (int k = 1; k <= classes; ++k)
      closure += closure_days[static_cast<std::size_t>(k)] *
                 (at_least_[static_cast<std::size_t>(k)] - at_least_[static_cast<std::size_t>(k + 1)]);
    root_["expected_closure"] = {{"days_per_event", closure},
                                 {"days_by_class", closure_days},
                                 {"note", "days of closure by class are an assumption"}};
    if (runs_.releases_per_year > 0)
      root_["expected_closure"]["days_per_year"] = runs_.releases_per_year * closure;
  }

  void write_next_run() {
    root_["next_run"] = next_run(worst);
    if (!root_["next_run"].is_null())
      result_.lines.push_back("One more run narrows most: " + root_["next_run"]["text"].get<std::string>());
  }

  void write_clusters() {
    root_["clusters"] = Json::array();
    for (std::size_t i = 0; i < runs_.clusters.size(); ++i) {
      const Cluster& c = runs_.clusters[i];
      const auto [low, high] =
          std::minmax_element(c.events.begin(), c.events.end(),
                              [](const Event& a, const Event& b) { return a.height < b.height; });
      Eigen::Vector2d way = Eigen::Vector2d::Zero();
      for (const Event& e : c.events) way += Eigen::Vector2d(std::sin(e.direction), std::cos(e.direction));
      root_["clusters"].push_back({{"struck", c.struck < 0 || c.struck >= static_cast<int>(names_.size())
                                                  ? Json(nullptr)
                                                  : Json(names_[static_cast<std::size_t>(c.struck)])},
                                   {"energy", {c.events.front().energy, c.events.back().energy}},
                                   {"height", {low->height, high->height}},
                                   {"mean_direction", std::atan2(way.x(), way.y())},
                                   {"events", c.events.size()},
                                   {"runs", c.runs},
                                   {"done", done_of(i)}});
    }
  }

  int done_of(std::size_t cluster) const {
    int done = 0;
    for (std::size_t t = 0; t < runs_.tasks.size(); ++t)
      done += runs_.tasks[t].cluster == static_cast<int>(cluster) && runs_.outcomes[t].good;
    return done;
  }

  template <class Grade>
  std::pair<int, int> counts(std::size_t cluster, int k, Grade grade) const {
    int x = 0, n = 0;
    for (std::size_t t = 0; t < runs_.tasks.size(); ++t)
      if (runs_.tasks[t].cluster == static_cast<int>(cluster) && runs_.outcomes[t].good &&
          grade(runs_.outcomes[t]) >= 0)
        ++n, x += grade(runs_.outcomes[t]) >= k;
    return {x, n};
  }

  /// Mean over the hits of what runs give, each cluster by its number of hits, with its 95 % interval; runs
  /// that give none (negative) are left out.
  template <class Value>
  Json mean_per_hit(Value value) const {
    double pooled = 0, all = 0;
    long spare = 0;
    std::vector<std::array<double, 3>> sums(runs_.clusters.size(),
                                            {0, 0, 0});  // number, sum, sum of squares about the mean
    for (std::size_t t = 0; t < runs_.tasks.size(); ++t)
      if (runs_.outcomes[t].good && value(runs_.outcomes[t]) >= 0)
        sums[static_cast<std::size_t>(runs_.tasks[t].cluster)][0] += 1,
            sums[static_cast<std::size_t>(runs_.tasks[t].cluster)][1] += value(runs_.outcomes[t]);
    for (std::size_t t = 0; t < runs_.tasks.size(); ++t) {
      auto& c = sums[static_cast<std::size_t>(runs_.tasks[t].cluster)];
      if (runs_.outcomes[t].good && value(runs_.outcomes[t]) >= 0)
        c[2] += std::pow(value(runs_.outcomes[t]) - c[1] / c[0], 2);
    }
    for (const auto& c : sums)
      if (c[0] > 1) pooled += c[2], spare += static_cast<long>(c[0]) - 1;
    double mean = 0, variance = 0;
    for (std::size_t i = 0; i < runs_.clusters.size(); ++i)
      if (sums[i][0] > 0) all += static_cast<double>(runs_.clusters[i].events.size());
    if (all == 0) return nullptr;
    for (std::size_t i = 0; i < runs_.clusters.size(); ++i) {
      if (sums[i][0] == 0) continue;
      const double w = static_cast<double>(runs_.clusters[i].events.size()) / all;
      mean += w * sums[i][1] / sums[i][0];
      if (spare > 0) variance += w * w * pooled / static_cast<double>(spare) / sums[i][0];
    }
    if (spare == 0) return {{"value", mean}, {"low", nullptr}, {"high", nullptr}};
    const double half = 1.959963984540054 * std::sqrt(variance);
    return {{"value", mean}, {"low", std::max(0.0, mean - half)}, {"high", mean + half}};
  }

  /// P(class >= k) per event of the ensemble: that of a hit times that of the class given one.
  /// Of a member kinds of hits without a run are as the others that strike it, or as the others that do not:
  /// hits on a pier of which no run is done would else be counted on the piers of which some are.
  template <class Grade>
  Json probability(int k, Grade grade, int member = -1) const {
    std::vector<Stratum> all = strata(k, grade);
    std::array<double, 2> hits{}, seen{};
    const auto group = [&](std::size_t c) {
      return static_cast<std::size_t>(member >= 0 && runs_.clusters[c].struck == member);
    };
    for (std::size_t c = 0; c < all.size(); ++c)
      hits[group(c)] += all[c].weight, seen[group(c)] += all[c].runs > 0 ? all[c].weight : 0;
    for (std::size_t c = 0; c < all.size(); ++c)
      if (seen[group(c)] > 0) all[c].weight *= hits[group(c)] / seen[group(c)];
    const bool known = (hits[0] == 0 || seen[0] > 0) && (hits[1] == 0 || seen[1] > 0);
    const Estimate given =
        known ? stratified(all) : Estimate{.value = std::numeric_limits<double>::quiet_NaN()};
    const Estimate p = product(wilson(runs_.hits, runs_.finished), given);
    if (!std::isfinite(given.value))
      return {{"class", k}, {"value", nullptr}, {"low", nullptr}, {"high", nullptr}};
    return {{"class", k}, {"value", p.value}, {"low", p.low}, {"high", std::min(1.0, p.high)}};
  }

  template <class Grade>
  std::vector<Stratum> strata(int k, Grade grade) const {
    std::vector<Stratum> all;
    for (std::size_t c = 0; c < runs_.clusters.size(); ++c) {
      const auto [x, n] = counts(c, k, grade);
      all.push_back({static_cast<double>(runs_.clusters[c].events.size()), x, n});
    }
    return all;
  }

  Json member_curves(const std::string& name, std::size_t m) const {
    const auto grade = [m](const Outcome& o) { return m < o.grade.size() ? o.grade[m] : -1; };
    Json member{{"name", name}, {"per_event", Json::array()}, {"curves", Json::array()}};
    // Runs of too few hits on this member say little of its strength, and less do hits that miss it: then
    // the hits on all members of its kind count, each by the class of the member that it strikes.
    const auto span = [&](std::size_t of) { return of < runs_.members.size() && runs_.members[of].span; };
    std::vector<std::pair<std::size_t, std::size_t>> taken;  // task, member that it strikes
    for (std::size_t t = 0; t < runs_.tasks.size(); ++t) {
      const Event& event = *runs_.tasks[t].event;
      const std::size_t at = event.struck < 0 ? m : static_cast<std::size_t>(event.struck);
      const Outcome& o = runs_.outcomes[t];
      if (o.good && at < o.grade.size() && o.grade[at] >= 0 && event.energy > 0 && span(at) == span(m))
        taken.emplace_back(t, at);
    }
    const auto own = [m](const auto& run) { return run.second == m; };
    if (std::ranges::count_if(taken, own) >= least_own_runs) std::erase_if(taken, std::not_fn(own));
    const bool all_own = std::ranges::all_of(taken, own);
    std::vector<double> x;
    std::vector<int> grades;
    for (const auto& [t, at] : taken)
      x.push_back(std::log(runs_.tasks[t].event->energy)), grades.push_back(runs_.outcomes[t].grade[at]);
    const std::vector<Logistic> fits = fit_logistic(x, grades, classes);
    for (int k = 1; k <= classes; ++k) {
      member["per_event"].push_back(probability(k, grade, static_cast<int>(m)));
      Json curve{{"class", k},
                 {"hits", all_own   ? "on this member"
                          : span(m) ? "on any span"
                                    : "on any pier"},
                 {"runs", x.size()},
                 {"reached", std::ranges::count_if(grades, [k](int g) { return g >= k; })}};
      const Logistic& fit = fits[static_cast<std::size_t>(k - 1)];
      curve["fitted"] = fit.fitted;
      if (fit.fitted) {
        curve["law"] = "P = 1 / (1 + exp(-(a + b ln(E / 1 J)))), b the same for all classes";
        curve["a"] = fit.a, curve["b"] = fit.b;
        curve["goodness"] = {
            {"deviance", fit.deviance}, {"null_deviance", fit.null_deviance}, {"brier", fit.brier}};
        const auto [low, high] = std::minmax_element(x.begin(), x.end());
        for (int q = 0; q <= 20; ++q) {
          const double at = *low + (*high - *low) * q / 20;
          const Logistic::Band band = fit.at(at);
          curve["energy"].push_back(std::exp(at)), curve["probability"].push_back(band.value),
              curve["low"].push_back(band.low), curve["high"].push_back(band.high);
        }
      }
      member["curves"].push_back(std::move(curve));
    }
    return member;
  }

  /// The cluster in which one more run takes most off the variance of P(class >= 3).
  template <class Grade>
  Json next_run(Grade grade) const {
    double most = 0;
    std::size_t best = 0;
    const std::vector<Stratum> all = strata(3, grade);
    for (std::size_t c = 0; c < runs_.clusters.size(); ++c)
      if (const double gain = variance_gain(all, c); gain > most) most = gain, best = c;
    if (!(most > 0)) return nullptr;
    const Cluster& c = runs_.clusters[best];
    const std::string where = c.struck >= 0 && c.struck < static_cast<int>(runs_.members.size())
                                  ? runs_.members[static_cast<std::size_t>(c.struck)].name
                                  : runs_.request.structure;
    return {{"cluster", best},
            {"variance_gain", most},
            {"text", fmt::format("a hit on {} with {} to {} kJ ({} event{}, {} run{} so far)", where,
                                 kilojoules(c.events.front().energy), kilojoules(c.events.back().energy),
                                 c.events.size(), c.events.size() == 1 ? "" : "s", done_of(best),
                                 done_of(best) == 1 ? "" : "s")}};
  }

  const FragilityRuns& runs_;
  double unseen_ = 0;  // share of the hits of kinds of which no run is done
  Json root_;
  FragilityResult result_;
  std::vector<std::string> names_;              // of the structure's members
  std::array<double, classes + 2> at_least_{};  // P(class >= k) per event
};

}  // namespace

FragilityFigures figures_of(const FragilityRuns& runs) { return Figures(runs).make(); }

}  // namespace talus::ensemble
