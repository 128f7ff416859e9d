/// Forces on the nodes at the present state, by the cells and the laws of a structure: what the integrators
/// step with.
///
///   f_int(u) = cells + bars + bearings,   f_visc(u, v) bulk viscosity,   f_ext(t) = m g + sum_l c_l(t) P_l
///
/// They are kept until the state changes. The laws' new states wait for accept().
#pragma once
#include "fem/integrators/nodal_fields.hpp"
#include "fem/structure_body.hpp"

namespace talus::fem {

class Forces {
 public:
  Forces(StructureBody& body, NodalFields& fields) : body_(body), fields_(fields) {}

  /// All of them at the present state and t [s].
  void evaluate(double t);
  void load(double t);                         // f_ext alone
  void load(std::span<const double> factors);  // of every load
  /// The state changed: hanging nodes follow, what is kept is stale.
  void moved();
  void masses_changed() { weights_valid_ = false; }
  /// What has no cell and no mass any more is passed over from now on: of a broken viaduct nine nodes in ten.
  void pass_over_the_gone();
  double stored() const { return stored_; }  // elastic energy by the last evaluation, this rank's part [J]
  double dissipation() const;                // by the laws in it, not yet accepted [J]
  /// Makes its states the accepted ones.
  void accept();
  bool accepted() const { return accepted_; }

 private:
  StructureBody& body_;
  NodalFields& fields_;
  std::vector<int> candidates_;
  std::vector<double> factors_;  // of the loads
  bool valid_ = false, weights_valid_ = false, accepted_ = false;
  double time_ = 0, stored_ = 0;
};

}  // namespace talus::fem
