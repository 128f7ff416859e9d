#include "fem/rebar/rebar_geometry.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "core/table.hpp"
#include "core/text_file.hpp"

namespace talus::rebar {
namespace {

Problem problem(const std::string& key, const std::string& value, const std::string& rule,
                const std::string& remedy) {
  Problem p;
  p.key = key, p.value = value, p.rule = rule, p.remedy = remedy;
  return p;
}

constexpr const char* header_remedy =
    "the header is bar,diameter,x,y,z,grade and optionally prestress, in any order";

/// Bars of a table, a point in each row. Throws InputError with all that is wrong with it.
class BarReader {
 public:
  BarReader(const std::string& text, const std::string& name)
      : name_(name), separator_(table_separator(text)) {
    std::istringstream in(text);
    std::string line;
    while (std::getline(in, line) && problems_.size() < enough) {
      ++number_;
      if (is_blank_row(line)) continue;
      const std::vector<TableCell> cells = table_cells(line, separator_);
      if (column_.empty())
        read_header(cells);
      else
        read_row(cells);
    }
    check_all();
  }
  std::vector<Bar> bars() && { return std::move(bars_); }

 private:
  static constexpr std::size_t enough = 50;  // problems; a file of another kind would give one per line

  void add(int line, int column, const std::string& key, const std::string& value, const std::string& rule,
           const std::string& remedy) {
    Problem& p = problems_.emplace_back(problem(key, value, rule, remedy));
    p.file = name_, p.line = line, p.column = column;
  }
  void add(int column, const std::string& key, const std::string& value, const std::string& rule,
           const std::string& remedy) {
    add(number_, column, key, value, rule, remedy);
  }

  void read_header(const std::vector<TableCell>& cells) {
    static const std::set<std::string> allowed{"bar", "diameter", "x", "y", "z", "grade", "prestress"};
    std::string strangers, lacking;
    int place = 0;
    for (const TableCell& c : cells) {
      const std::string title = column_name(c.text);
      if (!allowed.count(title)) {
        strangers += (strangers.empty() ? "" : ", ") + c.text;
        if (place == 0) place = c.column;
      } else if (!column_.emplace(title, static_cast<int>(&c - cells.data())).second) {
        add(c.column, "rebar column", c.text, "given twice", header_remedy);
      }
    }
    for (const char* needed : {"bar", "diameter", "x", "y", "z", "grade"})
      if (!column_.count(needed)) lacking += (lacking.empty() ? "" : ", ") + std::string(needed);
    if (!lacking.empty())
      add(place, "rebar columns", lacking,
          strangers.empty() ? "missing" : fmt::format("missing; there is {}", strangers), header_remedy);
    else if (!strangers.empty())
      add(place, "rebar column", strangers, "unknown column", header_remedy);
    if (!problems_.empty()) throw InputError(problems_);
    header_size_ = cells.size();
  }

  const TableCell& cell(const std::vector<TableCell>& cells, const char* key) const {
    return cells[static_cast<std::size_t>(column_.at(key))];
  }

  double value(const std::vector<TableCell>& cells, const char* key) {
    const TableCell& c = cell(cells, key);
    const std::string digits = with_decimal_point(c, separator_);
    double x = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
    if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(x))
      add(c.column, key, c.text, "not a finite number", "SI units without a unit: metres, pascals");
    return x;
  }

  void read_row(const std::vector<TableCell>& cells) {
    if (cells.size() != header_size_)
      return add(0, "rebar row", fmt::format("{} values", cells.size()),
                 fmt::format("expected {} values as in the header", header_size_),
                 separator_ == ',' && cells.size() > header_size_
                     ? "are the commas decimal ones? Write decimal points, or separate the "
                       "columns by semicolons"
                     : "give each bar's point in a row of its own, all columns filled");
    const std::size_t before = problems_.size();
    const TableCell& id = cell(cells, "bar");
    const double diameter = value(cells, "diameter"), x = value(cells, "x"), y = value(cells, "y"),
                 z = value(cells, "z"),
                 prestress = column_.count("prestress") ? value(cells, "prestress") : 0.0;
    if (id.text.empty())
      add(id.column, "bar", "", "a bar needs a name", "give the same name in each row of one bar");
    if (problems_.size() == before && !(diameter > 0 && diameter <= 0.2))
      add(cell(cells, "diameter").column, fmt::format("bar {} diameter", id.text),
          fmt::format("{:g} m", diameter), "must be positive and at most 0.2 m",
          diameter > 1 ? "diameters are in metres: 0.025, not 25" : "correct it");
    if (problems_.size() > before) return;
    if (bars_.empty() || bars_.back().name != id.text) {
      if (!bars_.empty()) finished_.insert(bars_.back().name);
      if (finished_.count(id.text))
        return add(id.column, "bar", id.text, "its rows are not together",
                   "give the points of one bar in consecutive rows");
      begin_bar(cells, id.text, diameter, prestress);
    } else if (bars_.back().diameter != diameter) {
      add(cell(cells, "diameter").column, fmt::format("bar {} diameter", id.text),
          fmt::format("{:g} m", diameter),
          fmt::format("differs from {:g} m in line {}", bars_.back().diameter, bars_.back().line),
          "one diameter for each bar");
    }
    const Vec3 point(x, y, z);
    if (!bars_.back().points.empty() && (point - bars_.back().points.back()).norm() < 1e-9)
      add(0, fmt::format("bar {}", id.text), "", "two consecutive points coincide", "remove one of the rows");
    bars_.back().points.push_back(point);
  }

  void begin_bar(const std::vector<TableCell>& cells, const std::string& id, double diameter,
                 double prestress) {
    Bar bar;
    bar.name = id;
    bar.diameter = diameter;
    bar.file = name_;
    bar.line = number_;
    try {
      bar.steel =
          material::steel_grade(cell(cells, "grade").text, fmt::format("bar {} grade", id), name_, number_);
      bar.steel.prestress = prestress;
      material::Steel check(bar.steel);
    } catch (const InputError& e) {
      for (Problem p : e.problems()) {
        p.file = name_;
        p.line = number_;
        if (p.key == "steel.prestress")
          p.key = fmt::format("bar {} prestress", id), p.column = cell(cells, "prestress").column;
        problems_.push_back(p);
      }
    }
    bars_.push_back(std::move(bar));
  }

  void check_all() {
    const bool header = !column_.empty();
    if (!header) add(1, 0, "rebar", "", "the file has no header", header_remedy);
    for (const Bar& b : bars_)
      if (b.points.size() < 2 && problems_.size() < enough)
        add(b.line, 0, fmt::format("bar {}", b.name), "1 point", "a bar needs two points or more",
            "add its end point as another row");
    if (header && bars_.empty() && problems_.empty())
      add(0, "rebar", "", "the file has no bars", "add rows, or drop the key");
    if (!problems_.empty()) throw InputError(problems_);
  }

  std::string name_;
  char separator_;
  int number_ = 0;                     // of the line
  std::map<std::string, int> column_;  // name -> position; empty: no header yet
  std::size_t header_size_ = 0;
  std::set<std::string> finished_;
  std::vector<Problem> problems_;
  std::vector<Bar> bars_;
};

}  // namespace

double Bar::length() const {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

std::vector<Bar> read_bars(const std::string& path) { return parse_bars(read_text(path), path); }

std::vector<Bar> parse_bars(const std::string& text, const std::string& name) {
  return BarReader(text, name).bars();
}

namespace {

void check_member(const Member& m, const std::string& key, double diameter, double cover, double inset,
                  std::vector<Problem>& problems) {
  const auto bad = [&](const char* name, double v, const char* rule, const char* remedy) {
    problems.push_back(problem(key + "." + name, fmt::format("{:g} m", v), rule, remedy));
  };
  if (!(m.width > 0)) bad("width", m.width, "must be positive", "give the section");
  if (m.section == Member::Section::rectangular && !(m.depth > 0))
    bad("depth", m.depth, "must be positive", "give the section");
  if (!(m.length > 0)) bad("length", m.length, "must be positive", "give the length of the member");
  if (!(diameter > 0 && diameter <= 0.2))
    bad("diameter", diameter, "must be positive and at most 0.2 m", "0.025 m");
  if (!(cover > 0)) bad("cover", cover, "must be positive", "0.04 m");
  const double least = m.section == Member::Section::rectangular ? std::min(m.width, m.depth) : m.width;
  if (problems.empty() && 2 * inset >= least)
    bad("cover", cover, "leaves no room for the bars in the section", "reduce cover or diameter");
}

Vec3 place(const Member& m, double x, double y, double z) {
  const Vec3 along = m.axis_x.cross(m.axis_y).normalized();
  return m.base + x * m.axis_x.normalized() + y * m.axis_y.normalized() + z * along;
}

}  // namespace

std::vector<Bar> longitudinal_bars(const Member& m, const LongitudinalRule& rule, const std::string& key) {
  std::vector<Problem> problems;
  const double inset = rule.cover + rule.stirrup_diameter + 0.5 * rule.diameter;
  check_member(m, key, rule.diameter, rule.cover, inset, problems);
  if (rule.bars < 4)
    problems.push_back(
        problem(key + ".bars", fmt::format("{}", rule.bars), "must be at least 4", "one bar in each corner"));
  if (!problems.empty()) throw InputError(problems);

  std::vector<std::array<double, 2>> at;
  double apart = 0;  // axes of neighbours
  if (m.section == Member::Section::round) {
    const double r = 0.5 * m.width - inset;
    for (int i = 0; i < rule.bars; ++i) {
      const double angle = 2 * M_PI * i / rule.bars;
      at.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    apart = 2 * r * std::sin(M_PI / rule.bars);
  } else {
    // Corners first; the rest goes to the sides in opposite pairs, always where the spacing is widest; an odd
    // one to the -y side.
    const double a = m.width - 2 * inset, b = m.depth - 2 * inset;
    int along_x[2] = {0, 0}, along_y = 0;  // inner bars of the sides -y, +y; of each of the sides -x, +x
    int left = rule.bars - 4;
    while (left >= 2) {
      if (a / (along_x[0] + 1) >= b / (along_y + 1)) {
        ++along_x[0];
        ++along_x[1];
      } else {
        ++along_y;
      }
      left -= 2;
    }
    along_x[0] += left;
    apart = std::min(a / (along_x[0] + 1), b / (along_y + 1));
    for (const double sx : {-0.5, 0.5})
      for (const double sy : {-0.5, 0.5}) at.push_back({sx * a, sy * b});
    for (int side = 0; side < 2; ++side)
      for (int i = 1; i <= along_x[side]; ++i)
        at.push_back({a * (double(i) / (along_x[side] + 1) - 0.5), (side == 0 ? -0.5 : 0.5) * b});
    for (const double sx : {-0.5, 0.5})
      for (int i = 1; i <= along_y; ++i) at.push_back({sx * a, b * (double(i) / (along_y + 1) - 0.5)});
  }
  if (apart < rule.diameter)
    throw InputError(problem(key + ".bars", fmt::format("{}", rule.bars),
                             fmt::format("bars of {:.3g} mm would lie {:.3g} mm apart, one in another",
                                         1e3 * rule.diameter, 1e3 * apart),
                             "fewer bars, or thinner ones"));
  const double end = std::min(rule.cover, 0.25 * m.length);
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < at.size(); ++i) {
    Bar bar;
    bar.name = fmt::format("L{}", i + 1);
    bar.diameter = rule.diameter;
    bar.steel = rule.steel;
    bar.points = {place(m, at[i][0], at[i][1], m.held_start ? 0 : end),
                  place(m, at[i][0], at[i][1], m.length - (m.held_end ? 0 : end))};
    bars.push_back(std::move(bar));
  }
  return bars;
}

std::vector<Bar> stirrups(const Member& m, const StirrupRule& rule, const std::string& key) {
  std::vector<Problem> problems;
  const double inset = rule.cover + 0.5 * rule.diameter;
  check_member(m, key, rule.diameter, rule.cover, inset, problems);
  if (!(rule.spacing > rule.diameter))
    problems.push_back(problem(key + ".spacing", fmt::format("{:g} m", rule.spacing),
                               "must be above the diameter", "0.2 m"));
  if (!problems.empty()) throw InputError(problems);
  if (m.length / rule.spacing > 1e5)
    throw InputError(problem(key + ".spacing", fmt::format("{:g} m", rule.spacing),
                             "gives more than 100000 stirrups", "0.2 m"));
  const int count = std::max(1, static_cast<int>(std::floor(m.length / rule.spacing + 1e-9)));
  const double first = 0.5 * (m.length - (count - 1) * rule.spacing);
  std::vector<Bar> bars;
  for (int i = 0; i < count; ++i) {
    Bar bar;
    bar.name = fmt::format("S{}", i + 1);
    bar.diameter = rule.diameter;
    bar.steel = rule.steel;
    const double z = first + i * rule.spacing;
    if (m.section == Member::Section::round) {
      constexpr int sides = 24;
      const double r = 0.5 * m.width - inset;
      for (int k = 0; k <= sides; ++k) {
        const double angle = 2 * M_PI * (k % sides) / sides;
        bar.points.push_back(place(m, r * std::cos(angle), r * std::sin(angle), z));
      }
    } else {
      const double x = 0.5 * m.width - inset, y = 0.5 * m.depth - inset;
      bar.points = {place(m, -x, -y, z), place(m, x, -y, z), place(m, x, y, z), place(m, -x, y, z),
                    place(m, -x, -y, z)};
    }
    bars.push_back(std::move(bar));
  }
  return bars;
}

}  // namespace talus::rebar
