#include "ensemble/results.hpp"
#include "ensemble/struck.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "ensemble/barrier.hpp"
#include "ensemble/brief.hpp"
#include "ensemble/store.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array percents{50.0, 90.0, 95.0, 99.0};

/// All members but the cells that they went through, in order of their index.
std::vector<Member> members_of(const Ensemble& ensemble, const fs::path& directory, long members) {
  std::vector<Member> all;
  std::vector<char> seen(static_cast<std::size_t>(members), 0);
  each_member(directory, ensemble.identity(), [&](Member&& m) {
    if (m.index >= members || std::exchange(seen[static_cast<std::size_t>(m.index)], 1) != 0) return;
    m.passages = {};
    all.push_back(std::move(m));
  });
  std::sort(all.begin(), all.end(), [](const Member& a, const Member& b) { return a.index < b.index; });
  return all;
}

class Writer {
 public:
  Writer(io::Hdf5File& file, const Ensemble& ensemble, const std::vector<Member>& members)
      : file_(file), ensemble_(ensemble), members_(members) {}

  void write() {
    for (const Member& m : members_) blocks_ = std::max(blocks_, m.end.size());
    write_members();
    write_varied();
    for (std::size_t l = 0; l < ensemble_.lines().size(); ++l) write_line(static_cast<int>(l));
    for (std::size_t s = 0; s < ensemble_.structures().size(); ++s) write_hits(static_cast<int>(s));
  }

 private:
  template <class Get>
  void integers(const std::string& path, const std::string& unit, const std::string& description, Get get) {
    std::vector<std::int64_t> values;
    for (const Member& m : members_) values.push_back(static_cast<std::int64_t>(get(m)));
    file_.write<std::int64_t>(path, values, {values.size()}, unit, description);
  }
  template <class Get>
  void numbers(const std::string& path, const std::string& unit, const std::string& description, Get get) {
    std::vector<double> values;
    for (const Member& m : members_) values.push_back(get(m));
    file_.write<double>(path, values, {values.size()}, unit, description);
  }

  void write_members() {
    const std::string at = "/members/";
    integers(at + "index", "1", "number of the member, from 0", [](const Member& m) { return m.index; });
    integers(at + "seed", "1", "of the member's own random numbers",
             [&](const Member& m) { return ensemble_.design().seed_of(m.index); });
    std::vector<std::string> status;
    for (const Member& m : members_) status.emplace_back(status_text(m.status));
    file_.write(at + "status", status, "done, at rest, left, failed, over limit, suspect");
    integers(at + "steps", "1", "time steps of the blocks", [](const Member& m) { return m.steps; });
    numbers(at + "cpu", "s", "processor time; the one figure that differs from run to run",
            [](const Member& m) { return m.cpu; });
    numbers(at + "energy_residual", "1", "of the energy ledger, over the largest kinetic energy",
            [](const Member& m) { return m.energy_residual; });
    numbers(at + "numerical_gain", "1", "numerical energy gain over the largest kinetic energy",
            [](const Member& m) { return m.numerical_gain; });
    numbers(at + "reach_angle", "rad",
            "drop over plan distance from start to end, of the block with the least",
            [](const Member& m) { return m.reach_angle; });
    std::vector<double> end, runout;
    for (const Member& m : members_)
      for (std::size_t b = 0; b < blocks_; ++b) {
        const bool there = b < m.end.size() && b < m.start.size();
        for (int k = 0; k < 3; ++k) end.push_back(there ? m.end[b][k] : none);
        runout.push_back(there ? m.runout(b) : none);
      }
    file_.write<double>(at + "end_position", end, {members_.size(), blocks_, 3}, "m",
                        "centroids at the end, scene coordinates");
    file_.write<double>(at + "runout", runout, {members_.size(), blocks_}, "m",
                        "plan distance from start to end");
  }

  void write_varied() {
    const std::vector<Column>& columns = ensemble_.design().columns();
    std::vector<std::vector<double>> values(columns.size());
    std::vector<std::vector<std::string>> texts(columns.size());
    for (const Member& m : members_) {
      const Draw draw = ensemble_.design().draw(m.index);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        if (columns[c].text)
          texts[c].push_back(unquoted(draw.texts[c]));
        else
          values[c].insert(values[c].end(), draw.numbers[c].begin(), draw.numbers[c].end());
      }
    }
    file_.group("/members/varied");
    for (std::size_t c = 0; c < columns.size(); ++c) {
      // "/" would make a group of the key.
      std::string name = columns[c].name;
      std::replace(name.begin(), name.end(), '/', '|');
      const std::string path = "/members/varied/" + name;
      if (columns[c].text)
        file_.write(path, texts[c], columns[c].description);
      else if (columns[c].width == 1)
        file_.write<double>(path, values[c], {members_.size()}, columns[c].unit, columns[c].description);
      else
        file_.write<double>(path, values[c], {members_.size(), static_cast<std::size_t>(columns[c].width)},
                            columns[c].unit, columns[c].description);
    }
  }

  static std::string unquoted(const std::string& toml) {
    return toml.size() >= 2 && toml.front() == '"' ? toml.substr(1, toml.size() - 2) : toml;
  }

  /// Columns of rows that belong to members.
  struct Table {
    std::vector<std::int64_t> member, block;
    std::map<std::string, std::vector<double>> one, three;
    void add(const std::string& name, const Vec3& v) {
      three[name].insert(three[name].end(), v.data(), v.data() + 3);
    }
  };

  void write_table(const std::string& at, Table& t, const std::vector<std::array<std::string, 3>>& ones,
                   const std::vector<std::array<std::string, 3>>& threes) {
    const std::size_t n = t.member.size();
    file_.write<std::int64_t>(at + "member", t.member, {n}, "1", "index of the member");
    file_.write<std::int64_t>(at + "block", t.block, {n}, "1", "place of the block in the scene, from 0");
    for (const auto& [name, unit, description] : ones)
      file_.write<double>(at + name, t.one[name], {n}, unit, description);
    for (const auto& [name, unit, description] : threes)
      file_.write<double>(at + name, t.three[name], {n, 3}, unit, description);
  }

  void write_line(int line) {
    Table t;
    for (const Member& m : members_)
      for (const Crossing& c : m.crossings) {
        if (c.line != line) continue;
        t.member.push_back(m.index), t.block.push_back(c.block);
        t.one["time"].push_back(c.time), t.one["kinetic_translational"].push_back(c.translational),
            t.one["kinetic_rotational"].push_back(c.rotational), t.one["height"].push_back(c.height);
        t.add("position", c.position), t.add("velocity", c.velocity), t.add("spin", c.spin);
      }
    write_table("/lines/" + ensemble_.lines()[static_cast<std::size_t>(line)].name + "/", t,
                {{"time", "s", "of the crossing"},
                 {"kinetic_translational", "J", "energy of translation"},
                 {"kinetic_rotational", "J", "energy of rotation"},
                 {"height", "m", "of the centroid above the ground"}},
                {{"position", "m", "of the centroid, scene coordinates"},
                 {"velocity", "m/s", "of the centroid"},
                 {"spin", "rad/s", "world axes"}});
    file_.attribute("/lines/" + ensemble_.lines()[static_cast<std::size_t>(line)].name, "crs",
                    ensemble_.crs());
  }

  void write_hits(int structure) {
    Table t;
    std::vector<double> orientation;
    std::vector<std::string> struck;
    const std::vector<talus::Member>& parts =
        ensemble_.structure_members()[static_cast<std::size_t>(structure)];
    for (const Member& m : members_)
      for (const Hit& h : m.hits) {
        if (h.structure != structure) continue;
        t.member.push_back(m.index), t.block.push_back(h.block);
        t.one["time"].push_back(h.time), t.one["mass"].push_back(h.mass);
        t.add("point", h.point), t.add("velocity", h.velocity), t.add("spin", h.spin);
        orientation.insert(orientation.end(), h.orientation.begin(), h.orientation.end());
        if (const int k = struck_by(h.point, parts); k >= 0)
          struck.push_back(parts[static_cast<std::size_t>(k)].name);
      }
    const std::string at = "/hits/" + ensemble_.structures()[static_cast<std::size_t>(structure)] + "/";
    write_table(at, t, {{"time", "s", "of the first contact"}, {"mass", "kg", "of the block"}},
                {{"point", "m", "of the contact, scene coordinates"},
                 {"velocity", "m/s", "of the centroid just before"},
                 {"spin", "rad/s", "just before, world axes"}});
    file_.write<double>(at + "orientation", orientation, {t.member.size(), 4}, "1",
                        "quaternion w, x, y, z, body to world");
    if (!parts.empty()) file_.write(at + "struck", struck, "pier, column or span nearest to the contact");
  }

  io::Hdf5File& file_;
  const Ensemble& ensemble_;
  const std::vector<Member>& members_;
  std::size_t blocks_ = 0;
};

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json estimate(const Estimate& e) {
  return {{"value", number(e.value)}, {"low", number(e.low)}, {"high", number(e.high)}};
}

std::string summary_text(const Summary& s) {
  Json root;
  root["members"] = {{"asked", s.asked},           {"done", s.done},       {"failed", s.failed},
                     {"over_limit", s.over_limit}, {"suspect", s.suspect}, {"left", s.left}};
  if (const std::string text = left_text(s); !text.empty()) root["members"]["left_means"] = text;
  root["lines"] = Json::array();
  for (const LineSummary& l : s.lines) {
    Json line{{"name", l.name},
              {"crossings", l.crossings},
              {"members", l.members},
              {"probability", estimate(l.probability)}};
    for (std::size_t q = 0; q < quantities.size(); ++q)
      for (std::size_t p = 0; p < percents.size(); ++p)
        line[quantities[q]][fmt::format("p{:.0f}", percents[p])] = estimate(l.percentiles[q][p]);
    root["lines"].push_back(std::move(line));
  }
  root["structures"] = Json::array();
  for (const StructureSummary& h : s.structures) {
    Json structure{{"name", h.name}, {"members", h.members}, {"probability", estimate(h.probability)}};
    structure["struck"] = Json::array();
    for (const StructureSummary::Struck& part : h.struck)
      structure["struck"].push_back(
          {{"name", part.name}, {"members", part.members}, {"probability", estimate(part.probability)}});
    root["structures"].push_back(std::move(structure));
  }
  if (const auto& p = s.precision) {
    root["precision"] = {
        {"line", p->asked.line},    {"quantity", p->asked.quantity}, {"percentile", p->asked.percentile},
        {"asked", p->asked.within}, {"within", number(p->within)},   {"crossing", p->crossing},
        {"reached", p->reached}};
    if (const std::string text = unreached_text(*p); !text.empty()) root["precision"]["means"] = text;
  }
  return root.dump(2) + "\n";
}

/// Whether a block of a finished member ended where no ground is.
bool left_terrain(const Ensemble& ensemble, const Member& m) {
  if (!finished(m.status)) return false;
  if (m.status == Status::left) return true;
  for (std::size_t b = 0; b < m.end.size(); ++b)
    if (m.runout(b) > 0 && !std::isfinite(ensemble.height(m.end[b].x(), m.end[b].y()))) return true;
  return false;
}

Summary summarise(const Ensemble& ensemble, const std::vector<Member>& members) {
  Summary s;
  s.asked = ensemble.settings().precision ? static_cast<long>(members.size()) : ensemble.design().members();
  Briefs briefs;
  for (const Member& m : members) {
    briefs[m.index] = brief_of(m, ensemble.lines().size());
    ++(m.status == Status::failed       ? s.failed
       : m.status == Status::over_limit ? s.over_limit
       : m.status == Status::suspect    ? s.suspect
                                        : s.done);
    s.left += left_terrain(ensemble, m) ? 1 : 0;
    s.cpu += m.cpu;
  }
  if (ensemble.settings().precision) s.precision = precision_of(ensemble, briefs);
  const bool replicated = ensemble.settings().design == scene::Ensemble::Design::sobol;
  for (std::size_t l = 0; l < ensemble.lines().size(); ++l) {
    LineSummary& line = s.lines.emplace_back();
    line.name = ensemble.lines()[l].name;
    for (const Member& m : members) {
      if (!finished(m.status)) continue;
      const long rows = std::count_if(m.crossings.begin(), m.crossings.end(),
                                      [&](const Crossing& c) { return c.line == static_cast<int>(l); });
      line.crossings += rows;
      line.members += rows > 0 ? 1 : 0;
    }
    for (std::size_t q = 0; q < quantities.size(); ++q) {
      const Bootstrap bootstrap(samples_of(briefs, l, q), ensemble.settings().seed, replicated);
      if (q == 0) line.probability = bootstrap.probability();
      const std::vector<Estimate> found = bootstrap.percentiles(percents);
      std::copy(found.begin(), found.end(), line.percentiles[q].begin());
    }
  }
  for (std::size_t k = 0; k < ensemble.structures().size(); ++k) {
    StructureSummary& hit = s.structures.emplace_back();
    hit.name = ensemble.structures()[k];
    // Members of the ensemble with a hit that counts, and how probable one is.
    const auto struck = [&](auto&& counts) {
      std::vector<Sample> samples;
      long hits = 0;
      for (const Member& m : members) {
        if (!finished(m.status)) continue;
        const bool crosses = std::any_of(m.hits.begin(), m.hits.end(), [&](const Hit& h) {
          return h.structure == static_cast<int>(k) && counts(h);
        });
        samples.push_back({.index = m.index, .crosses = crosses, .value = 0});
        hits += crosses ? 1 : 0;
      }
      return std::pair(hits, Bootstrap(samples, ensemble.settings().seed, replicated).probability());
    };
    std::tie(hit.members, hit.probability) = struck([](const Hit&) { return true; });
    const std::vector<talus::Member>& parts = ensemble.structure_members()[k];
    std::set<int> found;
    for (const Member& m : members)
      for (const Hit& h : m.hits)
        if (finished(m.status) && h.structure == static_cast<int>(k)) found.insert(struck_by(h.point, parts));
    found.erase(-1);
    for (const int part : found) {
      const auto [hits, probability] =
          struck([&](const Hit& h) { return struck_by(h.point, parts) == part; });
      hit.struck.push_back({parts[static_cast<std::size_t>(part)].name, hits, probability});
    }
  }
  return s;
}

/// 95th percentile over members of the mass of what crosses a line, from the energy and speed there [kg].
double mass_at(const std::vector<Member>& members, int line) {
  std::vector<double> masses;
  for (const Member& m : members) {
    double most = 0;
    for (const Crossing& c : m.crossings)
      if (c.line == line && c.velocity.squaredNorm() > 0)
        most = std::max(most, 2 * c.translational / c.velocity.squaredNorm());
    if (finished(m.status) && most > 0) masses.push_back(most);
  }
  std::sort(masses.begin(), masses.end());
  return percentile(masses, 95);
}

/// What the values of a barrier are worth, of so many members that cross.
std::string barrier_note(long members) {
  std::string note;
  for (const double percent : {95.0, 99.0})
    if (members < enough_for(percent))
      note += fmt::format("{}a {:.0f}th percentile takes {}", note.empty() ? "" : ", ", percent,
                          enough_for(percent));
  if (!note.empty())
    note = fmt::format(
        "of {} members that cross, too few to bound the percentiles they rest on ({}): take them "
        "as no more than a first look; ",
        members, note);
  return note +
         "percentiles and partial factors as commonly cited, unverified; heights are of the centroid: half "
         "of "
         "the block and a free border come on top";
}

std::string details_text(const Ensemble& ensemble, const std::vector<Member>& members, const Summary& s) {
  Json root;
  const bool replicated = ensemble.settings().design == scene::Ensemble::Design::sobol;
  root["intervals"] =
      replicated
          ? "95 %: bootstrap over 16 replicates (2000 resamples)"
          : "95 %: percentiles by bootstrap over members (2000 resamples), probabilities by Wilson's score";
  root["percentiles"] =
      "of each member's largest value at the line, over the members that cross it and have finished, linear "
      "between order statistics";
  root["probability"] = "of crossing, over all members that have finished (done, at rest, left, suspect)";
  root["limits"] = "blocks do not break on impact, structures are rigid, members do not meet each other";
  root["crs"] = ensemble.crs();
  root["cpu_seconds"] = s.cpu;
  Json statuses = Json::object();
  for (const Member& m : members)
    statuses[status_text(m.status)] = statuses.value(status_text(m.status), 0) + 1;
  root["statuses"] = statuses;
  root["blocks"] = ensemble.blocks();
  root["warnings"] = Json::array();
  for (const Problem& p : ensemble.warnings()) root["warnings"].push_back(p.str());
  root["barriers"] = Json::array();
  for (std::size_t l = 0; l < s.lines.size(); ++l) {
    if (s.lines[l].crossings == 0) continue;
    Json line{
        {"line", s.lines[l].name}, {"note", barrier_note(s.lines[l].members)}, {"values", Json::array()}};
    const auto percentile_of = [&](std::size_t quantity, std::size_t percent) {
      return s.lines[l].percentiles[quantity][percent].value;
    };
    for (const BarrierValue& v : barrier_values({.speed_95 = percentile_of(1, 2),
                                 .mass_95 = mass_at(members, static_cast<int>(l)),
                                 .energy_99 = percentile_of(0, 3),
                                 .height_95 = percentile_of(2, 2)})) {
      Json factors = Json::object();
      for (const auto& [name, value] : v.factors) factors[name] = value;
      line["values"].push_back({{"standard", v.standard},
                                {"from", v.from},
                                {"factors", factors},
                                {"energy", number(v.energy)},
                                {"height", number(v.height)}});
    }
    root["barriers"].push_back(std::move(line));
  }
  return root.dump(2) + "\n";
}

void keep_scenes(const Ensemble& ensemble, const fs::path& directory, const std::vector<Member>& members) {
  for (const Member& m : members) {
    if (m.message.empty()) continue;
    fs::create_directories(directory / "members");
    io::write_file(directory / "members" / fmt::format("{}.toml", m.index),
                   ensemble.scene_file(
                       m.index, fmt::format("Member {}: {}\n{}", m.index, status_text(m.status), m.message)),
                   false);
  }
}

}  // namespace

std::string left_text(const Summary& s) {
  if (s.left == 0) return {};
  return fmt::format(
      "{} of {} members: a block left the terrain, so that reach and deposits are cut off at its limits; a "
      "larger terrain would show where these blocks stop",
      s.left, s.done + s.suspect);
}

void require_finished(const fs::path& directory) {
  const std::string name = "name the output directory of talus ensemble";
  if (!fs::is_directory(directory))
    throw io::bad_file(directory, "DIR", fs::exists(directory) ? "is a file" : "does not exist", name);
  if (!fs::exists(directory / "summary.json") || !fs::exists(directory / "ensemble.h5"))
    throw io::bad_file(directory, "DIR", "holds no finished ensemble",
                       fs::is_directory(directory / "journal")
                           ? "finish it by talus ensemble SCENE -o " + directory.string() + " --resume"
                           : name);
}

Summary write_results(Ensemble& ensemble, const fs::path& directory, long count) {
  const std::vector<Member> members = members_of(ensemble, directory, count);
  io::PartFile part(directory / "ensemble.h5");
  {
    io::Hdf5File file = io::Hdf5File::create(part.path());
    Writer(file, ensemble, members).write();
    file.attribute("/", "crs", ensemble.crs());
    file.close();
  }
  part.swap_in();
  keep_scenes(ensemble, directory, members);
  const Summary summary = summarise(ensemble, members);
  io::write_file(directory / "details.json", details_text(ensemble, members, summary));
  io::write_file(directory / "summary.json", summary_text(summary));
  return summary;
}

}  // namespace talus::ensemble
