/// How a structure moves: fields of four numbers per node, and what the integrators hand to each other.
#pragma once
#include <algorithm>
#include <cmath>
#include <span>
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

  void clear_impulses() {
    for (const int n : struck) std::fill_n(&contact_impulse[4 * static_cast<std::size_t>(n)], 3, 0.0);
    struck.clear();
  }
  /// Those of a step of h [s].
  void take_impulses(double h, std::span<const NodeImpulse> impulses) {
    clear_impulses();
    contact_step = h;
    for (const NodeImpulse& p : impulses) {
      struck.push_back(p.node);
      for (int c = 0; c < 3; ++c) contact_impulse[4 * static_cast<std::size_t>(p.node) + c] += p.impulse[c];
    }
  }
  /// Whether it moves since `since` [s].
  void judge(bool moves, double since) {
    if (!moves && !still) still_since = since;
    still = !moves;
  }
  /// Whether anything moved since the permanent load came, by the largest kinetic energy so far; stored
  /// energy [J].
  bool has_moved(double stored) const { return reference_kinetic > 1e-14 * std::abs(stored); }

  Vec3 position(int n) const { return mesh.nodes[n] + Vec3(u[4 * n], u[4 * n + 1], u[4 * n + 2]); }
  Vec3 velocity(int n) const { return {v[4 * n], v[4 * n + 1], v[4 * n + 2]}; }
};

}  // namespace talus::fem
