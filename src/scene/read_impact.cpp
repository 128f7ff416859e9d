#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/suggest.hpp"
#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

constexpr double least_mass = 1e-15;  // of a block by a file [kg]: a grain of a thousandth of a millimetre

/// Columns of the history of blocks as talus convert writes it, "B1.position.x [m]", under the names of a
/// trajectories file. Of several blocks the one that `wanted` names; empty: there is one. Other headers are
/// in lower case; none if a problem was reported.
std::optional<std::vector<std::string>> named_columns(const View& view, std::vector<std::string> header,
                                                      const std::string& wanted) {
  static const std::map<std::string, std::string> names{
      {"position.x", "x"},    {"position.y", "y"},     {"position.z", "z"},     {"velocity.x", "vx"},
      {"velocity.y", "vy"},   {"velocity.z", "vz"},    {"spin.x", "wx"},        {"spin.y", "wy"},
      {"spin.z", "wz"},       {"orientation.w", "qw"}, {"orientation.x", "qx"}, {"orientation.y", "qy"},
      {"orientation.z", "qz"}};
  std::vector<std::string> blocks;
  for (const std::string& column : header)
    if (const std::size_t end = column.rfind(".position.x"); end != std::string::npos && end > 0)
      blocks.push_back(column.substr(0, end));
  if (blocks.empty()) {
    for (std::string& column : header) column = column_name(column);
    if (wanted.empty()) return header;
    view.problem("block", "the trajectories file holds no histories of blocks",
                 "remove the key, or convert results.h5#/history/blocks to CSV");
    return {};
  }
  std::string block = wanted.empty() && blocks.size() == 1 ? blocks[0] : wanted;
  if (block.empty()) {
    view.problem(
        "block", fmt::format("the trajectories file holds the histories of {} blocks", blocks.size()),
        fmt::format(
            "name one of them: {}{}",
            fmt::join(blocks.begin(),
                      blocks.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(blocks.size(), 5)),
                      ", "),
            blocks.size() > 5 ? ", ..." : ""));
    return {};
  }
  if (std::find(blocks.begin(), blocks.end(), block) == blocks.end()) {
    const std::string near = nearest_name(block, blocks);
    view.problem("block", "the trajectories file holds no such block",
                 near.empty() ? fmt::format("name one of it: {}", blocks[0])
                              : fmt::format("did you mean \"{}\"?", near));
    return {};
  }
  for (std::string& column : header) {
    if (!column.starts_with(block + ".")) continue;
    const std::string rest = column.substr(block.size() + 1);
    if (const auto known = names.find(rest.substr(0, rest.find(" ["))); known != names.end())
      column = known->second;
  }
  return header;
}

/// What the columns of a trajectories file hold.
const std::vector<std::pair<Dimension, std::vector<std::string>>>& trajectory_columns() {
  static const std::vector<std::pair<Dimension, std::vector<std::string>>> columns{
      {dimension::length, {"x", "y", "z"}},
      {dimension::velocity, {"vx", "vy", "vz"}},
      {dimension::angular_velocity, {"wx", "wy", "wz"}},
      {dimension::number, {"qw", "qx", "qy", "qz"}},
      {dimension::mass, {"mass"}},
      {dimension::volume, {"volume"}}};
  return columns;
}

std::optional<Dimension> dimension_of_column(const std::string& name) {
  for (const auto& [of, names] : trajectory_columns())
    if (std::find(names.begin(), names.end(), column_name(name)) != names.end()) return of;
  return {};
}

/// One row of a trajectories file, its numbers by the names of their columns.
struct TrajectoryRow {
  const View& view;
  std::vector<std::string> header;
  std::vector<double> values;
  std::string name;  // "row 1 (line 2)"

  std::optional<double> column(const std::string& wanted) const {
    for (std::size_t i = 0; i < header.size() && i < values.size(); ++i)
      if (header[i] == wanted) return values[i];
    return {};
  }
  void problem(const std::string& what, const std::string& rule, const std::string& remedy) const {
    view.problem("trajectories", fmt::format("{} of the file: {}: {}", name, what, rule), remedy);
  }

  /// The bounds that the scene's own keys have.
  void check(double density) const {
    for (const auto& [of, names] : trajectory_columns())
      for (const std::string& wanted : names)
        if (const auto value = column(wanted); value && !(std::abs(*value) <= largest(of)))
          problem(fmt::format("{} = {:g}", wanted, *value),
                  fmt::format("must not exceed {:g}{}{}", largest(of), of.none() ? "" : " ",
                              of.none() ? "" : unit_name(of)),
                  "check the number: without a unit in its first row the file is in SI");
    const auto mass = column("mass"), volume = column("volume");
    if (mass && !(*mass >= least_mass))
      problem(fmt::format("mass = {:g}", *mass),
              fmt::format("the mass in this row must be > 0, and at least {:g} kg", least_mass),
              "correct the file");
    if (volume && !(*volume * (density > 0 ? density : 1) >= least_mass))
      problem(fmt::format("volume = {:g}", *volume),
              fmt::format("the volume in this row must be > 0, and its mass at least {:g} kg", least_mass),
              "correct the file");
    if (mass && volume && density > 0 && *mass > 0 && std::abs(*volume * density / *mass - 1) > 0.01)
      problem(fmt::format("mass = {:g}, volume = {:g}", *mass, *volume),
              fmt::format("contradict each other: with the material's {:g} kg/m^3 this volume has {:.4g} kg",
                          density, *volume * density),
              "leave one of the columns out, or correct the density");
  }
};

}  // namespace

void read_impact(Reading& in, const View& root) {
  const auto view = root.table("impact");
  if (!view) return;
  Impact impact;
  std::vector<std::string> names;
  for (const StructureSpec& s : in.scene.structures) names.push_back(s.name);
  if (names.empty() && !root.has("structure"))
    view->problem("", "there is no structure to strike", "add a [[structure]]");
  if (names.size() > 1) view->missing("structure", "the scene has more than one");
  if (view->get("structure")) {
    const std::string name = view->text("structure");
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end())
      impact.structure = static_cast<int>(found - names.begin());
    else {
      const std::string near = nearest_name(name, names);
      view->problem(
          "structure", "there is no such structure",
          near.empty() ? "name one of the scene's structures" : fmt::format("did you mean \"{}\"?", near));
    }
  }
  impact.material = in.material(*view, "material");
  impact.shape = read_shape(in, *view, view->has("trajectories"));
  impact.rotation = read_orientation(*view);
  impact.spin = view->vector("spin");
  impact.point = view->vector("point");
  impact.clearance = view->number("clearance");
  const bool soft =
      !in.scene.materials.empty() && in.scene.materials[static_cast<std::size_t>(impact.material)].young > 0;
  impact.deformable = view->maybe_flag("deformable").value_or(soft);
  if (impact.deformable && !soft)
    view->problem("deformable", "a deformable block needs a material with young",
                  "add young to the material, or remove deformable");
  if (in.has_material(*view, "material") &&
      !(in.scene.materials[static_cast<std::size_t>(impact.material)].density > 0))
    view->problem("material", "the material has no density, and a block is made of it",
                  "add density to the [[material]]");

  if (view->has("trajectories")) {
    for (const char* key : {"velocity", "point", "angle", "direction"})
      if (view->has(key)) view->problem(key, "the trajectories file gives it", "remove it, or the file");
    const std::string path = in.file(*view, "trajectories", true);
    if (path.empty()) return;
    const auto [rows, header, lines, units] =
        read_numbers(*view, "trajectories", path, 0, [](std::size_t, const std::string& name) {
          const auto of = dimension_of_column(name);
          return ColumnHolds{of.has_value(), of};
        });
    const auto row = static_cast<std::size_t>(view->integer("row"));
    if (rows.empty()) return;
    if (row > rows.size()) {
      view->problem("row", fmt::format("the file has {} rows", rows.size()), "choose one of them");
      return;
    }
    const auto named = named_columns(*view, header, view->text("block"));
    if (!named) return;
    const TrajectoryRow numbers{*view, *named, rows[row - 1],
                                fmt::format("row {} (line {})", row, lines[row - 1])};
    const auto column = [&](const std::string& name) { return numbers.column(name); };
    for (const char* name :
         {"x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "qw", "qx", "qy", "qz", "mass", "volume"})
      if (std::count(named->begin(), named->end(), name) > 1) {
        view->problem("trajectories", fmt::format("the header of the file has two columns {}", name),
                      "remove one of them");
        return;
      }
    impact.trajectory = fmt::format("{} of {}", numbers.name, path);
    std::string lacking;
    for (const char* name : {"x", "y", "z", "vx", "vy", "vz"})
      if (!column(name)) lacking += (lacking.empty() ? "" : ", ") + std::string(name);
    if (!lacking.empty()) {
      view->problem("trajectories", fmt::format("the header of the file lacks {}", lacking),
                    "name the columns x, y, z, vx, vy, vz in the first row");
      return;
    }
    impact.point = Vec3(*column("x"), *column("y"), *column("z"));
    impact.velocity = Vec3(*column("vx"), *column("vy"), *column("vz"));
    if (!(impact.velocity.norm() > 0))
      numbers.problem("vx, vy, vz", "the velocity in this row must not be zero",
                      "choose another row, or correct the file");
    numbers.check(in.scene.materials.empty()
                      ? 0.0
                      : in.scene.materials[static_cast<std::size_t>(impact.material)].density);
    for (const char* key : {"mass", "volume"})
      if (view->has(key) && (column("mass") || column("volume")))
        view->problem(
            key,
            fmt::format("the trajectories file has a column {} already", column("mass") ? "mass" : "volume"),
            "remove the key, or the column");
    // Spin and orientation where the file has them and the scene does not say otherwise.
    const auto all_of = [&](const std::vector<std::string>& names,
                            const char* key) -> std::optional<std::vector<double>> {
      std::vector<double> values;
      for (const std::string& name : names)
        if (const auto value = column(name)) values.push_back(*value);
      if (values.empty() || view->has(key)) return {};
      if (values.size() == names.size()) return values;
      view->problem("trajectories",
                    fmt::format("the header of the file has some of {} but not all", fmt::join(names, ", ")),
                    fmt::format("name all of them, or none and give {}", key));
      return {};
    };
    if (const auto w = all_of({"wx", "wy", "wz"}, "spin")) impact.spin = Vec3((*w)[0], (*w)[1], (*w)[2]);
    if (const auto q = all_of({"qw", "qx", "qy", "qz"}, "orientation")) {
      const Quat turn((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
      if (turn.norm() > 0)
        impact.rotation = turn.normalized().toRotationMatrix();
      else
        numbers.problem("qw, qx, qy, qz", "the quaternion in this row must not be zero", "correct the file");
    }
    if (column("mass"))
      impact.shape.mass = *column("mass");
    else if (column("volume"))
      impact.shape.volume = *column("volume");
    const bool sized = impact.shape.mass > 0 || impact.shape.volume > 0 || impact.shape.diameter > 0 ||
                       impact.shape.size.x() > 0 || !impact.shape.vertices.empty() ||
                       !impact.shape.file.empty();
    if (!sized && !column("mass") && !column("volume"))
      view->problem("trajectories", "the file has no column mass or volume, and the block has no size",
                    "add the column, or give volume, mass or size");
  } else {
    view->missing("velocity", "needed unless trajectories are given");
    view->missing("point", "needed unless trajectories are given");
    if (const Node* velocity = view->get("velocity"); velocity && velocity->kind == Node::Kind::array) {
      impact.velocity = vector_of(*velocity, dimension::velocity);
      for (const char* key : {"angle", "direction"})
        if (view->has(key))
          view->problem(key, "the velocity is a vector already", "give a speed, or remove it");
    } else if (velocity) {
      const double speed = view->maybe("velocity").value_or(0), down = view->number("angle"),
                   azimuth = view->number("direction");
      impact.velocity = speed * Vec3(std::cos(down) * std::sin(azimuth), std::cos(down) * std::cos(azimuth),
                                     -std::sin(down));
    }
  }
  if (view->get("velocity") && !(impact.velocity.norm() > 0))
    view->problem("velocity", "must not be zero", "give the velocity the block arrives with");
  in.scene.impact = std::move(impact);
}

}  // namespace talus::scene
