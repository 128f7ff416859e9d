#include "io/force_track.hpp"
#include "io/report_data.hpp"

#include <algorithm>
#include <cmath>

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

/// Every stride-th number, from the given one on.
std::vector<double> column(const Array<double>& a, std::size_t stride, std::size_t first) {
  std::vector<double> v(a.rows());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = a.values[i * stride + first];
  return v;
}

/// A group of curves over one time axis.
void curves(ReportData& d, const std::string& key, const std::string& title, const std::string& unit, const std::vector<double>& time,
            const std::vector<std::pair<std::string, std::vector<double>>>& series, std::size_t budget, json extra = json::object()) {
  std::vector<std::span<const double>> spans;
  for (const auto& s : series) spans.emplace_back(s.second);
  const std::vector<std::size_t> picked = pick_extremes(time.size(), spans, budget);
  std::vector<double> t;
  for (const std::size_t i : picked) t.push_back(time[i]);
  d.blob.add(key + "_time", t, {t.size()});
  json item = {{"key", key}, {"title", title}, {"unit", unit}, {"series", json::array()}};
  for (std::size_t k = 0; k < series.size(); ++k) {
    std::vector<float> y;
    for (const std::size_t i : picked) y.push_back(static_cast<float>(series[k].second[i]));
    d.blob.add(fmt::format("{}_{}", key, k), y, {y.size()});
    item["series"].push_back(series[k].first);
  }
  item.update(extra);
  d.meta["curves"].push_back(item);
}

void ledger(ReportData& d) {
  d.meta["curves"] = json::array();
  const auto read = [&](const char* name) { return d.file.read<double>(std::string("/ledger/") + name).values; };
  if (d.time.empty()) return;
  std::vector<double> potential = read("potential");
  const double lowest = *std::min_element(potential.begin(), potential.end());
  for (double& p : potential) p -= lowest;  // only differences mean something, and the plot stays readable
  std::vector<std::pair<std::string, std::vector<double>>> where{{"kinetic", read("kinetic")}, {"potential (above its lowest)", potential}, {"strain", read("strain")}, {"contact", read("contact")},
                                                                  {"friction", read("friction_work")}, {"damping", read("damping_work")}, {"damage", read("damage_work")}, {"algorithmic", read("algorithmic")}, {"external work", read("external_work")}};
  for (const auto& [name, dataset] : std::initializer_list<std::pair<const char*, const char*>>{{"yielding", "yield_work"}, {"ploughing", "ploughing_work"}, {"vegetation", "vegetation_work"}})
    if (d.file.exists(std::string("/ledger/") + dataset))
      if (std::vector<double> taken = read(dataset); taken.back() != 0) where.emplace_back(name, std::move(taken));
  curves(d, "energy", "Energy and where it went", "J", d.time, where, 6000, {{"group", "energy"}});
  curves(d, "residual", "Energy ledger residual", "J", d.time, {{"residual", read("residual")}}, 3000, {{"group", "energy"}});
  const auto p = d.file.read<double>("/ledger/linear_momentum");
  curves(d, "momentum", "Linear momentum", "N s", d.time, {{"x", column(p, 3, 0)}, {"y", column(p, 3, 1)}, {"z", column(p, 3, 2)}}, 3000, {{"group", "energy"}});
}

/// Shear and moment of each member: the resultant at base, mid-height and top.
void member_histories(ReportData& d, const std::string& p, const std::string& structure, const std::string& key, const json& extra) {
  if (!d.file.exists(p + "name")) return;
  const std::vector<std::string> names = d.file.read_texts(p + "name");
  const std::vector<std::string> kinds = d.file.exists(p + "kind") ? d.file.read_texts(p + "kind") : std::vector<std::string>(names.size(), "pier");
  const auto shear = d.file.read<double>(p + "shear"), moment = d.file.read<double>(p + "moment");
  const std::size_t stations = shear.dims[2], width = names.size() * stations * 2;
  const auto resultant = [&](const Array<double>& a, std::size_t member, std::size_t station) {
    const std::size_t at = 2 * (member * stations + station);
    std::vector<double> x = column(a, width, at);
    const std::vector<double> y = column(a, width, at + 1);
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = std::hypot(x[k], y[k]);
    return x;
  };
  for (std::size_t m = 0; m < names.size(); ++m) {
    const auto plot = [&](const Array<double>& a, const char* what, const char* title, const char* unit) {
      const bool span = kinds[m] == "span";
      curves(d, fmt::format("{}_member_{}_{}", key, m, what), fmt::format("{}, {}: {}", structure, names[m], title), unit, d.time,
             {{span ? "start" : "base", resultant(a, m, 0)}, {span ? "middle" : "mid-height", resultant(a, m, stations / 2)}, {span ? "end" : "top", resultant(a, m, stations - 1)}}, 3000, extra);
    };
    plot(shear, "shear", "shear force", "N");
    plot(moment, "moment", "bending moment", "N m");
  }
}

void structure_histories(ReportData& d) {
  if (!d.file.is_group("/history/structures")) return;
  const std::vector<std::string> names = d.file.read_texts("/geometry/structures/name");
  for (std::size_t s = 0; s < names.size(); ++s) {
    const std::string p = "/history/structures/" + safe_name(names[s]) + "/", key = fmt::format("structure_{}", s);
    const json extra = {{"group", "structure"}, {"structure", names[s]}};
    const auto force = d.file.read<double>(p + "base_force"), moment = d.file.read<double>(p + "base_moment"), probe = d.file.read<double>(p + "probe_displacement");
    curves(d, key + "_force", names[s] + ": base force", "N", d.time, {{"x", column(force, 3, 0)}, {"y", column(force, 3, 1)}, {"z", column(force, 3, 2)}}, 5000, extra);
    curves(d, key + "_moment", names[s] + ": base moment", "N m", d.time, {{"x", column(moment, 3, 0)}, {"y", column(moment, 3, 1)}, {"z", column(moment, 3, 2)}}, 5000, extra);
    const std::vector<std::string> probes = d.file.read_texts(p + "probe_name");
    for (std::size_t k = 0; k < probes.size(); ++k)
      curves(d, fmt::format("{}_probe_{}", key, k), fmt::format("{}: displacement of {}", names[s], probes[k]), "m", d.time,
             {{"x", column(probe, 3 * probes.size(), 3 * k)}, {"y", column(probe, 3 * probes.size(), 3 * k + 1)}, {"z", column(probe, 3 * probes.size(), 3 * k + 2)}}, 5000, extra);
    member_histories(d, p + "members/", names[s], key, extra);
    const std::vector<double> damage = d.file.read<double>(p + "damage_max").values, volume = d.file.read<double>(p + "damaged_volume").values;
    if (!damage.empty() && *std::max_element(damage.begin(), damage.end()) > 0) {
      curves(d, key + "_damage", names[s] + ": greatest damage", "1", d.time, {{"damage", damage}}, 3000, extra);
      curves(d, key + "_volume", names[s] + ": volume with damage above one half", "m^3", d.time, {{"volume", volume}}, 3000, extra);
    }
  }
}

/// Force against time at each impact: the sum over contacts, its mean over each bin of the filter, and filtered.
void impacts(ReportData& d) {
  const std::string g = "/history/contacts/structure/";
  const json list = d.summary.value("impacts", json::array());
  if (list.empty() || !d.file.exists(g + "time")) return;
  const auto time = d.file.read<double>(g + "time").values, dt = d.file.read<double>(g + "dt").values;
  const auto force = d.file.read<double>(g + "force");
  const auto block = d.file.read<std::int64_t>(g + "block").values, structure = d.file.read<std::int64_t>(g + "structure").values;
  const std::vector<std::string> structures = d.file.read_texts("/geometry/structures/name");
  check_indices(block, d.names.size(), "block of a contact");
  check_indices(structure, structures.size(), "structure of a contact");
  // The strongest impacts; the table lists them all, those of less than a hundredth of the greatest energy too.
  double most = 0;
  for (const json& m : list) most = std::max(most, m.value("kinetic", 0.0));
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].value("kinetic", 0.0) >= 0.01 * most) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return list[a].value("peak_force", 0.0) > list[b].value("peak_force", 0.0); });
  const std::size_t weak = list.size() - order.size(), more = order.size() - std::min<std::size_t>(order.size(), 12);
  order.resize(order.size() - more);
  if (weak + more > 0) d.meta["impacts_left_out"] = {{"weak", weak}, {"more", more}};
  std::sort(order.begin(), order.end());
  for (const std::size_t i : order) {
    const json& m = list[i];
    const double start = m["start"], end = m["end"];
    std::vector<ForceRow> rows;
    for (std::size_t k = 0; k < time.size(); ++k) {
      if (time[k] <= start - 1e-12 || time[k] > end + 1e-12) continue;
      if (d.names[static_cast<std::size_t>(block[k])] != m["block"] || structures[static_cast<std::size_t>(structure[k])] != m["structure"]) continue;
      rows.push_back({time[k], dt[k], Vec3(force.values[3 * k], force.values[3 * k + 1], force.values[3 * k + 2])});
    }
    // Filtered before anything is thinned, as the summary does it: the greatest of the curve is the force that it states.
    const double margin = std::max(0.25 * (end - start), 0.005);
    const ForceCurve c = force_curve(rows, margin, margin);
    if (c.time.empty()) continue;
    const double peak = m.contains("filtered_force") ? m["filtered_force"].get<double>() : *std::max_element(c.filtered.begin(), c.filtered.end());
    curves(d, fmt::format("impact_{}", i), fmt::format("Contact force: {} on {}, {:.3f} s", m["block"].get<std::string>(), m["structure"].get<std::string>(), start), "N", c.time,
           {{fmt::format("mean over {:.1f} ms", 1e3 * force_bin), c.mean}, {fmt::format("low-pass {:.0f} Hz", force_cutoff), c.filtered}}, 6000,
           {{"group", "impact"}, {"impact", i}, {"structure", m["structure"]}, {"block", m["block"]}, {"filtered_peak", peak}});
  }
}

}  // namespace

void add_curves(ReportData& d) {
  ledger(d);
  structure_histories(d);
  impacts(d);
}

}  // namespace talus::io
