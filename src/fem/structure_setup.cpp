#include "fem/structure_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/structures/refinable.hpp"
#include "core/memory.hpp"
#include "core/place.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/linear/mechanism.hpp"
#include "fem/output/place_in_words.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_plan.hpp"

namespace talus::fem {
namespace {

constexpr double steel_density = 7850;  // [kg/m^3]

/// Whether any bar presses the concrete from the start.
bool prestressed(const Bars* bars) {
  return bars != nullptr && std::any_of(bars->embedded().bars().begin(), bars->embedded().bars().end(),
                                        [](const rebar::Bar& bar) { return bar.steel.prestress > 0; });
}

}  // namespace

void StructureSetup::build(const StructureBody* before) {
  set_material(before == nullptr);
  body_.shear = body_.spec.young / (2 * (1 + body_.spec.poisson));
  body_.bulk = body_.spec.young / (3 * (1 - 2 * body_.spec.poisson));
  body_.wave_speed = std::sqrt((body_.bulk + 4.0 / 3 * body_.shear) / body_.spec.density);
  const Box3 extent = make_cells();
  give_back_memory();
  body_.nodes = body_.mesh.nodes.size(), body_.cells = body_.mesh.hexes.size();
  body_.live.assign(body_.cells, 1);
  if (before != nullptr)
    body_.supports.centroid = before->supports.centroid;  // moments go on about one point
  skin_.rebuild();
  set_loads(extent);

  const std::size_t n = body_.mesh.nodes.size();
  if (!body_.partition) body_.own = {{0, static_cast<int>(n)}};
  body_.touched = {{0, static_cast<int>(n)}};
  for (AlignedVector* a : {&fields_.u, &fields_.v, &fields_.f_int, &fields_.f_ext, &fields_.v_hat,
                           &body_.inverse_mass, &fields_.contact_impulse})
    a->assign(4 * n, 0.0);
  set_masses();
  if (!body_.elements)
    body_.elements =
        std::make_unique<ElementOperator>(body_.mesh, body_.shear, body_.bulk, body_.spec.damage != "none");
  if (body_.spec.damage != "none") {
    body_.damage =
        make_damage_field(body_.spec.damage, body_.mesh, *body_.concrete, body_.spec.rate_effect,
                          body_.finite, largest_cell(), "structure." + body_.spec.name + ".cell_size");
    fields_.f_visc.assign(4 * n, 0.0);
    if (body_.partition) body_.damage->restrict_to(*body_.partition);
  }
  body_.elastic = std::make_unique<ElasticSystem>(body_);
  if (!body_.divided()) check_supports(body_.mesh);
  body_.progress(fmt::format("{} cells and {} degrees of freedom are made; next its stable step",
                             body_.cells_in_all(), body_.free_dofs));
  find_critical_step();
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (!body_.supports.held[i][c]) fields_.v[4 * i + c] = body_.spec.initial_velocity[c];
  if (body_.spec.damping_ratio > 0 && !body_.supports.none && body_.free_dofs > 0) {
    body_.progress("first frequency");
    body_.omega_1 = before != nullptr ? before->omega_1 : body_.elastic->first_frequency(body_.built_mass);
    body_.alpha = 2 * body_.spec.damping_ratio * body_.omega_1;
  }
}

bool StructureSetup::weighs() const {
  return body_.spec.gravity_preload && (body_.gravity.norm() > 0 || prestressed(body_.bars.get()));
}

/// Of the concrete, if it is one; `first`: with a report.
void StructureSetup::set_material(bool first) {
  if (body_.spec.f_cm > 0) {
    body_.concrete = concrete_of(body_.spec);
    body_.spec.young = body_.concrete->young;
    body_.spec.poisson = body_.concrete->poisson;
    body_.spec.density = body_.concrete->density;
    for (const std::string& line : first ? body_.concrete->report : std::vector<std::string>{})
      body_.report("structure " + body_.spec.name + ": " + line);
  }
  if (body_.spec.damage != "none" && !body_.concrete)
    bad(body_.spec, "damage", body_.spec.damage, "a damage law needs a concrete",
        "give the material an f_cm, or write damage = \"none\"");
  if (body_.spec.damage != "none" && body_.spec.damage != "concrete" && body_.spec.damage != "concrete-cdpm2")
    bad(body_.spec, "damage", body_.spec.damage, "must be none, concrete or concrete-cdpm2", "choose one");
  if (!(body_.spec.young > 0))
    bad(body_.spec, "material", fmt::format("young = {:g}", body_.spec.young),
        "Young's modulus must be positive", "give young or f_cm for the material");
  if (!(body_.spec.poisson > -1 && body_.spec.poisson < 0.5))
    bad(body_.spec, "material", fmt::format("poisson = {:g}", body_.spec.poisson), "must lie in (-1, 0.5)",
        "correct the material");
  if (!(body_.spec.density > 0))
    bad(body_.spec, "material", fmt::format("density = {:g}", body_.spec.density), "must be positive",
        "correct the material");
  if (!(body_.spec.critical_step_fraction > 0 && body_.spec.critical_step_fraction <= 1))
    bad(body_.spec, "critical_step_fraction", fmt::format("{:g}", body_.spec.critical_step_fraction),
        "must lie in (0, 1]", "take 0.9");
}

material::CellSize StructureSetup::largest_cell() const {
  material::CellSize largest;
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell) {
    const Mat3 edges = 2 * jacobian(body_.mesh, cell, Vec3::Zero());
    largest.edge = std::max(largest.edge, edges.colwise().norm().maxCoeff());
    for (const double y : {1.0, -1.0})
      for (const double z : {1.0, -1.0})
        largest.diagonal = std::max(largest.diagonal, (edges * Vec3(1, y, z)).norm());
  }
  largest.edge = body_.largest(largest.edge), largest.diagonal = body_.largest(largest.diagonal);
  return largest;
}

/// Parts connected to supports must be held by them wherever a static solution is needed; elsewhere a part
/// may move as a pendulum, hence rotate.
void StructureSetup::check_supports(const HexMesh& mesh) {
  if (body_.supports.none) return;
  const std::optional<LoosePart> loose =
      loose_part(mesh, body_.supports, body_.bearings ? body_.bearings->springs() : std::vector<Spring>{});
  if (!loose) return;
  body_.finite = true;
  const bool statics = weighs() || body_.spec.damping_ratio > 0;
  if (loose->held && !statics) return;
  const Vec3 at = mesh.nodes[static_cast<std::size_t>(mesh.hexes[static_cast<std::size_t>(loose->first)][0])];
  const std::string part = loose->cells == static_cast<int>(mesh.hexes.size())
                               ? "the structure"
                               : fmt::format("a part of {} cells, {} near {} and others", loose->cells,
                                             cell_name(mesh, loose->first), place_text(at));
  const std::string wanted =
      weighs() ? "preload = \"none\" if it is meant to move" : "no damping_ratio if it is meant to move";
  if (loose->hinged)
    bad(body_.spec, "support", part,
        "it shares an edge or a corner with the others but no face: it is free to " + loose->motion,
        "join the cells by faces, hold this part too, or write " + wanted);
  if (loose->held)
    bad(body_.spec, "support", part, "its supports leave it free to " + loose->motion,
        "hold more nodes or directions, or write " + wanted);
  bad(body_.spec, "support", part,
      "nothing holds it: it shares no node with a part that is held, and parts of one structure do not meet "
      "in contact",
      "merge the nodes of the mesh that lie in one place, hold this part too, or make it a structure of its "
      "own, which an [[interface]] lets meet this one");
}

void StructureSetup::set_loads(const Box3& extent) {
  if (!body_.divided()) {
    body_.loads = find_loads(body_.spec, body_.mesh, skin_.faces());
    return;
  }
  std::vector<SkinQuad> faces = skin(body_.mesh, body_.live);  // at own nodes
  std::erase_if(faces, [this](const SkinQuad& q) {
    return std::none_of(q.node.begin(), q.node.end(), [this](int n) { return body_.own_node(n); });
  });
  body_.loads = find_loads(body_.spec, body_.mesh, faces, &extent);
  for (std::size_t k = 0; k < body_.loads.size(); ++k)
    check_area(body_.spec, body_.spec.loads[k], body_.largest(body_.loads[k].area));
}

void StructureSetup::make_links(const HexMesh& whole) {
  if (body_.spec.kind == "viaduct")
    body_.bearings = std::make_unique<Bearings>(body_.spec, whole, viaduct_plan(body_.spec));
  if (body_.spec.rebar_file.empty() && body_.spec.rebar_rules.empty()) return;
  std::vector<rebar::Member> shapes;
  for (const Pier& pier : find_piers(body_.spec)) shapes.push_back(pier.shape);
  body_.bars = std::make_unique<Bars>(body_.spec, whole, body_.supports, std::move(shapes),
                                      [&](const std::string& text) { body_.report("warning: " + text); });
}

void StructureSetup::set_masses() {
  const std::size_t n = body_.mesh.nodes.size();
  body_.cells_at_node.assign(n, 0);
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell)
    for (int node : carriers(body_.mesh, cell)) ++body_.cells_at_node[node];
  if (body_.partition) body_.partition->exchange_numbers(body_.cells_at_node);
  body_.cell_mass = cell_volumes(body_.mesh);
  body_.mass_of_cells = 0;
  for (std::size_t cell = 0; cell < body_.cell_mass.size(); ++cell) {
    body_.cell_mass[cell] *= body_.spec.density;
    if (body_.own_cell(static_cast<int>(cell))) body_.mass_of_cells += body_.cell_mass[cell];
  }
  body_.sum({&body_.mass_of_cells, 1});
  // Row sums of the consistent mass: integral of rho N_a, with the points of the stiffness.
  body_.mass.assign(n, 0.0);
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell) {
    const std::array<double, 8> share = corner_volumes(body_.mesh, cell);
    for (int a = 0; a < 8; ++a) body_.mass[body_.mesh.hexes[cell][a]] += body_.spec.density * share[a];
  }
  if (body_.bars) body_.bars->embedded().add_mass(steel_density - body_.spec.density, body_.mass);
  settle_hanging_nodes();
  if (body_.partition) body_.partition->exchange_numbers(body_.mass);
  body_.built_mass = body_.mass;
  body_.discretisation.hold(body_.supports.held);
  body_.dofs = body_.discretisation.free_dofs();
  long free = 0;
  for (int d = 0; d < body_.dofs.size; ++d) free += body_.own_node(body_.dofs.node(d));
  body_.free_dofs = static_cast<int>(body_.count_of(free));
  for (const int place : body_.dofs.place) body_.inverse_mass[place] = 1 / body_.mass[place / 4];
}

std::vector<double> StructureBody::mass_of_live() const {
  const Followed follows(mesh);
  std::vector<double> sums(mesh.nodes.size(), 0.0);
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    if (live[static_cast<std::size_t>(cell)] == 0) continue;
    const std::array<double, 8> share = corner_volumes(mesh, cell);
    for (std::size_t a = 0; a < 8; ++a)
      follows.each(mesh.hexes[cell][a], [&](int n, double w) {
        sums[static_cast<std::size_t>(n)] += w * spec.density * share[a];
      });
  }
  return sums;
}

void StructureSetup::find_critical_step() {
  if (body_.free_dofs ==
      0) {  // nothing can move: waves cross a cell as they would, and what asks for a step gets a number
    double shortest = INFINITY;
    for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell)
      shortest = std::min(shortest, 2 * jacobian(body_.mesh, cell, Vec3::Zero()).colwise().norm().minCoeff());
    body_.critical_step = body_.spec.critical_step_fraction * -body_.largest(-shortest) / body_.wave_speed;
    return;
  }
  body_.critical_step = body_.spec.critical_step_fraction * 2 /
                        body_.elastic->highest_frequency(body_.mass, body_.inverse_mass);
  // Linear bulk viscosity b1 shortens the stable step by sqrt(1 + b1^2) - b1.
  if (body_.damage) body_.critical_step *= std::sqrt(1 + 0.06 * 0.06) - 0.06;
}

/// Coarse cells as the specification says, halved by the zones that end at their borders; supports and probes
/// on them. Of several ranks that divide memory each keeps its part.
Box3 StructureSetup::make_cells() {
  HexMesh coarse = make_mesh(of_coarse_mesh(body_.spec));
  check_cells(coarse, "structure." + body_.spec.name, body_.spec.file);
  if (!body_.spec.file.empty()) {
    check_faces(coarse, "structure." + body_.spec.name, body_.spec.file);
    if (const auto pair = overlapping_cells(coarse))
      body_.report(fmt::format(
          "warning: {}: {} and {} overlap but share no nodes: nothing ties them together, and the volume "
          "counts twice; merge the parts' nodes where they touch, or remove one of them",
          body_.spec.file, cell_name(coarse, pair->first), cell_name(coarse, pair->second)));
  }
  const Box3 extent = bounds(coarse.nodes);
  const auto settle = [this](const HexMesh& mesh) {
    body_.supports = find_supports(body_.spec, mesh);
    skin_.probe(find_probes(body_.spec, mesh));
    loads_.probe(find_probes(body_.spec, mesh));
    body_.finite = body_.supports.none || body_.spec.damage != "none" || body_.spec.kind == "viaduct";
  };
  if (ranks() != nullptr) {
    settle(coarse);
    if (divides_memory(coarse)) {
      loads_.find_places(coarse);
      loads_.find_feet(coarse);
      make_links(coarse);
      check_supports(coarse);
      take_part(std::move(coarse));
      return extent;
    }
  }
  const bool given = refines_locally(body_.spec) && !body_.spec.refinements.empty();
  std::vector<StructureSpec::Refinement> zones;
  if (given) zones = body_.spec.refinements;
  zones.insert(zones.end(), body_.struck_zones.begin(), body_.struck_zones.end());
  const std::size_t before = coarse.hexes.size();
  body_.discretisation.reinit(std::move(coarse), zones, most_cells(body_.spec));
  if (given && body_.struck_zones.empty() && body_.mesh.hexes.size() == before)
    bad(body_.spec, "refine", fmt::format("{} zones", body_.spec.refinements.size()),
        "no cell lies in them that is larger than they ask for",
        "give the region in scene coordinates, about the part to refine, and cells smaller than the "
        "structure's");
  if (impact_refinement(body_.spec).cell_size == 0) body_.discretisation.forget_cells();
  settle(body_.mesh);
  loads_.find_places(body_.mesh);
  make_links(body_.mesh);
  return extent;
}

void StructureSetup::settle_hanging_nodes() {
  for (const HangingNode& h : body_.mesh.hanging) {
    const auto n = static_cast<std::size_t>(h.node);
    for (const auto& [master, weight] : h.masters)
      body_.mass[static_cast<std::size_t>(master)] += weight * body_.mass[n];
    body_.mass[n] = 0;
    body_.supports.held[n] = {false, false, false};
  }
  if (body_.mesh.hanging.empty()) return;
  std::vector<char> hangs(body_.mesh.nodes.size(), 0);
  for (const HangingNode& h : body_.mesh.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  std::erase_if(body_.supports.nodes, [&](int n) { return hangs[static_cast<std::size_t>(n)] != 0; });
  for (PatchLoad& load : body_.loads) {
    std::vector<Vec3> force(body_.mesh.nodes.size(), Vec3::Zero());
    for (std::size_t k = 0; k < load.node.size(); ++k)
      force[static_cast<std::size_t>(load.node[k])] += load.force[k];
    for (const HangingNode& h : body_.mesh.hanging) {
      for (const auto& [master, weight] : h.masters)
        force[static_cast<std::size_t>(master)] += weight * force[static_cast<std::size_t>(h.node)];
      force[static_cast<std::size_t>(h.node)].setZero();
    }
    load.node.clear(), load.force.clear();
    for (int n = 0; n < static_cast<int>(force.size()); ++n)
      if (force[static_cast<std::size_t>(n)] != Vec3::Zero())
        load.node.push_back(n), load.force.push_back(force[static_cast<std::size_t>(n)]);
  }
}

}  // namespace talus::fem
