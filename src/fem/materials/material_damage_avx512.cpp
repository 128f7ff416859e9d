#include "fem/materials/material_damage_point.hpp"
#include "fem/materials/material_simd8.hpp"

namespace talus::material {

bool ConcreteDamage::stress8_avx512(const double* strain, StrainRates* rates, const CellFrame& cell,
                                    const DamageCell& old, DamageCell& next, double* stress, double* energy,
                                    double* dissipation) const {
  return stress_by<V8>(strain, rates, cell, old, next, stress, energy, dissipation);
}

}  // namespace talus::material
