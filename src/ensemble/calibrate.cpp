#include "ensemble/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/table.hpp"
#include "core/text_file.hpp"
#include "core/units.hpp"
#include "ensemble/brief.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/sobol.hpp"
#include "io/files.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;
using Points = std::vector<VecX>;

constexpr int held_out_every = 4;

double mean_distance(const Points& a, const Points& b) {
  double sum = 0;
  for (const auto& p : a)
    for (const auto& q : b) sum += (p - q).norm();
  return sum / (static_cast<double>(a.size()) * static_cast<double>(b.size()));
}

/// What a column may be in: a number alone is SI.
Dimension dimension_of(const std::string& quantity) {
  constexpr Dimension energy{2, 1, -2, 0};
  return quantity == "energy" ? energy : quantity == "speed" ? dimension::velocity : dimension::length;
}

/// What a column of the measured rows is, by its name.
ColumnHolds column_of(const std::string& heading) {
  const std::string name = column_name(heading);
  const bool read = name == "x" || name == "y" || std::ranges::find(quantities, name) != quantities.end();
  return {read, read ? std::optional(dimension_of(name)) : std::nullopt};
}

/// Places where blocks came to rest, or what passed at a line.
struct Measured {
  std::string line;                     // empty: end points
  std::vector<std::size_t> quantities;  // of passages, in the order of `quantities`
  Points points;                        // x, y; or the quantities over their standard deviations
  VecX scale;
};

Measured read_measured(const fs::path& file) {
  const std::string all = read_text(file.string());
  const char separator = table_separator(all);
  std::istringstream text(all);
  std::string line;
  std::vector<std::string> header, units;
  Measured m;
  int number = 0;
  std::vector<std::size_t> columns;
  std::size_t line_column = 0;
  while (std::getline(text, line)) {
    ++number;
    if (is_blank_row(line)) continue;
    const std::vector<TableCell> cells = table_cells(line, separator);
    if (header.empty()) {
      for (const TableCell& cell : cells) {
        std::string problem;
        const auto heading = read_heading(cell.text, column_of, problem);
        if (!heading)
          throw io::bad_file(file, fmt::format("line {}", number), problem,
                             "give it in SI, or in a known unit");
        header.push_back(column_name(heading->name));
        units.push_back(heading->unit);
      }
      for (const std::string& name : header)
        if ((column_of(name).read || name == "line") && std::count(header.begin(), header.end(), name) > 1)
          throw io::bad_file(file, name, "is the name of two columns of the file", "remove one of them");
      const auto column = [&](const char* name) {
        return static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
      };
      line_column = column("line");
      if (line_column == header.size()) {
        columns = {column("x"), column("y")};
        for (std::size_t k = 0; k < 2; ++k)
          if (columns[k] == header.size())
            throw io::bad_file(file, k == 0 ? "x" : "y", "is no column of the file",
                               "name the columns x and y of end points in the first row, or line and some of "
                               "energy, speed, height of passages");
        continue;
      }
      for (std::size_t q = 0; q < quantities.size(); ++q)
        if (const std::size_t k = column(quantities[q]); k < header.size())
          columns.push_back(k), m.quantities.push_back(q);
      if (columns.empty())
        throw io::bad_file(file, "line", "none of energy, speed, height is a column of the file",
                           "name what was measured at the line in the first row");
      continue;
    }
    if (cells.size() > header.size())
      throw io::bad_file(
          file, fmt::format("line {}", number),
          fmt::format("has {} cells where the first row names {} columns", cells.size(), header.size()),
          separator == ',' ? "are the commas decimal ones? Write decimal points, or separate the "
                             "columns by semicolons"
                           : "correct the line");
    VecX row(static_cast<Eigen::Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      std::string error;
      const std::size_t k = columns[c];
      const auto q =
          k < cells.size()
              ? parse_quantity(
                    with_decimal_point(cells[k], separator) + (units[k].empty() ? "" : " " + units[k]), error)
              : std::nullopt;
      if (!q)
        throw io::bad_file(file, fmt::format("line {}", number),
                           fmt::format("\"{}\" is no number{}", k < cells.size() ? cells[k].text : "",
                                       error.empty() ? "" : ": " + error),
                           "correct the line");
      const Dimension wanted = dimension_of(header[k]);
      if (q->dimension != wanted &&
          !(units[k].empty() && is_bare_number(with_decimal_point(cells[k], separator))))
        throw io::bad_file(file, fmt::format("line {}", number),
                           fmt::format("\"{}\" is no {}", cells[k].text, describe(wanted)),
                           "correct the line");
      if (q->value < 0 && (header[k] == "energy" || header[k] == "speed"))
        throw io::bad_file(file, fmt::format("line {}", number),
                           fmt::format("{} of {}: none is below 0", header[k], cells[k].text),
                           "correct the line");
      row[static_cast<Eigen::Index>(c)] = q->value;
    }
    if (line_column < header.size()) {
      const std::string name = line_column < cells.size() ? cells[line_column].text : "";
      if (!m.line.empty() && name != m.line)
        throw io::bad_file(file, fmt::format("line {}", number),
                           fmt::format("\"{}\" is another line than \"{}\"", name, m.line),
                           "give the passages of one line a file");
      m.line = name;
    }
    m.points.push_back(row);
  }
  if (m.points.size() < 4)
    throw io::bad_file(file, "rows", fmt::format("{} measured points are too few", m.points.size()),
                       "give at least 4");
  m.scale = VecX::Ones(m.points.front().size());
  if (m.line.empty()) return m;
  VecX mean = VecX::Zero(m.scale.size()), squares = mean;
  for (const VecX& p : m.points) mean += p / static_cast<double>(m.points.size());
  for (const VecX& p : m.points) squares += (p - mean).cwiseAbs2() / static_cast<double>(m.points.size() - 1);
  for (Eigen::Index k = 0; k < m.scale.size(); ++k)
    if (squares[k] > 0) m.scale[k] = std::sqrt(squares[k]);
  for (VecX& p : m.points) p = p.cwiseQuotient(m.scale);
  return m;
}

struct Candidate {
  std::vector<double> values;
  double fitted = std::numeric_limits<double>::quiet_NaN(),
         held_out = fitted;  // energy distances, roots of lengths [m^(1/2)] or of quotients [1]
  long members = 0, finished = 0, moving = 0;  // moving: finished ones that had not come to rest
  VecX mean;                                   // of what is compared, in its own units
  std::string fault;
};

class Calibration {
 public:
  explicit Calibration(const CalibrationRequest& r) : request_(r) {
    measured_ = read_measured(r.measured);
    const Points& all = measured_.points;
    for (std::size_t i = 0; i < all.size(); ++i)
      (i % held_out_every == held_out_every - 1 ? held_out_ : fitted_).push_back(all[i]);
  }

  /// The scene's own draws would take the place of a candidate's value.
  void check() const {
    std::vector<double> middle;
    for (const Parameter& p : request_.parameters) middle.push_back(0.5 * (p.low + p.high));
    try {
      Ensemble ensemble(request_.scene, overrides_of(middle));
      for (const scene::Vary& v : ensemble.settings().vary)
        if (std::ranges::find(request_.parameters, v.key, &Parameter::key) != request_.parameters.end())
          throw InputError(
              Problem{.severity = Problem::Severity::error,
                      .file = "--vary",
                      .line = 0,
                      .column = 0,
                      .key = v.key,
                      .value = {},
                      .rule = "is drawn for each member by [[ensemble.vary]], whatever a candidate says",
                      .remedy = "take its entry out of the scene, or leave it out here"});
      refuse_ends_off_ground(ensemble);
    } catch (const InputError& error) { throw InputError(by_their_option(error.problems())); }
  }

  std::vector<std::string> run() {
    const int first = (request_.candidates + 1) / 2;
    const Sobol sobol(static_cast<int>(request_.parameters.size()), 1);
    std::vector<std::pair<double, double>> box;
    for (const Parameter& p : request_.parameters) box.emplace_back(p.low, p.high);
    for (int k = 0; k < request_.candidates; ++k) {
      if (k == first && !shrink(box)) break;
      Candidate c;
      for (std::size_t d = 0; d < box.size(); ++d)
        c.values.push_back(box[d].first + (box[d].second - box[d].first) *
                                              sobol.coordinate(static_cast<std::uint64_t>(k) * replicates,
                                                               static_cast<int>(d)));
      evaluate(c);
      if (request_.stop != nullptr && request_.stop->load() != 0)
        return best() == nullptr ? std::vector<std::string>() : report();
      candidates_.push_back(std::move(c));
      const auto failed =
          std::ranges::count_if(candidates_, [](const Candidate& made) { return !made.fault.empty(); });
      if (request_.progress)
        request_.progress({.done = k + 1, .asked = request_.candidates, .failed = failed});
    }
    return report();
  }

 private:
  /// End points of which none lies over ground are those of a map; so is one, over planes without end, that
  /// no block comes to.
  void refuse_ends_off_ground(Ensemble& ensemble) const {
    if (!measured_.line.empty()) return;
    const auto refuse = [&](const VecX& at, const std::string& rule) {
      throw io::bad_file(request_.measured, fmt::format("x, y = {:.10g}, {:.10g}", at[0], at[1]), rule,
                         "end points are in scene coordinates: map coordinates less site.origin");
    };
    const auto over_ground = [&](const VecX& at) { return std::isfinite(ensemble.height(at[0], at[1])); };
    if (std::ranges::none_of(measured_.points, over_ground))
      refuse(measured_.points.front(), "and no other of the end points lies over ground");
    constexpr double longest_way = 10e3;  // of a rock that falls [m]
    const auto world = ensemble.simulation(0);
    for (const VecX& at : measured_.points) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3& c : world->world().system->state().blocks.c)
        nearest = std::min(nearest, (c.head<2>() - at).norm());
      if (nearest > longest_way)
        refuse(at, fmt::format("lies {:.3g} km from where blocks start", nearest / 1e3));
    }
  }

  /// The largest values of a member at the line, if it crosses it.
  void add_passage(const Ensemble& ensemble, const Member& member, Points& points) const {
    const auto line = std::find_if(ensemble.lines().begin(), ensemble.lines().end(),
                                   [&](const PlanLine& l) { return l.name == measured_.line; });
    if (line == ensemble.lines().end())
      throw io::bad_file(request_.measured, "line " + measured_.line,
                         "the scene has no [[line]] of this name", "name one of the scene's");
    const Brief brief = brief_of(member, ensemble.lines().size());
    const Brief::Largest& largest = brief.lines[static_cast<std::size_t>(line - ensemble.lines().begin())];
    if (!largest.crosses) return;
    VecX p(measured_.scale.size());
    for (std::size_t k = 0; k < measured_.quantities.size(); ++k)
      p[static_cast<Eigen::Index>(k)] =
          largest.of[measured_.quantities[k]] / measured_.scale[static_cast<Eigen::Index>(k)];
    if (p.allFinite()) points.push_back(p);
  }

  const Candidate* best() const {
    const Candidate* found = nullptr;
    for (const Candidate& c : candidates_)
      if (std::isfinite(c.fitted) && (found == nullptr || c.fitted < found->fitted)) found = &c;
    return found;
  }

  bool shrink(std::vector<std::pair<double, double>>& box) const {
    const Candidate* centre = best();
    if (centre == nullptr) return false;
    for (std::size_t d = 0; d < box.size(); ++d) {
      const double half = (box[d].second - box[d].first) / 6;
      const Parameter& p = request_.parameters[d];
      box[d] = {std::max(p.low, centre->values[d] - half), std::min(p.high, centre->values[d] + half)};
    }
    return true;
  }

  /// Parameters are set as by --set; the user gave them by --vary.
  std::vector<Problem> by_their_option(std::vector<Problem> problems) const {
    for (Problem& p : problems)
      for (const Parameter& parameter : request_.parameters)
        if (p.file == "--set " + parameter.key) p.file = "--vary " + parameter.key;
    return problems;
  }

  scene::Overrides overrides_of(const std::vector<double>& of) const {
    scene::Overrides values = request_.overrides;
    for (std::size_t d = 0; d < of.size(); ++d) {
      const Parameter& p = request_.parameters[d];
      values.emplace_back(
          p.key, p.unit.empty() ? exact_text(of[d]) : fmt::format("\"{} {}\"", exact_text(of[d]), p.unit));
    }
    return values;
  }

  void evaluate(Candidate& c) const {
    std::optional<Ensemble> ensemble;
    try {
      ensemble.emplace(request_.scene, overrides_of(c.values));
    } catch (const InputError& error) {
      if (candidates_.empty()) throw InputError(by_their_option(error.problems()));
      c.fault = error.what();
      return;
    }
    const long n = ensemble->design().members();
    std::vector<std::optional<Member>> members(static_cast<std::size_t>(n));
    std::atomic<long> next{0};
    const auto work = [&] {
      for (long i = next.fetch_add(1); i < n; i = next.fetch_add(1)) {
        if (request_.stop != nullptr && request_.stop->load() != 0) return;
        members[static_cast<std::size_t>(i)] = ensemble->run(i, request_.stop);
      }
    };
    std::vector<std::thread> threads;
    for (int k = 1; k < request_.threads; ++k) threads.emplace_back(work);
    work();
    for (std::thread& t : threads) t.join();
    Points ends;
    for (const auto& m : members) {
      ++c.members;
      if (!m || !finished(m->status)) continue;
      ++c.finished;
      c.moving += m->moving ? 1 : 0;
      if (measured_.line.empty())
        for (const Vec3& e : m->end) ends.emplace_back(e.head<2>());
      else
        add_passage(*ensemble, *m, ends);
    }
    if (ends.empty()) {
      c.fault = c.finished == 0 ? "no member came to an end" : "no member crosses the line";
      return;
    }
    c.mean = VecX::Zero(measured_.scale.size());
    for (const auto& e : ends) c.mean += e.cwiseProduct(measured_.scale) / static_cast<double>(ends.size());
    c.fitted = energy_distance(ends, fitted_);
    c.held_out = held_out_.empty() ? c.held_out : energy_distance(ends, held_out_);
  }

  std::vector<std::string> report() const {
    const Candidate* found = best();
    if (found == nullptr)
      throw io::bad_file(request_.scene, "calibrate", "no candidate gave a member that came to an end",
                         "look at one by talus ensemble");
    const auto json = [&](const Candidate& c) {
      Json values = Json::object();
      for (std::size_t d = 0; d < c.values.size(); ++d) values[request_.parameters[d].key] = c.values[d];
      const auto number = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
      Json one{{"values", values},
               {"distance", number(c.fitted)},
               {"held_out_distance", number(c.held_out)},
               {"members", c.members},
               {"finished", c.finished},
               {"moving", c.moving},
               {measured_.line.empty() ? "mean_end" : "mean_passage",
                std::vector<double>(c.mean.begin(), c.mean.end())}};
      if (!c.fault.empty()) one["fault"] = c.fault;
      return one;
    };
    Json root{
        {"measured", {{"fitted", fitted_.size()}, {"held_out", held_out_.size()}}},
        {"measure", measured_.line.empty() ? "energy distance between end points in plan [m^(1/2)]"
                                           : "energy distance between passages at line " + measured_.line +
                                                 ", each quantity over its measured standard deviation"},
        {"best", json(*found)},
        {"asked", request_.candidates},
        {"candidates", Json::array()}};
    for (const Candidate& c : candidates_) root["candidates"].push_back(json(c));
    io::write_file(request_.directory / "calibration.json", root.dump(2) + "\n");
    std::vector<std::string> lines;
    const char* unit = measured_.line.empty() ? " m^(1/2)" : "";
    for (std::size_t d = 0; d < found->values.size(); ++d)
      lines.push_back(
          fmt::format("{} = {:.4g}{}", request_.parameters[d].key, found->values[d],
                      request_.parameters[d].unit.empty() ? "" : " " + request_.parameters[d].unit));
    lines.push_back(fmt::format("distance {:.4g}{} to the rows that were fitted, {:.4g}{} to those held out",
                                found->fitted, unit, found->held_out, unit));
    if (measured_.line.empty() && found->moving > 0)
      lines.push_back(fmt::format(
          "{} of {} members of it still moved when their time was over, and count where they "
          "were then, which is no end point; a longer simulation.duration would show where they stop",
          found->moving, found->members));
    return lines;
  }

  CalibrationRequest request_;
  Measured measured_;
  Points fitted_, held_out_;
  std::vector<Candidate> candidates_;
};

}  // namespace

Parameter parse_parameter(const std::string& text) {
  const auto fail = [&](std::string rule) {
    return InputError(Problem{.severity = Problem::Severity::error,
                              .file = "--vary",
                              .line = 0,
                              .column = 0,
                              .key = text,
                              .value = {},
                              .rule = std::move(rule),
                              .remedy = "write for example --vary interface.rock/slope.friction=0.4:0.8"});
  };
  const auto equals = text.find('='), colon = text.find(':', equals == std::string::npos ? 0 : equals);
  if (equals == std::string::npos || equals == 0 || colon == std::string::npos)
    throw fail("must be KEY=LOW:HIGH");
  std::string error;
  const auto low = parse_quantity(text.substr(equals + 1, colon - equals - 1), error),
             high = parse_quantity(text.substr(colon + 1), error);
  if (!low || !high) throw fail(error);
  if (low->dimension != high->dimension) throw fail("low and high are of different units");
  if (!(low->value < high->value)) throw fail("low must be less than high");
  return {text.substr(0, equals), low->value, high->value,
          low->dimension.none() ? "" : unit_name(low->dimension)};
}

double energy_distance(const Points& a, const Points& b) {
  return std::sqrt(std::max(0.0, 2 * mean_distance(a, b) - mean_distance(a, a) - mean_distance(b, b)));
}

void check(const CalibrationRequest& request) { Calibration(request).check(); }

std::vector<std::string> calibrate(const CalibrationRequest& request) { return Calibration(request).run(); }

}  // namespace talus::ensemble
