/// Linear isotropic elasticity: sigma = lambda tr(eps) I + 2 mu eps. No state, no history.
#pragma once
#include <fmt/format.h>

#include <cmath>

#include "core/reject.hpp"
#include "fem/materials/material_types.hpp"

namespace talus::material {

class Elastic {
 public:
  struct Parameters {
    double young = 0;    ///< [Pa]
    double poisson = 0;  ///< in (-1, 0.5)
  };
  struct State {};

  explicit Elastic(const Parameters& p) : p_(p) {
    if (!(p.young > 0) || !std::isfinite(p.young))
      reject("material.young", fmt::format("{:g} Pa", p.young), "must be positive",
             "concrete has about 30 GPa");
    if (!(p.poisson > -1 && p.poisson < 0.5))
      reject("material.poisson", fmt::format("{:g}", p.poisson), "must be above -1 and below 0.5",
             "concrete has about 0.2, rock 0.25");
    lambda_ = p.young * p.poisson / ((1 + p.poisson) * (1 - 2 * p.poisson));
    mu_ = p.young / (2 * (1 + p.poisson));
  }
  const Parameters& parameters() const { return p_; }
  Response operator()(const Sym& strain, const Sym& /*rate*/, const State&, State&) const {
    Response r;
    r.stress = hooke(lambda_, mu_, strain);
    r.energy = 0.5 * contract(r.stress, strain);
    return r;
  }

 private:
  Parameters p_;
  double lambda_ = 0, mu_ = 0;
};
static_assert(Law<Elastic>);

}  // namespace talus::material
