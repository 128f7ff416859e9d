// Springs whose contact vanished while they were loaded, with no other to hand their energy to: it goes into
// motion, along their normals.
//
//   p u + p^2 (J A^-1 J^T) / 2 = E,   u = J v the velocity at which the two part, p >= 0
//
// The geometry names a contact by its features; where a block presses deep into a kink or round an edge a
// loaded one may end from one step to the next. The rest of its unloading is then an impulse.
#include "coupling/springs/release.hpp"

#include <cmath>

#include "coupling/rows/contact_rows.hpp"

namespace talus::coupling {

bool release_springs(const IslandContext& in, std::span<const LooseSpring> loose, Ledger& ledger) {
  struct Side {
    std::size_t block;
    Vec12 velocity, row, given;
  };
  const auto side = [&](int block, const Vec3& x, const Vec3& n, std::vector<Side>& sides) {
    const int l = block < 0 ? -1 : in.local[static_cast<std::size_t>(block)];
    if (l < 0) return;
    const auto k = static_cast<std::size_t>(block);
    Mat12 mass, inverse;
    dda::impulse_mass(in.model, in.state, block, !in.model.blocks[k].deformable, mass, inverse);
    Side s{k,
           {},
           point_row(in.model.blocks[k], in.state.rotation(block), dda::pose(in.state, block).F.inverse(),
                     x - in.state.c[k], n),
           {}};
    s.velocity << in.state.v[k], in.state.w[k], in.state.eps_rate[k];
    s.given = inverse * s.row;
    sides.push_back(s);
  };
  bool moved = false;
  for (const LooseSpring& spring : loose) {
    std::vector<Side> sides;
    double speed = 0, flexibility = 0, scale = 0;
    const auto parts = [&] { return speed >= 0 || 2 * flexibility * spring.energy >= speed * speed; };
    // Where it was; if the two come on there, through the centroid: they would be turned round, out of
    // little.
    for (const Vec3& x : {spring.place, in.state.c[static_cast<std::size_t>(spring.b)]}) {
      sides.clear();
      side(spring.b, x, spring.normal, sides);
      if (spring.a.kind == Partner::Kind::block) side(spring.a.index, x, -spring.normal, sides);
      speed = flexibility = scale = 0;
      for (const Side& s : sides) {
        speed += s.row.dot(s.velocity);
        flexibility += s.row.dot(s.given);
        scale += in.model.blocks[s.block].mass *
                 (0.5 * in.state.v[s.block].squaredNorm() + in.model.gravity.norm() * in.scale.length);
      }
      if (parts()) break;
    }
    // Less than the accuracy asks for is left to the scheme: what rests is not shaken by the features that it
    // changes.
    if (sides.empty() || !parts() || !(spring.energy > 0.01 * in.scale.error_limit() * scale)) continue;
    const double impulse =
        2 * spring.energy / (speed + std::sqrt(speed * speed + 2 * flexibility * spring.energy));
    for (const Side& s : sides) {
      const Vec12 velocity = s.velocity + impulse * s.given;
      in.state.v[s.block] = velocity.head<3>();
      in.state.w[s.block] = velocity.segment<3>(3);
      if (in.model.blocks[s.block].deformable) in.state.eps_rate[s.block] = velocity.tail<6>();
    }
    ledger.algorithmic -= spring.energy;  // which the step counts as lost
    moved = true;
  }
  return moved;
}

}  // namespace talus::coupling
