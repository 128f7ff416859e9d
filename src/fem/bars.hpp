/// The reinforcement of a structure: bars from file and by rule, their state, and their forces on the nodes.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "fem/aligned.hpp"
#include "fem/hex_mesh.hpp"
#include "fem/rebar_embed.hpp"

namespace talus::fem {

class Bars {
 public:
  /// Reads and cuts the bars of the specification. Throws InputError for bars outside the concrete.
  Bars(const StructureSpec& spec, const HexMesh& mesh, const std::vector<rebar::Member>& members);

  /// f += internal forces at displacement u; h: time since the accepted states [s]. The new states wait for accept().
  void add_forces(const double* u, double h, const std::vector<char>& live, double* f);
  void accept();
  void add_mass(double density, std::vector<double>& mass) const;

  double stored() const { return sums_.energy; }
  double dissipation() const { return sums_.dissipation; }
  std::size_t segments() const { return bars_.segments().size(); }
  std::size_t count() const { return bars_.bars().size(); }
  double steel_volume() const;
  /// Calls with pairs of cells that an unbroken bar holds together.
  void ties(const std::function<void(int, int)>& visit) const;
  void snapshot(const HexMesh& mesh, const double* u, Structure::Snapshot& s) const;
  void save(std::vector<double>& state) const;
  std::size_t restore(std::span<const double> state);

 private:
  rebar::EmbeddedBars bars_;
  std::vector<int> node_;                 // the nodes of hosts, compact numbering
  std::vector<Vec3> reference_, current_;
  std::vector<double> force_;
  std::vector<material::Steel::State> old_, next_;
  std::vector<double> old_strain_, next_strain_;
  rebar::EmbeddedBars::Sums sums_;
};

}  // namespace talus::fem
