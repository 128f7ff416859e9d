#include "fem/integrators/energy_account.hpp"

namespace talus::fem {

StructureEnergy EnergyAccount::total() const {
  double kinetic = 0, potential = 0, stored = 0;
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  for (const auto& [first, last] : body_.own)
    for (int i = first; i < last; ++i) {
      const Vec3 v = fields_.velocity(i);
      const Vec3 x =
          fields_.position(i) - 0.5 * fields_.h_last * v;  // at the half step, where the velocities live
      kinetic += 0.5 * body_.mass[i] * v.squaredNorm();
      potential -= body_.mass[i] * body_.gravity.dot(x);
      linear += body_.mass[i] * v;
      angular += body_.mass[i] * x.cross(v);
    }
  if (fields_.h_last == 0) {
    forces_.evaluate(fields_.time);
    stored = forces_.stored();
  }
  std::array<double, 9> all{kinetic,   potential,  stored,     linear[0], linear[1],
                            linear[2], angular[0], angular[1], angular[2]};
  body_.sum(all);
  StructureEnergy e = works;
  if (fields_.h_last == 0 &&
      !forces_.accepted()) {  // what the laws took in a condensed step is accepted by the next one
    e.damage_work += body_.damage ? body_.damage->dissipation() : 0.0;
    e.plastic_work += (body_.bars ? body_.bars->dissipation() : 0.0) +
                      (body_.bearings ? body_.bearings->dissipation() : 0.0);
  }
  e.kinetic = all[0];
  e.gravity_potential = all[1] + body_.lost.dust_potential;
  e.elastic = fields_.h_last == 0 ? all[2] : stored_half;
  e.linear_momentum = Vec3(&all[3]) + body_.lost.dust_momentum;
  e.angular_momentum = Vec3(&all[6]) + body_.lost.dust_spin;
  return e;
}

double EnergyAccount::mechanical() const {
  const StructureEnergy e = total();
  return e.kinetic + e.elastic + e.gravity_potential;
}

/// Of a step that becomes h, with a . f = `own` and v . (df_int/dt) = `strained` of all ranks. Where the
/// latter is not known, after a jump of the forces and where no step went before, the other half stands for
/// both: right on the average, too.
void EnergyAccount::lengthen(double h, double own, double strained) {
  const double q = fields_.h_last > 0 && power_valid ? 0.5 * (own + strained) : own;
  const double less = (h * h - fields_.h_last * fields_.h_last) / 8 * q;
  works.step_dependence += less;
  works.algorithmic -= less;
}

void EnergyAccount::accept_laws() {
  works.plastic_work +=
      (body_.bars ? body_.bars->dissipation() : 0.0) + (body_.bearings ? body_.bearings->dissipation() : 0.0);
  works.damage_work += body_.damage ? body_.damage->dissipation() : 0.0;
  forces_.accept();
}

}  // namespace talus::fem
