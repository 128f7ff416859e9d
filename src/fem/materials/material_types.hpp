/// The interface that every continuum law answers to: parameters, a State, and a call operator.
///
///   (strain, strain rate, old state) -> stress, new state, stored energy, dissipation increment
///
/// symbol       meaning                                                      unit     shape
/// strain       engineering strain xx yy zz yz zx xy (shears are gamma)      -        6
/// rate         its time derivative                                          1/s      6
/// stress       xx yy zz yz zx xy, tension positive                          Pa       6
/// energy       stored (recoverable) energy density, 1/2 sigma : eps_el      J/m^3    1
/// dissipation  dissipated during this call, never negative                  J/m^3    1
/// returned     what a stress without a potential gave back beyond that:     J/m^3    1
///              work = energy gained + dissipation - returned
///
/// The old state is never changed: a rejected step leaves no trace. `next` may alias `old`.
/// Laws are plain values without virtual functions, so that an element loop written for one of them is
/// inlined.
#pragma once
#include <array>
#include <concepts>

namespace talus::material {

using Sym = std::array<double, 6>;  ///< xx yy zz yz zx xy

struct Response {
  Sym stress{};
  double energy = 0;
  double dissipation = 0;
  double returned = 0;
};

/// The strain rates at the eight points of a cell, for a law that asks for them: one that needs them only
/// where damage starts does not pay for them elsewhere.
class StrainRates {
 public:
  /// [6][8], component by component [1/s].
  virtual const double* at_points() = 0;

 protected:
  ~StrainRates() = default;
};

template <class L>
concept Law = requires(const L& law, const Sym& strain, const Sym& rate, const typename L::State& old,
                       typename L::State& next) {
  typename L::Parameters;
  { law(strain, rate, old, next) } -> std::same_as<Response>;
  { law.parameters() } -> std::convertible_to<const typename L::Parameters&>;
};

/// sigma : eps with engineering shears.
inline double contract(const Sym& stress, const Sym& strain) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += stress[i] * strain[i];
  return sum;
}

/// Isotropic C : eps.
inline Sym hooke(double lambda, double mu, const Sym& e) {
  const double p = lambda * (e[0] + e[1] + e[2]);
  return {p + 2 * mu * e[0], p + 2 * mu * e[1], p + 2 * mu * e[2], mu * e[3], mu * e[4], mu * e[5]};
}

}  // namespace talus::material
