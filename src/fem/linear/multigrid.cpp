// deal.II's conjugate gradients with Trilinos' smoothed aggregation (ML).
#include <Epetra_CrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <Teuchos_ParameterList.hpp>
#include <deal.II/lac/solver_cg.h>
#include <deal.II/lac/vector.h>
#include <fmt/format.h>
#include <ml_MultiLevelPreconditioner.h>
#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/disjoint_sets.hpp"
#include "core/error.hpp"
#include "fem/linear/linear_system.hpp"

namespace talus::fem {
namespace {

/// ML asks MPI for its rank; a run on one process starts it here, the first time that a system is this large.
void start_mpi() {
  int running = 0;
  MPI_Initialized(&running);
  if (running) return;
  MPI_Init(nullptr, nullptr);
  std::atexit([] {
    int done = 0;
    MPI_Finalized(&done);
    if (!done) MPI_Finalize();
  });
}

/// Epetra and ML answer by numbers: below 0 an error, above it a warning. `what` was not done.
void require(int code, const char* what) {
  if (code < 0) throw NumericalFailure(fmt::format("Multigrid: {} failed (Trilinos error {})", what, code));
}

constexpr int largest_smoothed = 400000;   // degrees of freedom

/// Aggregates that reach over soft springs from one body to the next would move both as one, at the cost of the cells' own stiffness: what such springs couple is left to the conjugate
/// gradients, and the preconditioner sees each body on springs to the ground.
class Multigrid : public LinearSolver {
 public:
  Multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body)
      : n_(a.n), comm_(MPI_COMM_SELF), map_(a.n, 0, comm_), matrix_(bodies_of(std::move(a), body)) {
    motions_.assign(6 * static_cast<std::size_t>(n_), 0.0);
    Vec3 centre = Vec3::Zero();
    for (const Vec3& p : position) centre += p / n_;
    for (int d = 0; d < n_; ++d) {
      const Vec3 r = position[d] - centre;
      motions_[static_cast<std::size_t>(direction[d]) * n_ + d] = 1;
      for (int k = 0; k < 3; ++k) motions_[static_cast<std::size_t>(3 + k) * n_ + d] = Vec3::Unit(k).cross(r)[direction[d]];
    }
    Teuchos::ParameterList list;
    ML_Epetra::SetDefaults("SA", list);
    list.set("ML output", 0);
    list.set("smoother: type", "Chebyshev");
    list.set("smoother: sweeps", 2);
    list.set("aggregation: type", "Uncoupled");
    list.set("aggregation: threshold", 0.0);
    list.set("coarse: type", "Amesos-KLU");
    list.set("coarse: max size", 1000);
    // Smoothing the prolongation halves the iterations; the products that it takes cost more memory than the matrix.
    list.set("low memory usage", true);
    if (n_ > largest_smoothed) list.set("aggregation: damping factor", 0.0);
    // Nodes that are held in some directions only leave less than three equations behind: then no blocks.
    bool blocks = n_ % 3 == 0;
    for (int d = 0; d < n_ && blocks; ++d) blocks = direction[d] == d % 3;
    list.set("PDE equations", blocks ? 3 : 1);
    list.set("null space: type", "pre-computed");
    list.set("null space: dimension", 6);
    list.set("null space: vectors", motions_.data());
    preconditioner_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(*matrix_, list, false);
    require(preconditioner_->ComputePreconditioner(), "the preconditioner");
  }

  int solve(const double* b, double* x, double tolerance) override {
    constexpr unsigned most_iterations = 500;
    Vector rhs(b, b + n_), solution(rhs.size()), left(rhs.size());
    dealii::SolverControl control(most_iterations, tolerance * rhs.l2_norm());
    try {
      dealii::SolverCG<Vector>(control).solve(Stiffness{*this}, solution, rhs, Cycle{*this});
    } catch (const dealii::SolverControl::NoConvergence&) {   // judged by what is left
    }
    multiply(solution, left);
    left.sadd(-1, 1, rhs);
    if (!(left.l2_norm() <= 10 * control.tolerance()))
      throw NumericalFailure(fmt::format("Multigrid reached a residual of {:.3g} N only after {} iterations", left.l2_norm(), control.last_step()));
    std::copy(solution.begin(), solution.end(), x);
    return static_cast<int>(control.last_step());
  }

 private:
  using Vector = dealii::Vector<double>;
  struct Stiffness {
    const Multigrid& of;
    void vmult(Vector& y, const Vector& x) const { of.multiply(x, y); }
  };
  struct Cycle {
    const Multigrid& of;
    void vmult(Vector& z, const Vector& r) const {
      Epetra_Vector from = of.view(r), to = of.view(z);
      require(of.preconditioner_->ApplyInverse(from, to), "a cycle of the preconditioner");
    }
  };
  struct Entry { int row, column; double value; };

  Epetra_Vector view(const Vector& x) const { return {View, map_, const_cast<double*>(x.begin())}; }
  void multiply(const Vector& x, Vector& y) const {
    Epetra_Vector from = view(x), to = view(y);
    require(matrix_->Multiply(false, from, to), "a product with the stiffness");
    for (const Entry& e : between_) y[e.row] += e.value * x[e.column], y[e.column] += e.value * x[e.row];
  }
  /// Both triangles by rows, without what couples bodies, which goes to between_; the triangle given is freed.
  std::unique_ptr<Epetra_CrsMatrix> bodies_of(SymmetricMatrix&& given, const std::vector<int>& body) {
    constexpr double firm = 0.3;   // of the geometric mean of both diagonal entries: bodies coupled more firmly count as one
    const SymmetricMatrix a = std::move(given);
    DisjointSets sets(body.empty() ? 0 : 1 + *std::max_element(body.begin(), body.end()));
    const auto within = [&](int row, int column) { return body.empty() || sets.root(body[static_cast<std::size_t>(row)]) == sets.root(body[static_cast<std::size_t>(column)]); };
    const auto diagonal = [&](int c) { return a.value[a.column[c]]; };   // first in its column
    for (int c = 0; c < a.n; ++c)
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k)
        if (!within(a.row[k], c) && std::abs(a.value[k]) > firm * std::sqrt(diagonal(c) * diagonal(a.row[k]))) sets.join(body[static_cast<std::size_t>(c)], body[static_cast<std::size_t>(a.row[k])]);
    std::vector<int> count(a.n, 0);
    for (int c = 0; c < a.n; ++c)
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
        if (!within(a.row[k], c)) {
          if (a.value[k] != 0) between_.push_back({a.row[k], c, a.value[k]});
          continue;
        }
        ++count[c];
        if (a.row[k] != c) ++count[a.row[k]];
      }
    auto matrix = std::make_unique<Epetra_CrsMatrix>(Copy, map_, count.data(), true);
    std::vector<int> row;
    std::vector<double> value;
    for (int c = 0; c < a.n; ++c) {
      row.clear(), value.clear();
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
        if (!within(a.row[k], c)) continue;
        row.push_back(a.row[k]), value.push_back(a.value[k]);
        if (a.row[k] != c) require(matrix->InsertGlobalValues(a.row[k], 1, &a.value[k], &c), "the assembly of the stiffness");
      }
      require(matrix->InsertGlobalValues(c, static_cast<int>(row.size()), value.data(), row.data()), "the assembly of the stiffness");
    }
    require(matrix->FillComplete(), "the assembly of the stiffness");
    return matrix;
  }

  int n_;
  Epetra_MpiComm comm_;
  Epetra_Map map_;
  std::vector<Entry> between_;       // of the lower triangle, what couples bodies
  std::unique_ptr<Epetra_CrsMatrix> matrix_;
  std::vector<double> motions_;  // ML keeps a pointer to it
  std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> preconditioner_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body) {
  start_mpi();
  return std::make_unique<Multigrid>(std::move(a), position, direction, body);
}

}  // namespace talus::fem
