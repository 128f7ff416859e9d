/// Stiffness of the elastic structure on its free degrees of freedom, and its sparse Cholesky factor.
///
///   K_e = V sum_k B_k^T C_k B_k over the functions of assumed_strain.hpp,
///
/// the tangent of the kernels' internal force at u = 0 (assumed_strain.hpp). The matrix holds the lower
/// triangle, columns compressed, rows sorted.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "fem/discretisation/discretisation.hpp"
#include "fem/kernels/assumed_strain.hpp"

namespace talus::fem {

struct SymmetricMatrix {
  int n = 0;
  std::vector<std::int64_t> column;  // n + 1
  std::vector<int> row;
  std::vector<double> value;
  /// y = A x
  void multiply(const double* x, double* y) const;
};

/// A spring between weighted nodes: energy 1/2 d.K d, d = sum weight u(node).
struct Spring {
  std::vector<int> node;
  std::vector<double> weight;
  Mat3 stiffness = Mat3::Zero();  // [N/m]
  /// f += its force at u; nodes x 4.
  void add_force(const AlignedVector& u, AlignedVector& f) const;
};

/// Calls with each cell and its stiffness; that of cells of one shape in a row is made once.
template <class Use>
void each_stiffness(const HexMesh& mesh, double shear, double bulk, Use&& use) {
  ElementMatrix k;
  for (int cell = 0, of = -1; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
    if (of < 0 || !same_shape(mesh, of, cell)) k = element_stiffness(mesh, cell, shear, bulk), of = cell;
    use(cell, k);
  }
}

/// `live`: cells that count, per cell; null: all. `frames`: T of each cell, whose stiffness is T K_e T^T node
/// by node; null: 1. `like`: has the entries already, of the same mesh; null: they are found anew.
SymmetricMatrix assemble_stiffness(const HexMesh& mesh, const DofMap& dofs, double shear, double bulk,
                                   const std::vector<Spring>& springs = {},
                                   const std::vector<char>* live = nullptr,
                                   const std::vector<Mat3>* frames = nullptr,
                                   const SymmetricMatrix* like = nullptr);

class ElementOperator;
class Partition;

/// L^-1 P e of one degree of freedom: zero but for the columns of the supernodes from its own to the root of
/// the elimination tree.
struct HalfColumn {
  int supernode = -1;         // its own
  std::vector<double> value;  // of all columns on the way, in the factor's order
};

/// BLAS for one thread at a time, as long as this lives. OpenBLAS without threads, Debian's package, keeps
/// buffers that callers in several threads spoil for each other (up to one factor in ten was wrong, or
/// refused); one with threads of its own may sum in another order by the machine's load, and is told to take
/// one.
class BlasInUse {
 public:
  BlasInUse();

 private:
  std::lock_guard<std::mutex> lock_;
};

/// Cholesky factor (CHOLMOD, supernodal, METIS).
class CholeskyFactor {
 public:
  /// Factor of A + shift * diag(d). Throws NumericalFailure if that is not positive definite. `ordering`, if
  /// given, goes from one factor of a pattern to the next: empty, it is found.
  CholeskyFactor(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                 std::vector<std::int64_t>* ordering = nullptr);
  ~CholeskyFactor();
  CholeskyFactor(const CholeskyFactor&) = delete;
  CholeskyFactor& operator=(const CholeskyFactor&) = delete;
  /// That of another matrix in its place, with the same digits as a new one; of the same pattern with the
  /// analysis and in the memory of the last one. If this throws, it is of no further use.
  void again(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
             std::vector<std::int64_t>* ordering = nullptr);
  /// `columns` right-hand sides at once, one after the other in memory.
  void solve(const double* b, double* x, int columns = 1) const;
  /// Halves of a solution, P A P^T = L L^T: with y_i = L^-1 P e_i an entry of the inverse is (A^-1)_ij = y_i
  /// . y_j, of which only the way that both have in common to the root counts, and A^-1 sum f_i e_i = P^T
  /// L^-T sum f_i y_i. Their digits depend on nothing but the factor and the degrees of freedom.
  HalfColumn half_column(int dof) const;
  double product(const HalfColumn& a, const HalfColumn& b) const;
  /// z += factor y, z in the factor's order, as many as there are degrees of freedom.
  void add(const HalfColumn& column, double factor, double* z) const;
  /// x = P^T L^-T z.
  void back(const double* z, double* x) const;
  /// Of its values and pattern.
  std::size_t bytes() const;

 private:
  struct Cholmod;
  void find_ways() const;
  void factorize(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                 std::vector<std::int64_t>* ordering);
  void solve(int system, const double* b, double* x, int columns) const;
  [[noreturn]] void fail(double wanted) const;

  std::unique_ptr<Cholmod> c_;
  int n_;
  std::vector<std::int64_t> column_;  // the pattern of the matrix
  std::vector<int> row_;
};

/// Set up once, solves for any number of right-hand sides.
class LinearSolver {
 public:
  virtual ~LinearSolver() = default;
  /// Returns the number of iterations; throws NumericalFailure if it does not reach |b - A x| <= tolerance
  /// |b|.
  virtual int solve(const double* b, double* x, double tolerance) = 0;
};

/// Conjugate gradients for systems too large to factor, K u = f of the cells and springs on the free degrees
/// of freedom; no matrix is stored but that of aggregates of nodes. `partition`: of a divided structure,
/// whose ranks solve together; solve() reads and writes own degrees of freedom alone. What is given outlives
/// it.
std::unique_ptr<LinearSolver> make_multigrid(const Discretisation& cells, const DofMap& dofs,
                                             ElementOperator& elements, std::vector<Spring> springs,
                                             Partition* partition = nullptr);

}  // namespace talus::fem
