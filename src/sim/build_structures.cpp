#include "sim/builder.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "contact/structures/refinable.hpp"
#include "contact/structures/structure_plan.hpp"
#include "core/solid_mesh_parts.hpp"
#include "coupling/ground/ground.hpp"
#include "coupling/touch/touch.hpp"
#include "geometry/stated_unit.hpp"
#include "sim/fineness.hpp"
#include "sim/footing.hpp"

namespace talus::sim {

Report Builder::report_of(const std::string& name) {
  return [world = world_.get(), name](const std::string& line) {
    constexpr std::string_view mark = "warning: ";
    if (!line.starts_with(mark)) return world->report(line);
    Problem p;
    p.file = world->scene.file;
    p.key = "structure." + name;
    const std::size_t end = line.find("; ");
    p.rule = line.substr(mark.size(), end - mark.size());
    if (end != std::string::npos) p.remedy = line.substr(end + 2);
    p.severity = Problem::Severity::warning;
    world->scene.warnings.push_back(std::move(p));
  };
}

namespace {

/// Parts of a mesh file that lie on each other without common nodes; of a structure without supports any
/// parts that share none. A part that nothing holds where others are is an error of its own.
std::vector<Problem> unmerged_parts(const StructureSpec& spec, const SolidMesh& mesh) {
  if (mesh.nodes.empty()) return {};
  const UnmergedNodes found = unmerged_nodes(mesh);
  Problem p;
  p.severity = Problem::Severity::warning;
  p.file = spec.file;
  p.key = fmt::format("structure.{}.file", spec.name);
  if (found.count == 0) {
    if (found.parts < 2 || !spec.supports.empty()) return {};
    p.value = fmt::format("{} parts that share no node", found.parts);
    p.rule =
        "nothing ties them together, and parts of one structure do not meet in contact: they move "
        "through each other";
    p.remedy =
        "merge coincident nodes (Gmsh: Coherence Mesh), or make each part a structure of its own, which "
        "an [[interface]] lets meet the others";
    return {p};
  }
  p.value = fmt::format("{} node{}, one at [{:.6g}, {:.6g}, {:.6g}] of the file", found.count,
                        found.count == 1 ? "" : "s", found.first.x(), found.first.y(), found.first.z());
  p.rule = fmt::format(
      "lie on nodes of another part and are not merged with them: the mesh is {} parts that nothing ties "
      "together",
      found.parts);
  p.remedy = "merge coincident nodes (Gmsh: Coherence Mesh), unless the parts are to come apart";
  return {p};
}

/// Mean edge of the faces of a surface, of each triangle its two shorter ones: the longest may be the
/// diagonal of a face of four corners [m].
double mean_edge(const std::vector<Vec3>& nodes, const std::vector<std::array<int, 3>>& triangles) {
  double sum = 0;
  for (const auto& t : triangles) {
    std::array<double, 3> edge;
    for (std::size_t k = 0; k < 3; ++k)
      edge[k] =
          (nodes[static_cast<std::size_t>(t[(k + 1) % 3])] - nodes[static_cast<std::size_t>(t[k])]).norm();
    sum += 0.5 * (edge[0] + edge[1] + edge[2] - *std::max_element(edge.begin(), edge.end()));
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, triangles.size()));
}

/// A structure of a mesh file larger than any that is built, thicker in all directions than any pier, or of
/// cells that are, is one in millimetres or centimetres, whatever its head says of its unit or not. Numbers
/// of a scene are refused by the same limits (scene/plausible.cpp).
std::vector<Problem> mesh_unit_problems(const StructureSpec& spec, const std::vector<Vec3>& nodes,
                                        const std::vector<std::array<int, 3>>& triangles) {
  constexpr double longest = 3000, thickest = 100;  // [m]
  constexpr double coarsest = 5;                    // [m]: with such cells no pier or slab has two across
  Box3 box;
  for (const Vec3& x : nodes) box.extend(x);
  const Vec3 size = box.sizes();
  Problem p;
  p.severity = Problem::Severity::warning;
  p.file = spec.file;
  p.key = fmt::format("structure.{}.file", spec.name);
  if (const geometry::StatedUnit unit = geometry::stated_unit(spec.file); !unit.name.empty()) {
    p.value = unit.name;
    p.rule = "is the unit that the head of the file names, and its numbers are taken as metres";
    p.remedy = fmt::format("scale it by {:g} in the program that made it", unit.metres);
    return {p};
  }
  const double edge = mean_edge(nodes, triangles);
  if (size.maxCoeff() <= longest && size.minCoeff() <= thickest && edge <= coarsest) return {};
  p.value = fmt::format("{:.4g} x {:.4g} x {:.4g} m", size.x(), size.y(), size.z());
  p.rule = size.maxCoeff() > longest    ? std::string("no structure is that large")
           : size.minCoeff() > thickest ? std::string("no structure is that thick")
                                        : fmt::format("no structure is computed by cells of {:.3g} m", edge);
  p.remedy = fmt::format(
      "lengths of mesh files are metres: in millimetres it would be {:.3g} x {:.3g} x {:.3g} m, in "
      "centimetres ten times that; scale it in the program that made it",
      1e-3 * size.x(), 1e-3 * size.y(), 1e-3 * size.z());
  return {p};
}

}  // namespace

void Builder::add_structures() {
  if (shared_ && !shared_->structures.empty() &&
      world_->scene.coupling.scheme == scene::Coupling::Scheme::rigid) {
    env_.structures = shared_->structures;
    world_->displaced.resize(env_.structures.size());
    return;
  }
  const auto add_problems_of = [this](const InputError& e, const StructureSpec& spec) {
    for (Problem p : e.problems()) {
      if (p.file.empty()) p.file = world_->scene.file;
      if (p.key.rfind("structure", 0) != 0)
        p.key = fmt::format("structure.{}{}{}", spec.name, p.key.empty() ? "" : ".", p.key);
      problems_.push_back(std::move(p));
    }
  };
  constexpr double large = 2e4;  // cells: fewer are made and solved in a moment
  // What cannot be is said before the first of them is made and solved, which may take minutes.
  std::vector<StructureSpec> specs = world_->scene.structures;
  std::vector<char> possible;
  for (StructureSpec& spec : specs) {
    // The index lives as long as the world does, this builder does not.
    if (terrain_)
      spec.ground = [ground = env_.terrain.get()](double x, double y) { return ground->height(x, y); };
    possible.push_back(0);
    if (terrain_ && world_->scene.site) {
      const std::vector<Problem> mapped =
          map_coordinate_problems(spec, world_->scene.site->origin, terrain_->surface);
      if (!mapped.empty()) {
        add_problems_of(InputError(mapped), spec);
        continue;
      }
    }
    try {
      const StructurePlan plan = plan_structure(spec, model_.gravity);
      if (plan.cells >= large) world_->report("plan: " + plan.text);
      possible.back() = 1;
    } catch (const InputError& e) { add_problems_of(e, spec); }
  }
  std::size_t next = 0;
  for (const StructureSpec& spec : specs) {
    if (possible[next++] == 0) continue;
    coupling::StructurePart part;
    part.material = spec.material;
    part.fixed_surface = world_->scene.coupling.scheme != scene::Coupling::Scheme::two_way;
    part.one_way = world_->scene.coupling.scheme == scene::Coupling::Scheme::one_way;
    SolidMesh mesh;
    std::vector<Problem> unit;
    try {
      if (spec.kind == "mesh" && is_solid_mesh_file(spec.file)) {
        mesh = read_solid_mesh(spec.file);
        unit = mesh_unit_problems(spec, mesh.nodes, outer_triangles(mesh));
      }
      part.structure = load_structure(spec, model_.gravity, report_of(spec.name));
      if (const TriangleSurface& skin = part.structure->skin().surface();
          spec.kind == "mesh" && mesh.nodes.empty())  // of a format that the finite elements read alone
        unit = mesh_unit_problems(spec, skin.vertices, skin.triangles);
    } catch (const InputError& e) {
      if (unit.empty()) add_problems_of(e, spec);
      for (Problem& p : unit) {  // whatever else is wrong with it follows from that
        p.severity = Problem::Severity::error;
        problems_.push_back(std::move(p));
      }
      continue;
    }
    if (part.stepped() && part.structure->dofs() == 0)
      problem(fmt::format("structure.{}.support", spec.name), "",
              "holds every node: nothing of the structure can move",
              "hold fewer faces, take more cells, or coupling.scheme = \"rigid\" for an obstacle that does "
              "not give way");
    part.index = part.fixed_surface
                     ? std::make_unique<contact::SurfaceIndex>(part.structure->skin().surface())
                     : coupling::moving_index(part.structure->skin().surface());
    check_probes(spec, part.index->bounds());
    add_warnings(unit);
    add_warnings(unmerged_parts(spec, mesh));
    add_warnings(fineness_problems(spec));
    if (!part.stepped() && !spec.loads.empty()) warn_of_unused_loads(spec);
    if (part.fixed_surface && impact_refinement(spec).cell_size > 0) warn_of_no_strikes(spec);
    const std::vector<Member> members = part.structure->loads().members();
    if (terrain_ ||
        std::ranges::any_of(world_->scene.planes, [](const Plane& p) { return p.normal.z() > 0; }))
      add_warnings(footing_problems(spec, members, [&](const Vec3& at) {
        return ground_height(env_.terrain.get(), world_->scene.planes, at);
      }));
    std::vector<double>& moved = world_->displaced.emplace_back();
    if (spec.gravity_preload)
      part.structure->values([&](const Structure::Snapshot& s) {
        for (const Vec3& u : s.displacement) moved.push_back(u.norm());
      });
    env_.structures.push_back(std::move(part));
  }
  const bool whole = env_.structures.size() == world_->scene.structures.size();
  if (shared_ && shared_->keeps_structures && whole &&
      world_->scene.coupling.scheme == scene::Coupling::Scheme::rigid)
    shared_->structures = env_.structures;
}

void Builder::warn_of_unused_loads(const StructureSpec& spec) {
  add_warnings({{.severity = Problem::Severity::warning,
                 .file = {},
                 .key = fmt::format("structure.{}.load", spec.name),
                 .value = {},
                 .rule = "has no effect: coupling.scheme = \"rigid\" steps no structure",
                 .remedy = "take scheme \"two-way\" or \"one-way\", or leave the load out"}});
}

void Builder::warn_of_no_strikes(const StructureSpec& spec) {
  add_warnings({{.severity = Problem::Severity::warning,
                 .file = {},
                 .key = fmt::format("structure.{}.refine", spec.name),
                 .value = "where = \"impact\"",
                 .rule = "has no effect: with this coupling.scheme blocks strike the undeformed surface",
                 .remedy = "take scheme \"two-way\", or refine in a region"}});
}

void Builder::check_probes(const StructureSpec& spec, const Box3& bounds) {
  const double size = bounds.sizes().norm();
  for (const StructureSpec::Probe& p : spec.probes)
    if (const double d = bounds.exteriorDistance(p.at); d > 0.1 * size) {
      const std::string key = fmt::format("structure.{}.probe.{}", spec.name, p.name);
      const bool by_offset = world_->scene.places.count(key + ".offset") > 0;
      const Vec3 offset = spec.rotation.transpose() * (p.at - spec.position);
      const Vec3 given =
          by_offset ? offset.unaryExpr([&](double x) { return std::abs(x) < 1e-12 * p.at.norm() ? 0.0 : x; })
                    : p.at;  // what rounding leaves of 0
      problem(key + (by_offset ? ".offset" : ".at"),
              fmt::format("[{:g}, {:g}, {:g}]", given.x(), given.y(), given.z()),
              fmt::format("lies {:.3g} m from the structure, which spans x {:.6g} to {:.6g}, y {:.6g} to "
                          "{:.6g}, z {:.6g} to {:.6g}",
                          d, bounds.min().x(), bounds.max().x(), bounds.min().y(), bounds.max().y(),
                          bounds.min().z(), bounds.max().z()),
              by_offset ? "count from the structure's base or position, along its own axes"
                        : "give a point of the structure in scene coordinates");
    }
}

void Builder::pair_structures() {
  const auto& parts = env_.structures;
  for (int i = 0; i < static_cast<int>(parts.size()); ++i)
    for (int j = i + 1; j < static_cast<int>(parts.size()); ++j) {
      const coupling::StructurePart &a = parts[static_cast<std::size_t>(i)],
                                    &b = parts[static_cast<std::size_t>(j)];
      if (a.fixed_surface || b.fixed_surface) continue;
      const auto& known = world_->scene.law_pairs;
      if (std::find(known.begin(), known.end(),
                    std::pair(std::min(a.material, b.material), std::max(a.material, b.material))) ==
          known.end()) {
        world_->notes.push_back(fmt::format(
            "Structures {} and {}: no [[interface]] of their materials, they do not touch each other.",
            world_->scene.structures[static_cast<std::size_t>(i)].name,
            world_->scene.structures[static_cast<std::size_t>(j)].name));
        continue;
      }
      const double edge_a = coupling::face_edge(a.index->surface()),
                   edge_b = coupling::face_edge(b.index->surface());
      const bool first_finer =
          edge_a < edge_b * (1 - 1e-9) ||
          (edge_a <= edge_b * (1 + 1e-9) && a.index->bounds().volume() < b.index->bounds().volume());
      env_.touching_structures.push_back(first_finer ? std::pair(j, i) : std::pair(i, j));
    }
  pair_grounds();
}

/// Which planes, terrain and fixed blocks the nodes of each structure meet: those that it has a law with.
void Builder::pair_grounds() {
  const auto stepped = [](const coupling::StructurePart& p) { return !p.fixed_surface; };
  if (std::none_of(env_.structures.begin(), env_.structures.end(), stepped)) return;
  env_.grounds = coupling::grounds_of(env_, model_, state_.blocks);
  const auto& known = world_->scene.law_pairs;
  for (std::size_t q = 0; q < env_.structures.size(); ++q) {
    coupling::StructurePart& part = env_.structures[q];
    if (!stepped(part)) continue;
    const StructureSpec& spec = world_->scene.structures[q];
    for (std::size_t k = 0; k < env_.grounds.size(); ++k) {
      const coupling::Ground& ground = env_.grounds[k];
      std::vector<int> materials{coupling::ground_material(env_, ground, 0)};
      if (ground.faces) {
        const std::vector<int>& several = ground.faces->surface().material;
        materials.insert(materials.end(), several.begin(), several.end());
        std::sort(materials.begin(), materials.end());
        materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
      }
      const auto without_law = std::ranges::find_if(materials, [&](int m) {
        return std::ranges::find(known, std::pair(std::min(m, part.material), std::max(m, part.material))) ==
               known.end();
      });
      if (without_law == materials.end()) {
        part.grounds.push_back(static_cast<int>(k));
        continue;
      }
      const std::string& of = world_->scene.materials[static_cast<std::size_t>(part.material)].name;
      const std::string& other = world_->scene.materials[static_cast<std::size_t>(*without_law)].name;
      if (spec.supports.empty())
        problem(fmt::format("structure.{}.support", spec.name), "[]",
                fmt::format("nothing holds it, and no [[interface]] says how \"{}\" meets \"{}\" of {}", of,
                            other, coupling::name_of(model_, ground)),
                fmt::format("add [[interface]] with between = [\"{}\", \"{}\"]", of, other));
      else
        world_->notes.push_back(
            fmt::format("Structure {} and {}: no [[interface]] of their materials, it goes through there.",
                        spec.name, coupling::name_of(model_, ground)));
    }
  }
}

/// A structure without supports that lies on another is in no preload: its weight comes onto both at once, at
/// t = 0.
void Builder::warn_of_sudden_weight() {
  if (model_.gravity.isZero(0) || !world_->scene.simulation.initial_state.empty()) return;
  const auto& specs = world_->scene.structures;
  for (std::size_t q = 0; q < specs.size(); ++q) {
    if (!specs[q].supports.empty()) continue;
    std::string under;
    for (const auto& [a, b] : env_.touching_structures) {
      if (a != static_cast<int>(q) && b != static_cast<int>(q)) continue;
      const auto other = static_cast<std::size_t>(a == static_cast<int>(q) ? b : a);
      const Box3 here = env_.structures[q].index->bounds(), there = env_.structures[other].index->bounds();
      if (here.exteriorDistance(there) <= 1e-3 * here.sizes().norm())
        under += (under.empty() ? "" : ", ") + specs[other].name;
    }
    if (under.empty()) continue;
    Problem p;
    p.severity = Problem::Severity::warning;
    p.file = world_->scene.file;
    p.key = fmt::format("structure.{}.preload", specs[q].name);
    p.value = "none";
    p.rule = fmt::format(
        "no preload covers both it and what holds it ({}): its weight acts on them at once at t = 0, they "
        "oscillate about their position at rest with up to twice the weight, and reactions, forces, drift "
        "and "
        "damage include that",
        under);
    p.remedy =
        "let them come to rest in a separate run without blocks, with damping_ratio in the interface "
        "between them, and start from its results.h5 (simulation.initial_state); or subtract the figures of "
        "a run without blocks";
    world_->scene.warnings.push_back(std::move(p));
  }
}

void Builder::warn_of_small_blocks() {
  constexpr double ratio = 0.5;  // least thickness of a block over the edge of a cell
  for (std::size_t q = 0; q < env_.structures.size(); ++q) {
    const double fine = impact_refinement(world_->scene.structures[q]).cell_size,
                 given = world_->scene.structures[q].cell_size,  // 0: cells, or a mesh file
        as_built = std::max(coupling::face_edge(env_.structures[q].structure->skin().surface()), given);
    const double edge = fine > 0 ? std::min(fine, as_built) : as_built;
    int small = 0;
    const dda::Model::Block* least = nullptr;
    for (const dda::Model::Block& b : model_.blocks) {
      if (b.ndof() == 0 || 2 * b.shape->inradius >= ratio * edge) continue;
      ++small;
      if (!least || b.shape->inradius < least->shape->inradius) least = &b;
    }
    if (!least) continue;
    Problem p;
    p.file = world_->scene.file;
    const std::string& structure = world_->scene.structures[q].name;
    p.key = fmt::format("structure.{}.cell_size", structure);
    p.value = fmt::format("{:.4g} m", fine > 0 ? edge : given > 0 ? given : edge);
    p.rule = fmt::format(
        "{} block{} thinner than {:g} of a cell face, {} of {:.3g} kg with {:.3g} m the thinnest: its force "
        "spreads over a whole face, so that local stress, damage and indentation come out too small; force "
        "and momentum hold",
        small, small == 1 ? " is" : "s are", ratio, least->name, least->mass, 2 * least->shape->inradius);
    const double wanted = 2 * least->shape->inradius / ratio,
                 unit = std::pow(10.0, std::floor(std::log10(wanted)) - 1);
    p.remedy = fmt::format(
        "is the block meant so small (a mass without a unit is in kg, a length in m)? If so take cells of "
        "{:.2g} m or less where such blocks strike, or accept it",
        unit * std::floor(wanted / unit));
    p.severity = Problem::Severity::warning;
    world_->scene.warnings.push_back(std::move(p));
  }
}

}  // namespace talus::sim
