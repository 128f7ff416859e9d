#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/memory.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/discretisation/trilinear.hpp"
#include "fem/linear/mechanism.hpp"
#include "fem/output/place_in_words.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {
namespace {

constexpr double steel_density = 7850;  // [kg/m^3]

/// Whether any bar presses the concrete from the start.
bool prestressed(const Bars* bars) {
  return bars != nullptr && std::any_of(bars->list().begin(), bars->list().end(),
                                        [](const rebar::Bar& bar) { return bar.steel.prestress > 0; });
}

}  // namespace

FemStructure::FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck,
                           const FemStructure* before)
    : spec_(spec), struck_zones_(std::move(struck)), gravity_(gravity), report_(report) {
  set_material(before == nullptr);
  shear_ = spec_.young / (2 * (1 + spec_.poisson));
  bulk_ = spec_.young / (3 * (1 - 2 * spec_.poisson));
  wave_speed_ = std::sqrt((bulk_ + 4.0 / 3 * shear_) / spec_.density);
  const Box3 extent = make_cells();
  give_back_memory();
  live_.assign(mesh_.hexes.size(), 1);
  if (before != nullptr) supports_.centroid = before->supports_.centroid;  // moments go on about one point
  rebuild_skin();
  set_loads(extent);

  const std::size_t n = mesh_.nodes.size();
  if (!partition_) own_ = {{0, static_cast<int>(n)}};
  touched_ = {{0, static_cast<int>(n)}};
  for (AlignedVector* a : {&u_, &v_, &f_int_, &f_ext_, &v_hat_, &inverse_mass_, &contact_impulse_})
    a->assign(4 * n, 0.0);
  set_masses();
  if (!operator_) operator_ = std::make_unique<ElementOperator>(mesh_, shear_, bulk_, spec_.damage != "none");
  if (spec_.damage != "none") {
    damage_ = make_damage_field(spec_.damage, mesh_, *concrete_, spec_.rate_effect, finite_, largest_cell(),
                                "structure." + spec_.name + ".cell_size");
    f_visc_.assign(4 * n, 0.0);
    if (partition_) damage_->restrict_to(*partition_);
  }
  elastic_ = std::make_unique<ElasticSystem>(ElasticSystem::Parts{
      spec_, discretisation_, dofs_, shear_, bulk_, *operator_, bars_, bearings_, live_, partition_});
  if (!divided()) check_supports(mesh_);
  progress(fmt::format("{} cells and {} degrees of freedom are made; next its stable step",
                       partition_ ? partition_->cells_in_all() : mesh_.hexes.size(), free_dofs_));
  find_critical_step();
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (!supports_.held[i][c]) v_[4 * i + c] = spec_.initial_velocity[c];
  if (spec_.damping_ratio > 0 && !supports_.none && free_dofs_ > 0) {
    progress("first frequency");
    omega_1_ = before != nullptr ? before->omega_1_ : elastic_->first_frequency(built_mass_);
    alpha_ = 2 * spec_.damping_ratio * omega_1_;
  }
  if (spec_.gravity_preload && !supports_.none && free_dofs_ > 0 &&
      (gravity_.norm() > 0 || prestressed(bars_.get())))
    preload();
  factored_ = elastic_->factored();
  elastic_->forget_multigrid();  // only the preload and the first frequency of large systems need it
  give_back_memory();
  set_members();
  divide();
  moved();
  begin_loads();
  keep_rest();
}

FemStructure::~FemStructure() = default;

/// Of the concrete, if it is one; `first`: with a report.
void FemStructure::set_material(bool first) {
  if (spec_.f_cm > 0) {
    material::ConcreteInput input;
    input.f_cm = spec_.f_cm;
    input.young = spec_.young;
    input.poisson = spec_.poisson;
    input.density = spec_.density;
    input.f_t = spec_.tensile_strength;
    input.fracture_energy = spec_.fracture_energy;
    concrete_ = material::mc2010(input, "structure." + spec_.name + ".material");
    spec_.young = concrete_->young;
    spec_.poisson = concrete_->poisson;
    spec_.density = concrete_->density;
    concrete_->aggregate = spec_.aggregate;
    for (const std::string& line : first ? concrete_->report : std::vector<std::string>{})
      report_("structure " + spec_.name + ": " + line);
  }
  if (spec_.damage != "none" && !concrete_)
    bad(spec_, "damage", spec_.damage, "a damage law needs a concrete",
        "give the material an f_cm, or write damage = \"none\"");
  if (spec_.damage != "none" && spec_.damage != "concrete" && spec_.damage != "concrete-cdpm2")
    bad(spec_, "damage", spec_.damage, "must be none, concrete or concrete-cdpm2", "choose one");
  if (!(spec_.young > 0))
    bad(spec_, "material", fmt::format("young = {:g}", spec_.young), "Young's modulus must be positive",
        "give young or f_cm for the material");
  if (!(spec_.poisson > -1 && spec_.poisson < 0.5))
    bad(spec_, "material", fmt::format("poisson = {:g}", spec_.poisson), "must lie in (-1, 0.5)",
        "correct the material");
  if (!(spec_.density > 0))
    bad(spec_, "material", fmt::format("density = {:g}", spec_.density), "must be positive",
        "correct the material");
  if (!(spec_.critical_step_fraction > 0 && spec_.critical_step_fraction <= 1))
    bad(spec_, "critical_step_fraction", fmt::format("{:g}", spec_.critical_step_fraction),
        "must lie in (0, 1]", "take 0.9");
}

material::CellSize FemStructure::largest_cell() const {
  material::CellSize largest;
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    const Mat3 edges = 2 * jacobian(mesh_, cell, Vec3::Zero());
    largest.edge = std::max(largest.edge, edges.colwise().norm().maxCoeff());
    for (const double y : {1.0, -1.0})
      for (const double z : {1.0, -1.0})
        largest.diagonal = std::max(largest.diagonal, (edges * Vec3(1, y, z)).norm());
  }
  largest.edge = this->largest(largest.edge), largest.diagonal = this->largest(largest.diagonal);
  return largest;
}

/// What is being computed now, of a structure that takes more than a moment.
void FemStructure::progress(const std::string& what) const {
  constexpr std::size_t large = 20000;  // cells
  if ((partition_ ? partition_->cells_in_all() : mesh_.hexes.size()) >= large)
    report_(fmt::format("progress: structure {}: {}", spec_.name, what));
}

/// Parts connected to supports must be held by them wherever a static solution is needed; elsewhere a part
/// may move as a pendulum, hence rotate.
void FemStructure::check_supports(const HexMesh& mesh) {
  if (supports_.none) return;
  const std::optional<LoosePart> loose =
      loose_part(mesh, supports_, bearings_ ? bearings_->springs() : std::vector<Spring>{});
  if (!loose) return;
  finite_ = true;
  const bool weighs = spec_.gravity_preload && (gravity_.norm() > 0 || prestressed(bars_.get()));
  if (!weighs && !(spec_.damping_ratio > 0)) return;
  const Vec3 at = mesh.nodes[static_cast<std::size_t>(mesh.hexes[static_cast<std::size_t>(loose->first)][0])];
  const std::string part =
      loose->cells == static_cast<int>(mesh.hexes.size())
          ? "the structure"
          : fmt::format("a part of {} cells, {} near ({:.4g}, {:.4g}, {:.4g}) and others", loose->cells,
                        cell_name(mesh, loose->first), at.x(), at.y(), at.z());
  const std::string wanted =
      weighs ? "preload = \"none\" if it is meant to move" : "no damping_ratio if it is meant to move";
  if (loose->held)
    bad(spec_, "support", part, "its supports leave it free to " + loose->motion,
        "hold more nodes or directions, or write " + wanted);
  bad(spec_, "support", part, "nothing holds it: it shares no node with a part that is held",
      "merge the nodes of the mesh that lie in one place, or hold this part too");
}

void FemStructure::set_loads(const Box3& extent) {
  if (!divided()) {
    loads_ = find_loads(spec_, mesh_, skin_);
    return;
  }
  std::vector<SkinQuad> faces = skin(mesh_, live_);  // at own nodes
  std::erase_if(faces, [this](const SkinQuad& q) {
    return std::none_of(q.node.begin(), q.node.end(), [this](int n) { return own_node(n); });
  });
  loads_ = find_loads(spec_, mesh_, faces, &extent);
  for (std::size_t k = 0; k < loads_.size(); ++k) check_area(spec_, spec_.loads[k], largest(loads_[k].area));
}

void FemStructure::make_links(const HexMesh& whole) {
  if (spec_.kind == "viaduct") bearings_ = std::make_unique<Bearings>(spec_, whole, viaduct_plan(spec_));
  if (spec_.rebar_file.empty() && spec_.rebar_rules.empty()) return;
  std::vector<rebar::Member> shapes;
  for (const Pier& pier : find_piers(spec_)) shapes.push_back(pier.shape);
  bars_ = std::make_unique<Bars>(spec_, whole, supports_, std::move(shapes),
                                 [&](const std::string& text) { report_("warning: " + text); });
}

void FemStructure::set_masses() {
  const std::size_t n = mesh_.nodes.size();
  cells_at_node_.assign(n, 0);
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell)
    for (int node : carriers(mesh_, cell)) ++cells_at_node_[node];
  if (partition_) partition_->exchange_numbers(cells_at_node_);
  cell_mass_ = cell_volumes(mesh_);
  mass_of_cells_ = 0;
  for (std::size_t cell = 0; cell < cell_mass_.size(); ++cell) {
    cell_mass_[cell] *= spec_.density;
    if (own_cell(static_cast<int>(cell))) mass_of_cells_ += cell_mass_[cell];
  }
  sum({&mass_of_cells_, 1});
  // Row sums of the consistent mass: integral of rho N_a, with the points of the stiffness.
  mass_.assign(n, 0.0);
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
    const TrilinearMap map(mesh_, cell);
    for (int q = 0; q < 8; ++q) {
      const std::array<double, 8> shape = shape_values(gauss_point(q));
      const double w = spec_.density * map.jacobian(gauss_point(q)).determinant();
      for (int a = 0; a < 8; ++a) mass_[mesh_.hexes[cell][a]] += w * shape[a];
    }
  }
  if (bars_) bars_->add_mass(steel_density - spec_.density, mass_);
  settle_hanging_nodes();
  if (partition_) partition_->exchange_numbers(mass_);
  built_mass_ = mass_;
  discretisation_.hold(supports_.held);
  dofs_ = discretisation_.free_dofs();
  long free = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (own_node(static_cast<int>(i)))
      for (const int d : dofs_.number[i]) free += d >= 0;
  free_dofs_ = static_cast<int>(count_of(free));
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (dofs_.number[i][c] >= 0) inverse_mass_[4 * i + c] = 1 / mass_[i];
}

void FemStructure::find_critical_step() {
  if (free_dofs_ ==
      0) {  // nothing can move: waves cross a cell as they would, and what asks for a step gets a number
    double shortest = INFINITY;
    for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell)
      shortest = std::min(shortest, 2 * jacobian(mesh_, cell, Vec3::Zero()).colwise().norm().minCoeff());
    critical_step_ = spec_.critical_step_fraction * -largest(-shortest) / wave_speed_;
    return;
  }
  critical_step_ = spec_.critical_step_fraction * 2 / elastic_->highest_frequency(mass_, inverse_mass_);
  // Linear bulk viscosity b1 shortens the stable step by sqrt(1 + b1^2) - b1.
  if (damage_) critical_step_ *= std::sqrt(1 + 0.06 * 0.06) - 0.06;
}

}  // namespace talus::fem
