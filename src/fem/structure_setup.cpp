#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/discretisation/trilinear.hpp"
#include "fem/linear/mechanism.hpp"
#include "fem/linear/static_balance.hpp"
#include "fem/output/place_in_words.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"

extern "C" void openblas_set_num_threads(int) __attribute__((weak));

namespace talus::fem {
namespace {

constexpr double steel_density = 7850;  // [kg/m^3]

/// What is being computed now, of a structure that takes more than a moment.
void progress(const Report& report, const StructureSpec& spec, std::size_t cells, const std::string& what) {
  constexpr std::size_t large = 20000;  // cells
  if (cells >= large) report(fmt::format("progress: structure {}: {}", spec.name, what));
}

/// Whether any bar presses the concrete from the start.
bool prestressed(const Bars* bars) {
  return bars != nullptr && std::any_of(bars->list().begin(), bars->list().end(),
                                        [](const rebar::Bar& bar) { return bar.steel.prestress > 0; });
}

}  // namespace

FemStructure::FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck,
                           const FemStructure* before)
    : spec_(spec), struck_zones_(std::move(struck)), gravity_(gravity), report_(report) {
  // BLAS with several threads may sum in another order: results must not depend on the machine's load.
  if (openblas_set_num_threads) openblas_set_num_threads(1);
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
    for (const std::string& line : before == nullptr ? concrete_->report : std::vector<std::string>{})
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
  shear_ = spec_.young / (2 * (1 + spec_.poisson));
  bulk_ = spec_.young / (3 * (1 - 2 * spec_.poisson));
  wave_speed_ = std::sqrt((bulk_ + 4.0 / 3 * shear_) / spec_.density);
  const Box3 extent = make_cells();
  live_.assign(mesh_.hexes.size(), 1);
  if (before != nullptr) supports_.centroid = before->supports_.centroid;  // moments go on about one point
  rebuild_skin();
  set_loads(extent);

  const std::size_t n = mesh_.nodes.size(),
                    cells_in_all = partition_ ? partition_->cells_in_all() : mesh_.hexes.size();
  if (!partition_) own_ = {{0, static_cast<int>(n)}};
  touched_ = {{0, static_cast<int>(n)}};
  for (AlignedVector* a : {&u_, &v_, &f_int_, &f_ext_, &v_hat_, &inverse_mass_, &contact_impulse_})
    a->assign(4 * n, 0.0);
  set_masses();
  if (!operator_) operator_ = std::make_unique<ElementOperator>(mesh_, shear_, bulk_, spec_.damage != "none");
  if (spec_.damage != "none") {
    material::CellSize largest;
    for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell) {
      const Mat3 edges = 2 * jacobian(mesh_, cell, Vec3::Zero());
      largest.edge = std::max(largest.edge, edges.colwise().norm().maxCoeff());
      for (const double y : {1.0, -1.0})
        for (const double z : {1.0, -1.0})
          largest.diagonal = std::max(largest.diagonal, (edges * Vec3(1, y, z)).norm());
    }
    largest.edge = this->largest(largest.edge), largest.diagonal = this->largest(largest.diagonal);
    damage_ = make_damage_field(spec_.damage, mesh_, *concrete_, spec_.rate_effect, finite_, largest,
                                "structure." + spec_.name + ".cell_size");
    f_visc_.assign(4 * n, 0.0);
    if (partition_) damage_->restrict_to(*partition_);
  }
  elastic_ = std::make_unique<ElasticSystem>(ElasticSystem::Parts{
      spec_, discretisation_, dofs_, shear_, bulk_, *operator_, bars_, bearings_, live_, partition_});
  if (!divided()) check_supports(mesh_);
  progress(report_, spec_, cells_in_all,
           fmt::format("{} cells and {} degrees of freedom are made; next its stable step", cells_in_all,
                       free_dofs_));
  find_critical_step();
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c)
      if (!supports_.held[i][c]) v_[4 * i + c] = spec_.initial_velocity[c];
  if (spec_.damping_ratio > 0 && !supports_.none && free_dofs_ > 0) {
    progress(report_, spec_, cells_in_all, "first frequency");
    omega_1_ = before != nullptr ? before->omega_1_ : elastic_->first_frequency(built_mass_);
    alpha_ = 2 * spec_.damping_ratio * omega_1_;
  }
  if (spec_.gravity_preload && !supports_.none && free_dofs_ > 0 &&
      (gravity_.norm() > 0 || prestressed(bars_.get())))
    preload();
  factored_ = elastic_->factored();
  elastic_->forget_multigrid();  // only the preload and the first frequency of large systems need it
  set_members();
  divide();
  moved();
  begin_loads();
  keep_rest();
}

FemStructure::~FemStructure() = default;

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

void FemStructure::preload() {
  const int n = dofs_.size;
  std::vector<double> b(n), x(n, 0.0);
  external_force(0);
  for (const PatchLoad& load : loads_) {  // gravity alone: what varies in time is dynamics
    const double factor = load.factor(0);
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) f_ext_[4 * load.node[k] + c] -= factor * load.force[k][c];
  }
  for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs_.number[i][c]; d >= 0) b[d] = f_ext_[4 * i + c];
  // What the forces that find a balance are measured by: the weight; without gravity what the bars press
  // with, at no displacement.
  double pressed = 0;
  if (gravity_.isZero(0) && bars_) {
    bars_->add_forces(u_.data(), 0, live_, f_int_.data());
    discretisation_.condense(f_int_);
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0) {
          b[d] -= f_int_[4 * i + c];
          if (own_node(static_cast<int>(i))) pressed += f_int_[4 * i + c] * f_int_[4 * i + c];
        }
    sum({&pressed, 1});
  }
  const bool factored = !divided() && n <= largest_factored_system;
  // Small strain: one solve. Total Lagrangian: the same factor, until the forces balance.
  const bool once = !finite_ && !bars_;
  double residual = 0, scale = 0, last = 0;  // squared
  int iterations = 0;
  constexpr int most_passes = 40;
  for (int pass = 0; pass < most_passes; ++pass) {
    if (!factored) {
      progress(report_, spec_, mesh_.hexes.size(),
               pass == 0 ? "permanent load"
                         : fmt::format("permanent load, pass {} of at most {}, {:.1e} of it left", pass + 1,
                                       most_passes, std::sqrt(residual / scale)));
      iterations += elastic_->multigrid().solve(
          b.data(), x.data(),
          once ? 1e-12 : 1e-4);  // no closer than a pass that is not linear comes to its balance
    } else {
      elastic_->factor().solve(b.data(), x.data());
    }
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0) u_[4 * i + c] += x[d];
    if (partition_) partition_->exchange(u_);
    discretisation_.distribute(u_);
    if (once) break;
    std::fill(f_int_.begin(), f_int_.end(), 0.0);
    operator_->add_internal_force(u_.data(), f_int_.data(), finite_, false);
    if (bars_) bars_->add_forces(u_.data(), 0, live_, f_int_.data());
    if (bearings_) bearings_->add_forces(u_.data(), live_, f_int_.data()), bearings_->accept();
    discretisation_.condense(f_int_);
    last = residual;
    double squares[2] = {};
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0 && own_node(static_cast<int>(i))) {
          b[d] = f_ext_[4 * i + c] - f_int_[4 * i + c];
          squares[0] += b[d] * b[d], squares[1] += f_ext_[4 * i + c] * f_ext_[4 * i + c];
        }
    sum(squares);
    residual = squares[0], scale = pressed + squares[1];
    if (residual <= 1e-24 * scale || (pass > 0 && residual <= 1e-18 * scale && residual > 0.25 * last))
      break;  // the latter: rounding is all that is left
  }
  if (iterations > 0)
    report_(fmt::format("structure {}: gravity preload by multigrid, {} iterations", spec_.name, iterations));
  if (bars_) bars_->accept();
  moved();
  const bool balanced = !(residual > 1e-12 * scale);
  still_ = balanced && spec_.initial_velocity.isZero();
  if (!balanced)
    report_(fmt::format(
        "warning: under its permanent load no state at rest was found, {:.2g} of the load is left (bars that "
        "yield, a deck that slides): it moves from t = 0 by itself, and what it suffers "
        "by that is in all that the run tells, before any block arrives; see by a run without blocks how "
        "much that is, and correct section, bars, prestress or supports",
        std::sqrt(residual / scale)));
  if (!damage_) return;
  warn_of_cracks();
  forces(0);
  const auto cracked_cells = [this] {
    return count_of(std::count_if(damage_->cells().begin(), damage_->cells().end(),
                                  [this](int cell) { return own_cell(cell); }));
  };
  if (cracked_cells() == 0) return;
  // The permanent load comes slowly: what it cracks is in balance before the run begins. Laws are evaluated
  // from virgin concrete to u each time: what a pass overshoots leaves no crack.
  const AlignedVector elastic(u_);
  const auto left = [&](VecX& force) {
    double size = pressed;
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0) {
          const double weight = mass_[i] * gravity_[c];
          force[d] = weight - f_int_[4 * i + c];
          size += weight * weight;
        }
    return force.norm() / std::sqrt(size);
  };
  const auto solve = [&](const VecX& force, VecX& way) {
    elastic_->factor().solve(force.data(), way.data());
  };
  const auto move = [&](const VecX& way) {
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i)
      for (int c = 0; c < 3; ++c)
        if (const int d = dofs_.number[i][c]; d >= 0) u_[4 * i + c] += way[d];
    moved();
    forces(0);
  };
  const bool affordable = factored;  // each pass is a solution
  // Assumed lateral strains go by the accepted damage (kernels/assumed_strain.hpp): what is accepted is
  // balanced again, until that asks for nothing.
  constexpr int most_turns = 30;
  int passes = 0, turns = 0;
  for (bool found = balanced && affordable; found && turns < most_turns; ++turns) {
    const StaticBalance cracked = find_balance(n, left, solve, move);
    found = cracked.found && spent_cells().empty();
    passes += cracked.passes;
    if (!found) break;
    accept_laws();
    moved();
    forces(0);
    VecX force(n);
    if (left(force) <= balanced_enough) {
      report_(
          fmt::format("structure {}: its weight takes {} cells beyond the elastic limit of the concrete; it "
                      "stands with what has cracked ({} passes)",
                      spec_.name, cracked_cells(), passes));
      books_ = StructureEnergy{};  // that was before the run
      moved();
      return;
    }
  }
  books_ = StructureEnergy{};
  u_ = elastic;
  moved();
  forces(0);
  still_ = false;
  int worst = -1;
  double most = -1;
  for (const int cell : damage_->cells())
    if (const double d = std::max(damage_->tension(cell), damage_->compression(cell));
        own_cell(cell) && d > most)
      most = d, worst = cell;
  const std::string place = place_of_most(most, worst);
  report_(fmt::format(
      "warning: under its permanent load no state at rest was found: {} cells are beyond the elastic limit "
      "of the concrete, the worst {}, and crack or yield by themselves from t = 0 on, which the run's "
      "damage, "
      "cracks, reactions and damage class include, before any block arrives; see by a run without blocks how "
      "much that is. A deck needs bars or prestress that carry it ([[structure.rebar]] part = \"deck\"), "
      "what is pressed too much less prestress or a larger section",
      cracked_cells(), place));
}

}  // namespace talus::fem
