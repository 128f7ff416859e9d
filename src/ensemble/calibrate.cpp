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

#include "core/units.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/sobol.hpp"
#include "io/files.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;
using Points = std::vector<Eigen::Vector2d>;

constexpr int held_out_every = 4;

double mean_distance(const Points& a, const Points& b) {
  double sum = 0;
  for (const auto& p : a)
    for (const auto& q : b) sum += (p - q).norm();
  return sum / (static_cast<double>(a.size()) * static_cast<double>(b.size()));
}

std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : line) {
    if (c == ',' || c == ';' || c == '\t') words.push_back(std::exchange(word, {}));
    else if (c != ' ' && c != '\r' && c != '"') word += c;
  }
  words.push_back(word);
  return words;
}

Points read_points(const fs::path& file) {
  std::istringstream text(io::read_file(file));
  std::string line;
  std::vector<std::string> header;
  Points points;
  int number = 0;
  std::size_t x = 0, y = 0;
  while (std::getline(text, line)) {
    ++number;
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> words = words_of(line);
    if (header.empty()) {
      header = words;
      const auto column = [&](const char* name) {
        const auto found = std::find(header.begin(), header.end(), name);
        if (found == header.end()) throw io::bad_file(file, name, "is no column of the file", "name the columns x and y in the first row; scene coordinates");
        return static_cast<std::size_t>(found - header.begin());
      };
      x = column("x"), y = column("y");
      continue;
    }
    const auto value = [&](std::size_t k) {
      std::string error;
      const auto q = k < words.size() ? parse_quantity(words[k], error) : std::nullopt;
      if (!q) throw io::bad_file(file, fmt::format("line {}", number), fmt::format("\"{}\" is no number", k < words.size() ? words[k] : ""), "correct the line");
      return q->value;
    };
    points.emplace_back(value(x), value(y));
  }
  if (points.size() < 4) throw io::bad_file(file, "rows", fmt::format("{} measured points are too few", points.size()), "give at least 4");
  return points;
}

struct Candidate {
  std::vector<double> values;
  double fitted = std::numeric_limits<double>::quiet_NaN(), held_out = fitted;   // energy distances [m]
  long members = 0, finished = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  std::string fault;
};

class Calibration {
 public:
  explicit Calibration(const CalibrationRequest& r) : request_(r) {
    const Points all = read_points(r.measured);
    for (std::size_t i = 0; i < all.size(); ++i) (i % held_out_every == held_out_every - 1 ? held_out_ : fitted_).push_back(all[i]);
  }

  std::vector<std::string> run() {
    const int first = (request_.candidates + 1) / 2;
    const Sobol sobol(static_cast<int>(request_.parameters.size()), 1);
    std::vector<std::pair<double, double>> box;
    for (const Parameter& p : request_.parameters) box.emplace_back(p.low, p.high);
    for (int k = 0; k < request_.candidates; ++k) {
      if (k == first && !shrink(box)) break;
      Candidate c;
      for (std::size_t d = 0; d < box.size(); ++d) c.values.push_back(box[d].first + (box[d].second - box[d].first) * sobol.coordinate(static_cast<std::uint64_t>(k) * replicates, static_cast<int>(d)));
      evaluate(c);
      if (request_.stop != nullptr && request_.stop->load() != 0) return {};
      candidates_.push_back(std::move(c));
      if (request_.progress) request_.progress(k + 1, request_.candidates);
    }
    return report();
  }

 private:
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

  void evaluate(Candidate& c) const {
    scene::Overrides values = request_.overrides;
    for (std::size_t d = 0; d < c.values.size(); ++d) {
      const Parameter& p = request_.parameters[d];
      values.emplace_back(p.key, p.unit.empty() ? exact_text(c.values[d]) : fmt::format("\"{} {}\"", exact_text(c.values[d]), p.unit));
    }
    std::optional<Ensemble> ensemble;
    try {
      ensemble.emplace(request_.scene, values);
    } catch (const InputError& error) {
      if (candidates_.empty()) throw;
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
      for (const Vec3& e : m->end) ends.emplace_back(e.head<2>());
    }
    if (ends.empty()) {
      c.fault = "no member came to an end";
      return;
    }
    for (const auto& e : ends) c.mean += e / static_cast<double>(ends.size());
    c.fitted = energy_distance(ends, fitted_);
    c.held_out = held_out_.empty() ? c.held_out : energy_distance(ends, held_out_);
  }

  std::vector<std::string> report() const {
    const Candidate* found = best();
    if (found == nullptr) throw io::bad_file(request_.scene, "calibrate", "no candidate gave a member that came to an end", "look at one by talus ensemble");
    const auto json = [&](const Candidate& c) {
      Json values = Json::object();
      for (std::size_t d = 0; d < c.values.size(); ++d) values[request_.parameters[d].key] = c.values[d];
      const auto number = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
      Json one{{"values", values}, {"distance", number(c.fitted)}, {"held_out_distance", number(c.held_out)}, {"members", c.members}, {"finished", c.finished}, {"mean_end", {c.mean.x(), c.mean.y()}}};
      if (!c.fault.empty()) one["fault"] = c.fault;
      return one;
    };
    Json root{{"measured", {{"fitted", fitted_.size()}, {"held_out", held_out_.size()}}}, {"measure", "energy distance between end points in plan [m]"}, {"best", json(*found)}, {"candidates", Json::array()}};
    for (const Candidate& c : candidates_) root["candidates"].push_back(json(c));
    io::write_file(request_.directory / "calibration.json", root.dump(2) + "\n");
    std::vector<std::string> lines;
    for (std::size_t d = 0; d < found->values.size(); ++d) lines.push_back(fmt::format("{} = {:.4g}{}", request_.parameters[d].key, found->values[d], request_.parameters[d].unit.empty() ? "" : " " + request_.parameters[d].unit));
    lines.push_back(fmt::format("distance {:.4g} m to the points that were fitted, {:.4g} m to those held out", found->fitted, found->held_out));
    return lines;
  }

  CalibrationRequest request_;
  Points fitted_, held_out_;
  std::vector<Candidate> candidates_;
};

}  // namespace

Parameter parse_parameter(const std::string& text) {
  const auto fail = [&](std::string rule) {
    return InputError(Problem{.severity = Problem::Severity::error, .file = "--vary", .line = 0, .column = 0, .key = text, .value = {}, .rule = std::move(rule), .remedy = "write for example --vary interface.rock/slope.friction=0.4:0.8"});
  };
  const auto equals = text.find('='), colon = text.find(':', equals == std::string::npos ? 0 : equals);
  if (equals == std::string::npos || equals == 0 || colon == std::string::npos) throw fail("must be KEY=LOW:HIGH");
  std::string error;
  const auto low = parse_quantity(text.substr(equals + 1, colon - equals - 1), error), high = parse_quantity(text.substr(colon + 1), error);
  if (!low || !high) throw fail(error);
  if (low->dimension != high->dimension) throw fail("low and high are of different units");
  if (!(low->value < high->value)) throw fail("low must be less than high");
  return {text.substr(0, equals), low->value, high->value, low->dimension.none() ? "" : unit_name(low->dimension)};
}

double energy_distance(const Points& a, const Points& b) { return std::sqrt(std::max(0.0, 2 * mean_distance(a, b) - mean_distance(a, a) - mean_distance(b, b))); }

std::vector<std::string> calibrate(const CalibrationRequest& request) { return Calibration(request).run(); }

}  // namespace talus::ensemble
