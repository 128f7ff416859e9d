// deal.II's conjugate gradients with Trilinos' smoothed aggregation (ML).
#include <Epetra_CrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/lac/solver_cg.h>
#include <fmt/format.h>
#include <ml_MultiLevelPreconditioner.h>
#include <mpi.h>
#include <Teuchos_ParameterList.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

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

constexpr int largest_smoothed = 400000;  // degrees of freedom

/// Aggregates that reach over soft springs from one body to the next would move both as one, at the cost of
/// the cells' own stiffness: what such springs couple is left to the conjugate gradients, and the
/// preconditioner sees each body on springs to the ground.
class Multigrid : public LinearSolver {
 public:
  Multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction,
            const std::vector<int>& body, const SharedDofs* shared)
      : own_(own_of(a.n, shared)),
        n_(static_cast<int>(own_.size())),
        comm_(shared != nullptr ? MPI_COMM_WORLD : MPI_COMM_SELF),
        number_(numbers_of(a.n, shared)),
        map_(-1, n_, own_numbers().data(), 0, comm_),
        matrix_(bodies_of(std::move(a), body)) {
    motions_.assign(6 * static_cast<std::size_t>(n_), 0.0);
    Vec3 centre = Vec3::Zero();
    const int in_all = map_.NumGlobalElements();
    for (const int d : own_) centre += position[d] / in_all;
    const Vec3 mine = centre;
    comm_.SumAll(const_cast<double*>(mine.data()), centre.data(), 3);
    for (int row = 0; row < n_; ++row) {
      const int d = own_[row];
      const Vec3 r = position[d] - centre;
      motions_[static_cast<std::size_t>(direction[d]) * n_ + row] = 1;
      for (int k = 0; k < 3; ++k)
        motions_[static_cast<std::size_t>(3 + k) * n_ + row] = Vec3::Unit(k).cross(r)[direction[d]];
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
    // Smoothing the prolongation halves the iterations; the products that it takes cost more memory than the
    // matrix.
    list.set("low memory usage", true);
    if (in_all > largest_smoothed) list.set("aggregation: damping factor", 0.0);
    // Nodes that are held in some directions only leave less than three equations behind: then no blocks.
    int even = n_ % 3 == 0, blocks = 0;
    for (int row = 0; row < n_ && even; ++row) even = direction[own_[row]] == row % 3;
    comm_.MinAll(&even, &blocks, 1);
    list.set("PDE equations", blocks ? 3 : 1);
    list.set("null space: type", "pre-computed");
    list.set("null space: dimension", 6);
    list.set("null space: vectors", motions_.data());
    preconditioner_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(*matrix_, list, false);
    require(preconditioner_->ComputePreconditioner(), "the preconditioner");
  }

  int solve(const double* b, double* x, double tolerance) override {
    constexpr unsigned most_iterations = 500;
    Vector rhs = field(), solution = field(), left = field();
    for (int row = 0; row < n_; ++row) rhs.local_element(row) = b[own_[row]];
    dealii::SolverControl control(most_iterations, tolerance * rhs.l2_norm());
    try {
      dealii::SolverCG<Vector>(control).solve(Stiffness{*this}, solution, rhs, Cycle{*this});
    } catch (const dealii::SolverControl::NoConvergence&) {  // judged by what is left
    }
    multiply(solution, left);
    left.sadd(-1, 1, rhs);
    if (!(left.l2_norm() <= 10 * control.tolerance()))
      throw NumericalFailure(fmt::format("Multigrid reached a residual of {:.3g} N only after {} iterations",
                                         left.l2_norm(), control.last_step()));
    for (int row = 0; row < n_; ++row) x[own_[row]] = solution.local_element(row);
    return static_cast<int>(control.last_step());
  }

 private:
  using Vector = dealii::LinearAlgebra::distributed::Vector<double>;
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
  struct Entry {
    int row, column;
    double value;
  };

  static std::vector<int> own_of(int n, const SharedDofs* shared) {
    std::vector<int> own;
    for (int d = 0; d < n; ++d)
      if (shared == nullptr || shared->own[d]) own.push_back(d);
    return own;
  }
  static std::vector<int> numbers_of(int n, const SharedDofs* shared) {
    if (shared != nullptr) return shared->number;
    std::vector<int> number(n);
    std::iota(number.begin(), number.end(), 0);
    return number;
  }
  std::vector<int> own_numbers() const {
    std::vector<int> list;
    for (const int d : own_) list.push_back(number_[d]);
    return list;
  }
  Vector field() const {
    dealii::IndexSet own(static_cast<dealii::types::global_dof_index>(map_.NumGlobalElements()));
    if (n_ > 0) own.add_range(map_.MinMyGID(), map_.MaxMyGID() + 1);
    return Vector(own, comm_.Comm());
  }
  Epetra_Vector view(const Vector& x) const { return {View, map_, const_cast<double*>(x.begin())}; }
  void multiply(const Vector& x, Vector& y) const {
    Epetra_Vector from = view(x), to = view(y);
    require(matrix_->Multiply(false, from, to), "a product with the stiffness");
    for (const Entry& e : between_)
      y.local_element(e.row) += e.value * x.local_element(e.column),
          y.local_element(e.column) += e.value * x.local_element(e.row);
  }
  /// Both triangles by rows, without what couples bodies, which goes to between_; the triangle given is
  /// freed.
  std::unique_ptr<Epetra_CrsMatrix> bodies_of(SymmetricMatrix&& given, const std::vector<int>& body) {
    constexpr double firm =
        0.3;  // of the geometric mean of both diagonal entries: bodies coupled more firmly count as one
    const SymmetricMatrix a = std::move(given);
    DisjointSets sets(body.empty() ? 0 : 1 + *std::max_element(body.begin(), body.end()));
    const auto within = [&](int row, int column) {
      return body.empty() || sets.root(body[static_cast<std::size_t>(row)]) ==
                                 sets.root(body[static_cast<std::size_t>(column)]);
    };
    const auto diagonal = [&](int c) { return a.value[a.column[c]]; };  // first in its column
    for (int c = 0; c < a.n; ++c)
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k)
        if (!within(a.row[k], c) && std::abs(a.value[k]) > firm * std::sqrt(diagonal(c) * diagonal(a.row[k])))
          sets.join(body[static_cast<std::size_t>(c)], body[static_cast<std::size_t>(a.row[k])]);
    std::vector<int> row_of(a.n, -1), count(n_, 0);
    for (int row = 0; row < n_; ++row) row_of[own_[row]] = row;
    for (int c = 0; c < a.n; ++c)
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
        if (!within(a.row[k], c)) {
          if (a.value[k] != 0) between_.push_back({a.row[k], c, a.value[k]});
          continue;
        }
        if (row_of[c] >= 0) ++count[row_of[c]];
        if (a.row[k] != c && row_of[a.row[k]] >= 0) ++count[row_of[a.row[k]]];
      }
    auto matrix = std::make_unique<Epetra_CrsMatrix>(Copy, map_, count.data(), true);
    std::vector<int> row;
    std::vector<double> value;
    for (int c = 0; c < a.n; ++c) {
      row.clear(), value.clear();
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
        if (!within(a.row[k], c)) continue;
        row.push_back(number_[a.row[k]]), value.push_back(a.value[k]);
        if (a.row[k] != c && row_of[a.row[k]] >= 0)
          require(matrix->InsertGlobalValues(number_[a.row[k]], 1, &a.value[k], &number_[c]),
                  "the assembly of the stiffness");
      }
      if (row_of[c] >= 0)
        require(
            matrix->InsertGlobalValues(number_[c], static_cast<int>(row.size()), value.data(), row.data()),
            "the assembly of the stiffness");
    }
    require(matrix->FillComplete(), "the assembly of the stiffness");
    return matrix;
  }

  std::vector<int> own_;  // of each row, its degree of freedom as the caller numbers them
  int n_;                 // rows of this process
  Epetra_MpiComm comm_;
  std::vector<int> number_;  // of each degree of freedom of the caller, among those of all processes
  Epetra_Map map_;
  std::vector<Entry> between_;  // of the lower triangle, what couples bodies
  std::unique_ptr<Epetra_CrsMatrix> matrix_;
  std::vector<double> motions_;  // ML keeps a pointer to it
  std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> preconditioner_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position,
                                             const std::vector<int>& direction, const std::vector<int>& body,
                                             const SharedDofs* shared) {
  start_mpi();
  return std::make_unique<Multigrid>(std::move(a), position, direction, body, shared);
}

}  // namespace talus::fem
