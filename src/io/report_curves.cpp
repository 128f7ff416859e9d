#include "contact/structures/structure.hpp"
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
void curves(ReportData& d, const std::string& key, const std::string& title, const std::string& unit,
            const std::vector<double>& time,
            const std::vector<std::pair<std::string, std::vector<double>>>& series, std::size_t budget,
            json extra = json::object()) {
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
  const auto read = [&](const char* name) {
    return d.file.read<double>(std::string("/ledger/") + name).values;
  };
  if (d.time.empty()) return;
  std::vector<double> potential = read("potential");
  const double lowest = *std::min_element(potential.begin(), potential.end());
  for (double& p : potential) p -= lowest;  // only differences mean something, and the plot stays readable
  std::vector<std::pair<std::string, std::vector<double>>> where{
      {"kinetic", read("kinetic")},
      {"potential (above its lowest)", potential},
      {"strain", read("strain")},
      {"contact", read("contact")},
      {"friction", read("friction_work")},
      {"damping", read("damping_work")},
      {"damage", read("damage_work")},
      {"numerical (algorithmic)", read("algorithmic")},
      {"external work", read("external_work")}};
  for (const auto& [name, dataset] : std::initializer_list<std::pair<const char*, const char*>>{
           {"yielding", "yield_work"}, {"ploughing", "ploughing_work"}, {"vegetation", "vegetation_work"}})
    if (d.file.exists(std::string("/ledger/") + dataset))
      if (std::vector<double> taken = read(dataset); taken.back() != 0)
        where.emplace_back(name, std::move(taken));
  curves(d, "energy", "Energy and where it went", "J", d.time, where, 6000, {{"group", "energy"}});
  curves(d, "residual", "Energy ledger residual", "J", d.time, {{"residual", read("residual")}}, 3000,
         {{"group", "energy"}});
  const auto p = d.file.read<double>("/ledger/linear_momentum");
  curves(d, "momentum", "Linear momentum", "N s", d.time,
         {{"x", column(p, 3, 0)}, {"y", column(p, 3, 1)}, {"z", column(p, 3, 2)}}, 3000,
         {{"group", "energy"}});
}

/// Shear and moment of each member: the resultant at base, mid-height and top.
void member_histories(ReportData& d, const std::string& p, const std::string& structure,
                      const std::string& key, const json& extra) {
  if (!d.file.exists(p + "name")) return;
  const std::vector<std::string> names = d.file.read_texts(p + "name");
  const std::vector<std::string> kinds = d.file.exists(p + "kind")
                                             ? d.file.read_texts(p + "kind")
                                             : std::vector<std::string>(names.size(), "pier");
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
    json own = extra;
    own["member"] = names[m];
    const auto plot = [&](const Array<double>& a, const char* what, const char* title, const char* unit) {
      const bool span = kinds[m] == "span";
      curves(d, fmt::format("{}_member_{}_{}", key, m, what),
             fmt::format("{}: {} over time", structure == names[m] ? structure : structure + ", " + names[m],
                         title),
             unit, d.time,
             {{span ? "start" : "base", resultant(a, m, 0)},
              {span ? "middle" : "mid-height", resultant(a, m, stations / 2)},
              {span ? "end" : "top", resultant(a, m, stations - 1)}},
             3000, own);
    };
    plot(shear, "shear", "shear force", "N");
    plot(moment, "moment", "bending moment", "N m");
  }
}

/// Section forces along each member, over its stations: under permanent load (the first row), in the row
/// nearest to the greatest load, and the extremes of all rows; |V| = sqrt(V_x^2 + V_y^2), |M| = sqrt(M_x^2 +
/// M_y^2), N with its sign.
void section_forces(ReportData& d, const std::string& p, const std::string& structure,
                    const std::string& key) {
  if (!d.file.exists(p + "name")) return;
  const std::vector<std::string> names = d.file.read_texts(p + "name");
  const auto station = d.file.read<double>(p + "station"), frame = d.file.read<double>(p + "frame");
  const auto axial = d.file.read<double>(p + "axial"), shear = d.file.read<double>(p + "shear");
  const auto moment = d.file.read<double>(p + "moment"),
             resistance = d.file.read<double>(p + "shear_resistance");
  const std::size_t nm = names.size(), ns = station.stride(), nt = d.time.size();
  if (station.dims != Dims{nm, ns} || frame.dims != Dims{nm, 3, 3} || axial.dims != Dims{nt, nm, ns} ||
      shear.dims != Dims{nt, nm, ns, 2} || moment.dims != shear.dims || resistance.dims != Dims{nm, 2, 2})
    throw bad_file("results.h5", p, "holds section forces of another shape", "use results that Talus wrote");
  const json summaries = [&] {
    for (const json& s : d.summary.value("structures", json::array()))
      if (s.value("name", std::string()) == structure) return s.value("members", json::array());
    return json::array();
  }();
  const auto size_of = [](const Array<double>& a, std::size_t at) {
    return std::hypot(a.values[2 * at], a.values[2 * at + 1]);
  };
  for (std::size_t m = 0; m < nm; ++m) {
    const auto told = std::find_if(summaries.begin(), summaries.end(),
                                   [&](const json& x) { return x.value("name", std::string()) == names[m]; });
    double peak = d.time.front();
    for (const char* which : {"peak_shear", "shear_utilisation_design"})
      if (told != summaries.end() && told->contains(which) && told->at(which).is_object())
        peak = told->at(which).value("time", peak);
    const auto after = std::lower_bound(d.time.begin(), d.time.end(), peak);
    auto row = static_cast<std::size_t>(after - d.time.begin());
    if (row == nt || (row > 0 && peak - d.time[row - 1] < d.time[row] - peak)) --row;
    const std::string own = fmt::format("{}_sections_{}", key, m);
    const auto along = [&](const char* what, auto&& value) {
      std::vector<float> first, then, least, most;
      for (std::size_t s = 0; s < ns; ++s) {
        const auto at = [&](std::size_t t) { return static_cast<float>(value((t * nm + m) * ns + s)); };
        float low = at(0), high = at(0);
        for (std::size_t t = 1; t < nt; ++t) low = std::fmin(low, at(t)), high = std::fmax(high, at(t));
        first.push_back(at(0)), then.push_back(at(row)), least.push_back(low), most.push_back(high);
      }
      for (const auto& [suffix, values] :
           {std::pair{"first", &first}, {"then", &then}, {"least", &least}, {"most", &most}})
        d.blob.add(fmt::format("{}_{}_{}", own, what, suffix), *values, {ns});
    };
    const auto from = station.values.begin() + static_cast<std::ptrdiff_t>(m * ns);
    d.blob.add(own + "_station", std::vector<double>(from, from + static_cast<std::ptrdiff_t>(ns)), {ns});
    along("axial", [&](std::size_t at) { return axial.values[at]; });
    along("shear", [&](std::size_t at) { return size_of(shear, at); });
    along("moment", [&](std::size_t at) { return size_of(moment, at); });
    const auto axis = [&](std::size_t k) {
      return Vec3(Eigen::Map<const Vec3>(&frame.values[9 * m + 3 * k]));
    };
    const Vec3 base = axis(0), end = base + station.values[(m + 1) * ns - 1] * axis(1).cross(axis(2));
    d.meta["members"].push_back({{"structure", structure},
                                 {"name", names[m]},
                                 {"key", own},
                                 {"time", d.time[row]},
                                 {"base", {base.x(), base.y(), base.z()}},
                                 {"end", {end.x(), end.y(), end.z()}},
                                 {"shear_design", {resistance.values[4 * m], resistance.values[4 * m + 1]}}});
  }
}

void structure_histories(ReportData& d) {
  if (!d.file.is_group("/history/structures")) return;
  const std::vector<std::string> names = d.file.read_texts("/geometry/structures/name");
  for (std::size_t s = 0; s < names.size(); ++s) {
    const std::string p = "/history/structures/" + safe_name(names[s]) + "/",
                      key = fmt::format("structure_{}", s);
    const json extra = {{"group", "structure"}, {"structure", names[s]}};
    const auto force = d.file.read<double>(p + "base_force"), moment = d.file.read<double>(p + "base_moment"),
               probe = d.file.read<double>(p + "probe_displacement");
    curves(d, key + "_force", names[s] + ": base force", "N", d.time,
           {{"x", column(force, 3, 0)}, {"y", column(force, 3, 1)}, {"z", column(force, 3, 2)}}, 5000, extra);
    curves(d, key + "_moment", names[s] + ": base moment", "N m", d.time,
           {{"x", column(moment, 3, 0)}, {"y", column(moment, 3, 1)}, {"z", column(moment, 3, 2)}}, 5000,
           extra);
    const std::vector<std::string> probes = d.file.read_texts(p + "probe_name");
    for (std::size_t k = 0; k < probes.size(); ++k)
      curves(d, fmt::format("{}_probe_{}", key, k),
             fmt::format("{}: displacement of {}", names[s], probes[k]), "m", d.time,
             {{"x", column(probe, 3 * probes.size(), 3 * k)},
              {"y", column(probe, 3 * probes.size(), 3 * k + 1)},
              {"z", column(probe, 3 * probes.size(), 3 * k + 2)}},
             5000, extra);
    member_histories(d, p + "members/", names[s], key, extra);
    if (!d.time.empty()) section_forces(d, p + "members/", names[s], key);
    const std::vector<double> damage = d.file.read<double>(p + "damage_max").values,
                              volume = d.file.read<double>(p + "damaged_volume").values;
    if (!damage.empty() && *std::max_element(damage.begin(), damage.end()) > 0) {
      curves(d, key + "_damage", names[s] + ": greatest damage", "1", d.time, {{"damage", damage}}, 3000,
             extra);
      curves(d, key + "_volume", names[s] + ": volume with damage above one half", "m^3", d.time,
             {{"volume", volume}}, 3000, extra);
    }
  }
}

/// Force against time at each impact: the sum over contacts, its mean over each bin of the filter, and
/// filtered.
void impacts(ReportData& d) {
  const std::string g = "/history/contacts/structure/";
  const json list = d.summary.value("impacts", json::array());
  if (list.empty() || !d.file.exists(g + "time")) return;
  const auto time = d.file.read<double>(g + "time").values, dt = d.file.read<double>(g + "dt").values;
  const auto force = d.file.read<double>(g + "force");
  const auto block = d.file.read<std::int64_t>(g + "block").values,
             structure = d.file.read<std::int64_t>(g + "structure").values;
  const std::vector<std::string> structures = d.file.read_texts("/geometry/structures/name");
  check_indices(block, d.names.size(), "block of a contact");
  check_indices(structure, structures.size(), "structure of a contact");
  // The strongest impacts; the table lists them all, those of less than a hundredth of the greatest energy
  // too.
  double most = 0;
  for (const json& m : list) most = std::max(most, m.value("kinetic", 0.0));
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].value("kinetic", 0.0) >= 0.01 * most) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return list[a].value("peak_force", 0.0) > list[b].value("peak_force", 0.0);
  });
  const std::size_t weak = list.size() - order.size(),
                    more = order.size() - std::min<std::size_t>(order.size(), 12);
  order.resize(order.size() - more);
  if (weak + more > 0) d.meta["impacts_left_out"] = {{"weak", weak}, {"more", more}};
  std::sort(order.begin(), order.end());
  for (const std::size_t i : order) {
    const json& m = list[i];
    const double start = m["start"], end = m["end"];
    std::vector<ForceRow> rows;
    for (std::size_t k = 0; k < time.size(); ++k) {
      if (time[k] <= start - 1e-12 || time[k] > end + 1e-12) continue;
      if (d.names[static_cast<std::size_t>(block[k])] != m["block"] ||
          structures[static_cast<std::size_t>(structure[k])] != m["structure"])
        continue;
      rows.push_back(
          {time[k], dt[k], Vec3(force.values[3 * k], force.values[3 * k + 1], force.values[3 * k + 2])});
    }
    // Filtered before anything is thinned, as the summary does it: the greatest of the curve is the force
    // that it states.
    const double margin = std::max(0.25 * (end - start), 0.005);
    const ForceCurve c = force_curve(rows, margin, margin);
    if (c.time.empty()) continue;
    const double peak = m.contains("filtered_force")
                            ? m["filtered_force"].get<double>()
                            : *std::max_element(c.filtered.begin(), c.filtered.end());
    curves(d, fmt::format("impact_{}", i),
           fmt::format("Contact force: {} on {}, {:.3f} s", m["block"].get<std::string>(),
                       m["structure"].get<std::string>(), start),
           "N", c.time,
           {{fmt::format("mean over {:.1f} ms", 1e3 * force_bin), c.mean},
            {fmt::format("mean over {:.1f} ms", 1e3 * load_window), c.filtered}},
           6000,
           {{"group", "impact"},
            {"impact", i},
            {"structure", m["structure"]},
            {"block", m["block"]},
            {"filtered_peak", peak}});
  }
}

/// Where and how fast the paths of blocks crossed the lines of the scene, in the order of time.
void crossings(ReportData& d) {
  if (!d.file.is_group("/lines")) return;
  d.meta["lines"] = json::array();
  for (const std::string& name : d.file.list("/lines")) {
    const std::string p = "/lines/" + name + "/";
    const auto block = d.file.read<std::int64_t>(p + "block").values;
    check_indices(block, d.names.size(), "block of a crossing");
    const std::size_t n = block.size();
    const auto read = [&](const char* what, std::size_t width) {
      std::vector<double> values = d.file.read<double>(p + what).values;
      if (values.size() != width * n)
        throw bad_file("results.h5", p + what, "holds another number of rows",
                       "use results that Talus wrote");
      return values;
    };
    const auto time = read("time", 1), position = read("position", 3), velocity = read("velocity", 3);
    const auto moved = read("kinetic_translational", 1), turned = read("kinetic_rotational", 1);
    const auto height = read("height", 1);
    json rows = json::array();
    for (std::size_t k = 0; k < n; ++k) {
      const double* x = &position[3 * k];
      const double* v = &velocity[3 * k];
      rows.push_back({{"block", d.names[static_cast<std::size_t>(block[k])]},
                      {"time", time[k]},
                      {"at", {x[0], x[1], x[2]}},
                      {"speed", std::hypot(v[0], v[1], v[2])},
                      {"kinetic", moved[k] + turned[k]},
                      {"kinetic_rotational", turned[k]},
                      {"height", height[k]}});
    }
    d.meta["lines"].push_back({{"name", name}, {"rows", rows}});
  }
}

}  // namespace

void add_curves(ReportData& d) {
  ledger(d);
  structure_histories(d);
  impacts(d);
  crossings(d);
}

}  // namespace talus::io
