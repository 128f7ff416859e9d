// Small scenes of boxes and planes for the method "dda-1988".
#pragma once
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "contact/detection/detect.hpp"
#include "dda/shi1988.hpp"

namespace talus::dda::test {

inline std::shared_ptr<const Polyhedron> box_shape(const Vec3& size) {
  std::vector<Vec3> v;
  for (int k = 0; k < 8; ++k)
    v.push_back(0.5 * size.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  const std::vector<std::array<int, 3>> t{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                          {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return std::make_shared<const Polyhedron>(make_polyhedron(v, t));
}

struct Scene {
  Model model;
  State state;
  Shi1988State history;
  std::vector<Plane> planes;
  std::vector<const contact::SurfaceIndex*> surfaces;
  ContactLaws laws;

  explicit Scene(double friction, double kn, double ks) {
    laws.materials = 1;
    ContactLaw law;
    law.friction = friction;
    law.stiffness = ContactLaw::Stiffness::per_contact;
    law.normal_stiffness = kn;
    law.shear_stiffness = ks;
    laws.law = {law};
  }
  ContactLaw& law() { return laws.law[0]; }

  int add_box(const Vec3& size, const Vec3& position, const Quat& q = Quat::Identity(), double density = 2500,
              double young = 50e9) {
    Model::Block b;
    b.name = "B" + std::to_string(model.blocks.size());
    b.shape = box_shape(size);
    b.volume = size.prod();
    b.mass = density * b.volume;
    b.second_moment = Vec3(b.mass / 12 * size.cwiseProduct(size)).asDiagonal();
    b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
    b.deformable = true;
    b.young = young;
    b.poisson = 0.2;
    model.blocks.push_back(b);
    state.c.push_back(position);
    state.v.push_back(Vec3::Zero());
    state.w.push_back(Vec3::Zero());
    state.q.push_back(q);
    state.eps.push_back(Vec6::Zero());
    state.eps_rate.push_back(Vec6::Zero());
    return static_cast<int>(model.blocks.size()) - 1;
  }
  Shi1988Report step(const Shi1988& method, double dt) {
    return method.step(model, state, history, planes, surfaces, laws, dt);
  }
  /// Closes the ledger of a step against the energies before and after.
  static double total(const Shi1988Report& r) { return r.kinetic + r.potential + r.strain + r.contact; }
  static double dissipated(const Shi1988Report& r) {
    return r.friction_work + r.algorithmic() - r.partner_work;
  }
};

/// Slow variants run only when asked for.
inline bool full() { return std::getenv("TALUS_FULL") != nullptr; }

}  // namespace talus::dda::test
