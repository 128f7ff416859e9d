// What will be computed, what is left out and why; what it will need.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "contact/geometry/plumb.hpp"
#include "contact/laws/impact_damping.hpp"
#include "coupling/touch/touch_spring.hpp"
#include "sim/fineness.hpp"
#include "sim/ground.hpp"
#include "sim/rock_mass.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::sim {
namespace {

/// CPU time of a whole run [s] that hardly any exceeds, and what is known of its parts. How long blocks move
/// and touch decides by two orders of magnitude, so that no single figure is given.
struct TimeBound {
  double most = 0;
  std::string text;
};

/// Measured costs of one core (docs/results/robustness.md): a moving block's step, and an element's explicit
/// sub-step, contacts included [s]. A few blocks cost more for each, since their impacts are located in time.
constexpr int few = 12;
constexpr double block_step = 1e-4, block_step_of_few = 5e-4, paper_block_step = 3e-5;
constexpr double element_step = 4e-7, element_step_damage = 1.8e-6;

std::string spoken(double seconds) {
  if (seconds < 1) return "a second";
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 100 * 60) return fmt::format("{:.0f} min", seconds / 60);
  return seconds < 100 * 3600 ? fmt::format("{:.0f} h", seconds / 3600)
                              : fmt::format("{:.0f} days", seconds / 86400);
}

/// Steps per simulated second of a moving block by `accuracy`: some hundreds for a metre at 1e-3, fewer for
/// larger ones, as their time scale sqrt(size/g) is longer.
double block_steps_per_second(const World& w) {
  if (w.scene.simulation.step) return 1 / *w.scene.simulation.step;
  std::vector<double> sizes;
  for (const dda::Model::Block& b : w.system->model().blocks)
    if (!b.fixed) sizes.push_back(std::cbrt(b.volume));
  if (sizes.empty()) return 0;
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  return 300 / std::sqrt(std::max(sizes[sizes.size() / 2], 1e-3));
}

/// CPU time of a simulated second of a structure that is touched or cracks [s].
double touched_second(const Structure& structure, const StructureSpec& spec) {
  return static_cast<double>(structure.elements()) / structure.critical_step() *
         (spec.damage == "none" ? element_step : element_step_damage);
}

TimeBound time_bound(const World& w) {
  const double duration = std::max(w.scene.simulation.duration - w.time(), 0.0);
  double moving = 0;
  for (const dda::Model::Block& b : w.system->model().blocks) moving += b.fixed ? 0 : 1;
  TimeBound bound;
  if (w.paper) {  // every block takes every step
    const double all = moving * duration / w.scene.simulation.step.value_or(1e-4) * paper_block_step;
    return {all * 10, ""};
  }
  const double blocks =
      moving * duration * block_steps_per_second(w) * (moving <= few ? block_step_of_few : block_step);
  bound.most = 8 * blocks;
  const auto& parts = w.system->environment().structures;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].fixed_surface && !parts[i].one_way) continue;
    const StructureSpec& spec = w.scene.structures[i];
    const double second = touched_second(*parts[i].structure, spec);
    bound.text += fmt::format("; each second that {} is touched{} takes some {}, quiet ones next to nothing",
                              spec.name, spec.damage == "none" ? "" : " or cracks", spoken(second));
    bound.most += 5 * second * duration;
  }
  return bound;
}

/// Smallest and largest volume of the blocks that move [m^3].
std::pair<double, double> volumes(const World& w) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const dda::Model::Block& b : w.system->model().blocks)
    if (!b.fixed) least = std::min(least, b.volume), most = std::max(most, b.volume);
  return {least, most};
}

std::string time_line(const World& w) {
  // The condition of a contact problem goes with the ratio of the masses that press on each other, and the
  // iterations of its solution with that.
  constexpr double unlike = 1e5;
  const auto [smallest, largest] = volumes(w);
  const auto moving =
      std::ranges::count_if(w.system->model().blocks, [](const dda::Model::Block& b) { return !b.fixed; });
  if (!w.paper && moving > few && largest > unlike * smallest)
    return fmt::format(
        "CPU time: unknown. The volumes of the {} blocks that move lie between {:.2g} and {:.2g} m^3: how "
        "long it takes to solve the contacts of slivers among blocks cannot be predicted.",
        moving, smallest, largest);
  const TimeBound bound = time_bound(w);
  if (bound.most < 1.5) return "CPU time: about a second or less.";
  return fmt::format(
      "CPU time: not known beforehand: it depends on how long blocks move and touch{}. The run tells how "
      "much is left.",
      bound.text);
}

struct Span {
  double least = std::numeric_limits<double>::infinity(), most = -std::numeric_limits<double>::infinity();
  void add(double x) { least = std::min(least, x), most = std::max(most, x); }
  std::string text(int digits, double none) const {
    const auto number = [&](double x) {
      return fmt::format("{:.{}g}", std::abs(x) < none ? 0.0 : x, digits);
    };
    return number(most) == number(least) ? number(least) : number(least) + " to " + number(most);
  }
};

int material_of(const TriangleSurface& surface, int triangle) {
  return surface.material.empty() ? surface.default_material
                                  : surface.material[static_cast<std::size_t>(triangle)];
}

/// Size of the terrain, how many of its faces overhang, and the plan area of each material of the ground.
/// `triangles` are those without border walls.
std::vector<std::string> terrain_lines(const World& w) {
  const TriangleSurface& s = w.header.terrain;
  std::vector<double> area(w.scene.materials.size(), 0.0);
  std::size_t overhanging = 0;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) -> const Vec3& {
      return s.vertices[static_cast<std::size_t>(s.triangles[t][k])];
    };
    const double plan = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).z();
    overhanging += plan < 0;
    area[static_cast<std::size_t>(material_of(s, static_cast<int>(t)))] += std::abs(plan);
  }
  std::vector<std::string> lines{
      fmt::format("Terrain: {} triangles, fixed, no degrees of freedom.", s.triangles.size())};
  Box3 extent;
  for (const Vec3& v : s.vertices) extent.extend(v);
  const auto range = [](double from, double to) { return fmt::format("{:.6g} to {:.6g}", from, to); };
  const Vec3 &low = extent.min(), &high = extent.max(), &origin = w.header.map_origin;
  std::string where =
      fmt::format("  It covers x {}, y {}, z {} in scene coordinates", range(low.x(), high.x()),
                  range(low.y(), high.y()), range(low.z(), high.z()));
  if (!origin.isZero(0))
    where += fmt::format("; on the map x {:.0f} to {:.0f}, y {:.0f} to {:.0f}", origin.x() + low.x(),
                         origin.x() + high.x(), origin.y() + low.y(), origin.y() + high.y());
  if (!s.vertices.empty()) lines.push_back(where + ".");
  if (s.two_sided)
    lines.front() += " It bears from both sides.";
  else if (overhanging > 0)
    lines.front() += fmt::format(" {} of them overhang: rock lies above them.", overhanging);
  std::string by_material;
  for (std::size_t m = 0; m < area.size(); ++m)
    if (area[m] > 0)
      by_material +=
          fmt::format("{}{} {:.4g} m^2", by_material.empty() ? "" : ", ", w.scene.materials[m].name, area[m]);
  if (!by_material.empty()) lines.push_back("  Ground in plan: " + by_material + ".");
  return lines;
}

/// How steep the ground is under the blocks, over their width, and the dip that their friction there holds by
/// itself. Empty where there is no ground below.
std::string dip_line(const World& w) {
  const coupling::Environment& env = w.system->environment();
  const dda::Model& model = w.system->model();
  constexpr double degree = 180 / M_PI;
  Span dip, held;
  for (int i = 0; i < static_cast<int>(model.blocks.size()); ++i) {
    const dda::Model::Block& block = model.blocks[static_cast<std::size_t>(w.placed(i))];
    if (block.fixed) continue;
    const Vec3 c = w.pose(i).c;
    const contact::Plumb under = env.terrain ? contact::plumb_at(*env.terrain, c) : contact::Plumb{};
    const double on_plane = ground_height(nullptr, env.planes, c);
    const auto height = [&](double x, double y) {
      return ground_height(env.terrain.get(), env.planes, c + Vec3(x, y, 0));
    };
    const double r = block.shape->radius;
    const double slope = std::hypot(height(r, 0) - height(-r, 0), height(0, r) - height(0, -r)) / (2 * r);
    if (!std::isfinite(slope)) continue;
    int ground = -1;
    if (under.triangle >= 0 && !(on_plane > under.floor))
      ground = material_of(env.terrain->surface(), under.triangle);
    for (const Plane& plane : env.planes)
      if (ground < 0 && ground_height(nullptr, {plane}, c) == on_plane) ground = plane.material;
    if (ground < 0) continue;
    dip.add(degree * std::atan(slope));
    held.add(degree * std::atan(env.laws(ground, block.material).friction));
  }
  if (!(dip.least <= dip.most)) return "";
  return fmt::format(" The ground under them dips by {} deg, friction alone holds {} deg.", dip.text(2, 1e-3),
                     held.text(2, 1e-3));
}

/// How high the blocks start above the ground: least plumb height of their corners. Empty where there is no
/// ground below. Blocks of a rock mass that lies in its hollow have walls above their lowest corner.
std::string start_line(const World& w) {
  const coupling::Environment& env = w.system->environment();
  const dda::Model& model = w.system->model();
  Span start;
  int in_hollow = 0;
  for (int i = 0; i < static_cast<int>(model.blocks.size()); ++i) {
    const dda::Model::Block& block = model.blocks[static_cast<std::size_t>(w.placed(i))];
    if (block.fixed) continue;
    if (w.scene.rock_mass && w.scene.rock_mass->from_terrain && is_cut_from_mass(w.scene, block.name)) {
      ++in_hollow;
      continue;
    }
    const Pose pose = w.pose(i);
    double height = std::numeric_limits<double>::infinity();
    for (const Vec3& corner : block.shape->vertices) {
      const Vec3 x = pose.world(corner);
      if (const double ground = ground_height(env.terrain.get(), env.planes, Vec3(x.x(), x.y(), pose.c.z()));
          std::isfinite(ground))
        height = std::min(height, x.z() - ground);
    }
    if (std::isfinite(height)) start.add(height);
  }
  const std::string hollow = in_hollow > 0 ? fmt::format("{} block{} of the rock mass in their hollow",
                                                         in_hollow, in_hollow > 1 ? "s" : "")
                                           : std::string();
  if (!(start.least <= start.most)) return hollow.empty() ? "" : "Start: " + hollow + "." + dip_line(w);
  const bool released =
      std::ranges::any_of(w.scene.blocks, [](const scene::Block& b) { return b.release.has_value(); });
  return fmt::format(
      "Start: {} m above the ground, vertically below the lowest corner{}{}.{}", start.text(3, 1e-6),
      released ? " (a release's height counts from the highest ground in the block's plan)" : "",
      hollow.empty() ? "" : "; " + hollow, dip_line(w));
}

std::string mass_text(double mass) {
  return mass < 1000 ? fmt::format("{:.3g} kg", mass) : fmt::format("{:.4g} t", mass / 1000);
}

/// Extent of a body along its own axes.
std::string size_text(const Polyhedron& body) {
  Box3 box;
  for (const Vec3& v : body.vertices) box.extend(v);
  return fmt::format("{:.4g} x {:.4g} x {:.4g} m", box.sizes().x(), box.sizes().y(), box.sizes().z());
}

/// What the moving blocks weigh and, as volume and mass scale a shape, how large they are: each of a few,
/// else the ends and the sum.
std::string mass_line(const World& w) {
  constexpr std::size_t listed = 6;
  std::vector<std::pair<double, std::string>> blocks;
  std::string text;
  double all = 0;
  for (const RunHeader::BlockInfo& b : w.header.blocks) {
    if (b.fixed || b.fragment) continue;
    blocks.emplace_back(b.mass, b.name), all += b.mass;
    if (blocks.size() <= listed)
      text +=
          fmt::format("{}{} {}, {}", text.empty() ? "" : "; ", b.name, mass_text(b.mass), size_text(b.shape));
  }
  if (blocks.empty()) return "";
  if (blocks.size() <= listed) return "Mass and size: " + text + ".";
  const auto [least, most] = std::minmax_element(blocks.begin(), blocks.end());
  return fmt::format("Mass: {} to {}, the least {}, the greatest {}; {} in all.", mass_text(least->first),
                     mass_text(most->first), least->second, most->second, mass_text(all));
}

/// Where a structure's members stand, how high they are, what the whole weighs.
std::vector<std::string> standing_lines(const StructureSpec& spec, const Structure& structure) {
  std::vector<std::string> lines;
  const Vec3 weight = structure.loads().permanent_reaction().head<3>();
  if (weight.norm() > 0)
    lines.push_back(fmt::format("  Permanent load on its supports: {:.4g} kN.", weight.norm() / 1e3));
  if (spec.kind != "viaduct") return lines;
  const Vec3 axis = spec.rotation.col(0).unaryExpr([](double x) { return std::abs(x) < 1e-9 ? 0.0 : x; });
  lines.push_back(fmt::format(
      "  Axis along [{:.3g}, {:.3g}, {:.3g}] from the first pier. Heights up to the top of the cap beam:",
      axis.x(), axis.y(), axis.z()));
  for (const Member& m : structure.loads().members())
    if (!m.span)
      lines.push_back(fmt::format("  {}: foot at [{:.6g}, {:.6g}, {:.6g}], {:.4g} m high", m.name, m.base.x(),
                                  m.base.y(), m.base.z(), m.length));
  return lines;
}

/// How contacts of a fixed surface take restitution, and how long an impulse acts on what is behind it.
void fixed_surface_lines(const coupling::StructurePart& part, const ContactLaw& law, const std::string& pair,
                         std::vector<std::string>& lines) {
  if (part.one_way && law.restitution && law.sprung() && law.damping_ratio == 0)
    lines.push_back(fmt::format(
        "  {}: restitution {:g} at it by dashpots, damping ratio {:.3f} of the contact's springs, which set "
        "how long a blow lasts",
        pair, *law.restitution, contact::damping_ratio_for(*law.restitution)));
  if (part.one_way && !law.sprung())
    lines.push_back(fmt::format(
        "  {}: hard contact at it: a blow is an impulse, which acts on it within one explicit sub-step of "
        "{:.3g} s; what it would last by the block and the structure giving way is not known, so that forces "
        "are upper bounds. A normal_stiffness or scheme \"two-way\" gives it a duration",
        pair, part.structure->critical_step()));
  if (!part.one_way && law.restitution && law.sprung() && law.damping_ratio == 0)
    lines.push_back(
        fmt::format("  {}: restitution {:g} at it as an impulse: springs press in lasting contact alone, and "
                    "the force of "
                    "a blow is its mean over a step",
                    pair, *law.restitution));
}

/// What interfaces at a structure ask for and do not get there, or get otherwise than elsewhere.
std::vector<std::string> contact_lines(const World& w, std::size_t structure) {
  const scene::Scene& s = w.scene;
  const coupling::StructurePart& part = w.system->environment().structures[structure];
  std::vector<std::string> lines;
  for (const auto& [a, b] : s.law_pairs) {
    if (a != part.material && b != part.material) continue;
    const ContactLaw& law = s.laws(a, b);
    const std::string pair = fmt::format("{}/{}", s.materials[static_cast<std::size_t>(a)].name,
                                         s.materials[static_cast<std::size_t>(b)].name);
    if (part.fixed_surface) {
      fixed_surface_lines(part, law, pair, lines);
      continue;
    }
    if (law.restitution && !law.sprung())
      lines.push_back(
          fmt::format("  {}: restitution {:g} is not used at it: of a hard contact comes back what the "
                      "structure's own deformation gives back",
                      pair, *law.restitution));
    else if (law.restitution && law.damping_ratio == 0)
      lines.push_back(
          fmt::format("  {}: restitution {:g} at it by dashpots, damping ratio {:.3f} of the contact's "
                      "springs; the structure's own deformation comes on top",
                      pair, *law.restitution, contact::damping_ratio_for(*law.restitution)));
    const double edge = coupling::face_edge(part.index->surface()), young = part.structure->skin().young();
    if (coupling::within_cell(law, young, edge))
      lines.push_back(
          fmt::format("  {}: hard contact at it; springs of {:.4g} N/m give less than a cell of it does of "
                      "its own, which gives more than both should",
                      pair, law.normal_stiffness));
    if (law.stiffness == ContactLaw::Stiffness::per_contact && law.kind == ContactLaw::Kind::linear)
      lines.push_back(fmt::format(
          "  {}: springs of {:.4g} N/m at each contact point; where faces meet there is one for each node of "
          "the mesh, so that together they are stiffer with finer cells. What is known of the "
          "whole contact is to be divided by the area that touches, and given in Pa/m",
          pair, law.normal_stiffness));
    if (law.restitution_tangential)
      lines.push_back(fmt::format("  {}: restitution_tangential is not used at it", pair));
    if (law.rolling_resistance > 0)
      lines.push_back(
          fmt::format("  {}: rolling_resistance is not used at it: its nodes take no couple", pair));
  }
  return lines;
}

/// A warning at the place in the scene's file that says so.
Problem warning_at(const scene::Scene& scene, const std::string& key) {
  Problem p;
  p.severity = Problem::Severity::warning;
  p.file = scene.file;
  p.key = key;
  if (const scene::Where* place = scene::place_of(scene, key))
    p.file = place->file, p.line = place->line, p.column = place->column;
  return p;
}

}  // namespace

std::vector<Problem> Simulation::warnings() const {
  constexpr double day = 86400, impact = 0.5;  // [s]: an impact and the first oscillation after it
  const World& w = *world_;
  std::vector<Problem> found = w.scene.warnings;
  const auto& parts = w.system->environment().structures;
  if (w.scene.simulation.step)
    if (const double most = time_bound(w).most; most > day) {
      Problem p = warning_at(w.scene, "simulation.step");
      p.value = fmt::format("{:g} s", *w.scene.simulation.step);
      p.rule = fmt::format("makes {:.2g} steps of the duration, up to {} of CPU time",
                           w.scene.simulation.duration / *w.scene.simulation.step, spoken(most));
      p.remedy =
          "check its unit; blocks of a metre take steps of some 1e-3 to 1e-4 s, or give accuracy in its "
          "place";
      found.push_back(std::move(p));
    }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].fixed_surface && !parts[i].one_way) continue;
    const StructureSpec& spec = w.scene.structures[i];
    const double second = touched_second(*parts[i].structure, spec);
    if (second * std::min(impact, w.scene.simulation.duration) < day) continue;
    Problem p = warning_at(w.scene, fmt::format("structure.{}.cell_size", spec.name));
    p.value = fmt::format("{} elements", parts[i].structure->elements());
    p.rule = fmt::format("each second that it is touched takes about {} of CPU time", spoken(second));
    p.remedy = "take larger cells, and finer ones only where blocks strike (refine)";
    found.push_back(std::move(p));
  }
  return found;
}

double Simulation::memory_of_run() const {
  const World& w = *world_;
  const coupling::Environment& env = w.system->environment();
  const auto blocks = static_cast<double>(w.system->model().blocks.size());
  const double rows = w.scene.simulation.duration / w.scene.output.history_interval;
  const auto triangles = static_cast<double>(header().terrain.triangles.size());
  double sum = 10 + 0.045 * blocks + 150e-6 * triangles;  // libraries of the results; a block's contacts in a
                                                          // pile; the terrain on its way to the files
  double row = 200 * blocks + 400;                        // [bytes]
  for (const RunHeader::StructureInfo& s : header().structures) {
    std::size_t values = 9 + 3 * s.probes.size();
    for (const Member& m : s.members) values += 5 * m.stations.size() + 6;
    row += sizeof(double) * static_cast<double>(values);
  }
  sum += std::min(
      32.0, 2 * rows * row * 1e-6);  // a batch of rows on its way to results.h5, and what HDF5 holds of it
  if (w.scene.output.report)
    sum +=
        3 + 4 * std::min(6.0, rows * 28 * blocks * 1e-6);  // the empty page; its arrays, their text, the page
  for (const auto& part : env.structures)
    if (!part.fixed_surface || part.one_way)
      sum += 1e-6 * part.structure->memory_of_steps(w.scene.simulation.duration);
  return sum;
}

std::vector<std::string> Simulation::plan() const {
  const World& w = *world_;
  const scene::Scene& s = w.scene;
  std::vector<std::string> lines;
  const dda::Model& model = w.system->model();
  int fixed = 0, rigid = 0, strained = 0;
  for (const dda::Model::Block& b : model.blocks) ++(b.fixed ? fixed : b.deformable ? strained : rigid);
  if (w.paper) {
    lines.push_back(fmt::format(
        "Method dda-1988: the paper's scheme, 12 degrees of freedom for every block, step {:g} s.",
        s.simulation.step.value_or(1e-4)));
    if (!s.structures.empty())
      lines.push_back(
          s.coupling.scheme == scene::Coupling::Scheme::one_way
              ? "Method dda-1988: structures do not react on blocks (scheme one-way): their undeformed "
                "surface is fixed, its contact forces act on them in each step."
              : "Method dda-1988: structures are fixed surfaces (scheme rigid): impacts on them are "
                "reported, they do not respond.");
    for (const std::string& line : w.paper->scheme.plan(model, s.laws)) lines.push_back(line);
  } else if (s.simulation.step) {
    lines.push_back(
        fmt::format("Method talus: one convex contact problem per island and step, fixed step {:g} s.",
                    *s.simulation.step));
  } else {
    lines.push_back(
        fmt::format("Method talus: one convex contact problem per island and step, step chosen for an "
                    "accuracy of {:g} of the block size.",
                    s.simulation.accuracy.value_or(1e-3)));
  }
  if (!w.paper)
    lines.push_back(
        fmt::format("Blocks: {} with 6 degrees of freedom, {} with 12 (strain asked for), {} fixed without "
                    "any: {} in all.",
                    rigid, strained, fixed, 6 * rigid + 12 * strained));
  if (std::string mass = mass_line(w); !mass.empty()) lines.push_back(std::move(mass));
  if (std::string start = start_line(w); !start.empty()) lines.push_back(std::move(start));
  const coupling::Environment& env = w.system->environment();
  if (env.terrain)
    for (std::string& line : terrain_lines(w)) lines.push_back(std::move(line));
  else
    lines.push_back("Terrain: none; no raster library is loaded.");
  if (!env.planes.empty()) lines.push_back(fmt::format("Planes: {}, fixed.", env.planes.size()));
  if (env.structures.empty()) {
    lines.push_back("Structures: none; the finite-element module is not loaded, no MPI start-up.");
  } else {
    for (std::size_t i = 0; i < env.structures.size(); ++i) {
      const Structure& st = *env.structures[i].structure;
      lines.push_back(fmt::format(
          "Structure {}: {} elements, {} degrees of freedom{}.", s.structures[i].name, st.elements(),
          st.dofs(),
          env.structures[i].one_way
              ? "; blocks strike its undeformed surface as a fixed one, their loads act on it afterwards"
          : env.structures[i].fixed_surface ? "; it is a fixed surface and not stepped"
                                            : ""));
      std::string text = st.plan();
      std::size_t from = 0;
      while (from < text.size()) {
        std::size_t to = text.find('\n', from);
        if (to == std::string::npos) to = text.size();
        if (to > from) lines.push_back("  " + text.substr(from, to - from));
        from = to + 1;
      }
      for (std::string& line : standing_lines(s.structures[i], st)) lines.push_back(std::move(line));
      for (std::string& line : contact_lines(w, i)) lines.push_back(std::move(line));
    }
  }
  if (!s.coupling.fragments &&
      std::any_of(s.structures.begin(), s.structures.end(),
                  [](const StructureSpec& q) { return q.damage != "none" || q.kind == "viaduct"; }))
    lines.push_back(
        "Fragments: off; parts that lose their support stay in the mesh and fall as parts of it from then on "
        "(the run warns of it).");
  for (const StructureSpec& spec : s.structures)
    for (std::string line : {round_line(spec), fineness_line(spec)})
      if (!line.empty()) lines.push_back(std::move(line));
  bool springs = false, restitution = false, cohesion = false;
  for (const ContactLaw& l : s.laws.law) {
    springs = springs || l.sprung();
    restitution = restitution || l.restitution.has_value();
    cohesion = cohesion || l.cohesion > 0 || l.tension > 0;
  }
  lines.push_back(springs ? "Contact: springs where a stiffness is given or chosen, hard elsewhere."
                          : "Contact: hard; no springs, no shear history is kept.");
  if (!restitution) lines.push_back("Restitution: not given; impacts on hard contacts are inelastic.");
  if (!cohesion) lines.push_back("Cohesion and tension: none.");
  if (!w.paper)
    lines.push_back(s.simulation.sleeping ? "Blocks that provably rest are not computed until something "
                                            "reaches them; free flight is in closed form."
                                          : "Sleeping is off.");
  lines.push_back(time_line(w));
  for (const std::string& n : w.notes) lines.push_back(n);
  for (const std::string& n : s.notes) lines.push_back(n);
  return lines;
}

}  // namespace talus::sim
