/// What a structure is made of: cells, masses, supports, loads, laws and their history. It changes where
/// cells crack and go; how it moves is in NodalFields.
#pragma once
#include <functional>
#include <optional>

#include "fem/bearings/bearings.hpp"
#include "fem/discretisation/discretisation.hpp"
#include "fem/discretisation/division.hpp"
#include "fem/kernels/element_operator.hpp"
#include "fem/linear/elastic_system.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/rebar/bars.hpp"
#include "fem/setup.hpp"

namespace talus::fem {

using Report = std::function<void(const std::string&)>;

/// What has left a structure, and what the search for pieces last saw.
struct Losses {
  long breaks = 0, cuts_seen = 0;
  double dust_mass = 0, dust_potential = 0, eroded_volume = 0, detached_volume = 0;
  Vec3 dust_momentum = Vec3::Zero(),
       dust_spin = Vec3::Zero();  // what it left with, linear and about the origin
};

struct StructureBody : Division {
  StructureBody(const StructureSpec& as, const Vec3& g, Report lines,
                std::vector<StructureSpec::Refinement> struck)
      : spec(as), struck_zones(std::move(struck)), gravity(g), report(std::move(lines)) {}
  /// Marks the nodes that forces are added to.
  void mark_nodes(std::vector<char>& touched) const {
    elements->mark_nodes(touched);
    if (bars) bars->mark_nodes(touched);
    for (const int node : bearings ? bearings->nodes() : std::vector<int>{}) touched[node] = 1;
  }

  /// Masses of the nodes by the cells that are there [kg].
  std::vector<double> mass_of_live() const;

  /// What is being computed now, of a structure that takes more than a moment.
  void progress(const std::string& what) const {
    constexpr std::size_t large = 20000;  // cells
    if (cells_in_all() >= large) report("progress: structure " + spec.name + ": " + what);
  }

  StructureSpec spec;
  std::vector<StructureSpec::Refinement>
      struck_zones;  // where cells are halved beyond what the specification asks for
  Vec3 gravity;
  Report report;
  Discretisation discretisation;
  const HexMesh& mesh = discretisation.mesh();
  Supports supports;
  std::vector<PatchLoad> loads;
  double shear = 0, bulk = 0, wave_speed = 0;  // [Pa], [m/s]
  bool finite = false;                         // total Lagrangian
  std::optional<material::Concrete> concrete;
  DofMap dofs;
  int free_dofs = 0;         // of the whole, as dofs.size on one process
  double mass_of_cells = 0;  // of the whole, as built [kg]
  std::vector<double> cell_mass;
  std::vector<double> built_mass;  // of the nodes, as built
  double alpha = 0, omega_1 = 0;   // of damping, first circular frequency [1/s]
  double critical_step = 0;        // [s]
  bool factored = false;           // from the start, for its weight or its damping

  std::vector<char> live;      // cells
  std::vector<double> mass;    // of the nodes
  AlignedVector inverse_mass;  // nodes x 4, 0 where held
  std::vector<int> cells_at_node;
  std::unique_ptr<ElementOperator> elements;
  std::unique_ptr<ElasticSystem> elastic;
  std::unique_ptr<DamageField> damage;  // null: no damage law, no history at all
  std::unique_ptr<Bars> bars;           // null: no reinforcement
  std::unique_ptr<Bearings> bearings;   // null: no viaduct
  Losses lost;
  long revision = 0;  // grows as cells and masses change
};

}  // namespace talus::fem
