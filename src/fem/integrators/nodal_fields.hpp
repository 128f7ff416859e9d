/// How a structure moves: fields of four numbers per node, and what the integrators hand to each other.
#pragma once
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/kernels/aligned.hpp"

namespace talus::fem {

struct NodalFields {
  explicit NodalFields(const HexMesh& of) : mesh(of) {}

  const HexMesh& mesh;
  AlignedVector u, v, v_hat;
  AlignedVector f_int, f_visc, f_ext;  // f_visc: empty without damage
  AlignedVector contact_impulse;       // of the last step [N s]
  std::vector<int> struck;             // nodes with an entry in it
  double contact_step = 0;             // [s]
  double time = 0;
  double h_last = 0;       // 0: v is at the same time as u
  double steps_taken = 0;  // explicit ones
  double drag = 1;  // between predict() and correct() 1 + alpha h/2, by which damping adds to the mass that
                    // an impulse meets
  double reference_kinetic = 0;
  double still_since = 0;  // kinetic energy has been below the limit since then
  bool still = false;
  long revision = 0, predictions = 0;  // grow when u or v, when v_hat changes

  Vec3 position(int n) const { return mesh.nodes[n] + Vec3(u[4 * n], u[4 * n + 1], u[4 * n + 2]); }
  Vec3 velocity(int n) const { return {v[4 * n], v[4 * n + 1], v[4 * n + 2]}; }
};

}  // namespace talus::fem
