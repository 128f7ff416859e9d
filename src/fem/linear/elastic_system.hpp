/// The elastic structure at rest as a linear system on its free degrees of freedom, and both ends of its
/// spectrum:
///
///   K u = f,     K x = omega^2 M x,     K = C^T (cells + bars + bearings) C
///
/// By the sparse factor up to largest_factored_system degrees of freedom, above by conjugate gradients with
/// multigrid.
///
/// symbol   meaning                                            unit    shape
/// K        stiffness as built, C of hanging nodes applied     N/m     dofs x dofs
/// M        lumped mass                                        kg      nodes
#pragma once
#include <memory>
#include <vector>

#include "fem/discretisation/discretisation.hpp"
#include "fem/linear/linear_system.hpp"

namespace talus::fem {

struct StructureBody;

/// Degrees of freedom up to which the stiffness is factored; above, multigrid is cheaper in time and memory.
constexpr int largest_factored_system = 150000;

class ElasticSystem {
 public:
  /// The body outlives it.
  explicit ElasticSystem(const StructureBody& body) : body_(body) {}

  /// Of bearings and bars; bars turn with the frames of their cells.
  std::vector<Spring> springs(const std::vector<Mat3>* frames = nullptr) const;
  /// Each is made when it is first asked for. Throws InputError where there is no room for the factor.
  const SymmetricMatrix& stiffness();
  const CholeskyFactor& factor();
  LinearSolver& multigrid();
  bool factored() const { return factor_ != nullptr; }
  void forget_factor() { factor_.reset(); }
  void forget_multigrid() { multigrid_.reset(); }

  /// A bound on the highest circular frequency, 1 % above Lanczos' value after 40 steps, which comes from
  /// below [rad/s].
  double highest_frequency(const std::vector<double>& mass, const AlignedVector& inverse_mass) const;
  /// The lowest one: by Lanczos' method (modal.hpp), of large or divided systems by lowest_eigenvalue()
  /// [rad/s]. Throws NumericalFailure if that does not converge.
  double first_frequency(const std::vector<double>& mass);

 private:
  /// y := K x by the kernels and these springs, nodes x 4; x is made to fit its constraints.
  void apply(const std::vector<Spring>& springs, AlignedVector& x, AlignedVector& y) const;

  const StructureBody& body_;
  SymmetricMatrix stiffness_;  // empty until needed
  std::unique_ptr<CholeskyFactor> factor_;
  std::unique_ptr<LinearSolver> multigrid_;
};

}  // namespace talus::fem
