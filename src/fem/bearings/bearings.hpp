/// Bearings between decks and cap beams: each pad is a set of springs between nodes of the deck and points of
/// the cap.
///
/// The law of one spring (unilateral, friction, seat) is material::Bearing; a pad's stiffness is shared
/// evenly by its springs. The foot of a spring is the point of the cap below its node: as far as the node has
/// slipped from its place, the foot has moved over the cap, to its edge at most, so that the force acts where
/// the deck lies. The displaced cap's slope there turns the force (material::Bearing).
#pragma once
#include <map>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/discretisation/partition.hpp"
#include "fem/discretisation/viaduct.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/materials/material_steel.hpp"
#include "fem/rebar/rebar_embed.hpp"
#include "fem/state_reader.hpp"

namespace talus::fem {

class Bearings {
 public:
  /// A point of a cap beam: u = sum_a weight_a u_a.
  struct Foot {
    int cell = -1;
    std::array<int, 8> node{};
    std::array<double, 8> weight{};
    std::array<std::array<double, 8>, 2>
        gradient{};  // of the weights, along and across [1/m]; 0 where the cap has ended
  };
  struct Site {
    int deck, end;  // which span, which end of it
    int deck_node, deck_cell;
    int cap;        // part of the mesh
    Vec3 place;     // below the node, as built, in the cap beam's axes
    double height;  // of the node above it, as built [m]
    Foot built;
  };
  /// The mesh must outlive the bearings.
  Bearings(const StructureSpec& spec, const HexMesh& mesh, const ViaductPlan& plan);
  /// From now on by the numbers of a part of the mesh, which holds all of cells(): every rank computes all
  /// bearings, from the motion of nodes that all are told of.
  void divide(const Partition& partition, const HexMesh& part);

  void add_forces(const double* u, const std::vector<char>& live, double* f);
  void accept();
  double stored() const { return energy_; }
  /// Energy, by the last evaluation, of the springs at any of these cells, as long as both of a spring's
  /// cells are there [J].
  double stored_at(const std::vector<int>& cells, const std::vector<char>& live) const;
  double dissipation() const { return dissipation_; }
  const std::vector<Site>& sites() const { return sites_; }
  /// The cell of the cap that a spring stands on now.
  int cap_cell(std::size_t site) const { return foot_[site].cell; }
  const Foot& foot(std::size_t site) const { return foot_[site]; }
  /// All cells that springs stand on or may come to stand on, or hang at; ascending. And the nodes that
  /// springs act on, or may come to act on.
  std::vector<int> cells() const;
  std::vector<int> nodes() const;
  double friction() const { return law_.front().parameters().friction; }
  bool holds(std::size_t site) const { return old_[site].lost == 0; }
  /// Ends of a span of which no spring holds any more.
  int ends_unseated(int deck) const;
  /// Linear springs for the stiffness matrix, as built.
  std::vector<Spring> springs() const;
  void save(std::vector<double>& state) const;
  void restore(StateReader& state);

 private:
  /// The upper cells of one cap beam, to be searched in its axes.
  struct Cap {
    Cap(const HexMesh& mesh, int part, double top);
    Cap(const HexMesh& mesh, std::vector<int> cells);
    Cap(const Cap&) = delete;
    Cap& operator=(const Cap&) = delete;
    /// At `place`, or at the nearest point of the cap; no cell if there is none.
    Foot foot(const HexMesh& mesh, const Vec3& place) const;
    std::vector<int> cell;
    std::vector<std::array<int, 8>> hexes;
    Box3 box;
    rebar::HostSearch search;
  };
  void move_foot(std::size_t site);  // to where its slip says

  const HexMesh* mesh_;
  std::map<int, Cap> caps_;  // by part of the mesh
  std::vector<Site> sites_;
  std::vector<Foot> foot_;              // now
  std::vector<material::Bearing> law_;  // per site
  std::vector<material::Bearing::State> old_, next_;
  std::vector<double> site_energy_;
  Vec3 along_, across_, up_;
  double energy_ = 0, dissipation_ = 0;
};

}  // namespace talus::fem
