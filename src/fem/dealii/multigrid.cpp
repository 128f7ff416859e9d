// Trilinos through its own interfaces: Epetra matrix, ML preconditioner, AztecOO conjugate gradients.
#include <AztecOO.h>
#include <Epetra_CrsMatrix.h>
#include <Epetra_Map.h>
#include <Epetra_MpiComm.h>
#include <Epetra_Vector.h>
#include <Teuchos_ParameterList.hpp>
#include <fmt/format.h>
#include <ml_MultiLevelPreconditioner.h>
#include <mpi.h>

#include <cstdlib>

#include "core/error.hpp"
#include "fem/dealii/parts.hpp"

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

constexpr int largest_smoothed = 400000;   // degrees of freedom

class Multigrid : public LinearSolver {
 public:
  Multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction)
      : n_(a.n), comm_(MPI_COMM_SELF), map_(a.n, 0, comm_), matrix_(full(std::move(a), map_)) {
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
    preconditioner_ = std::make_unique<ML_Epetra::MultiLevelPreconditioner>(*matrix_, list);
  }

  int solve(const double* b, double* x, double tolerance) override {
    Epetra_Vector rhs(View, map_, const_cast<double*>(b)), solution(map_);
    Epetra_LinearProblem problem(matrix_.get(), &solution, &rhs);
    AztecOO solver(problem);
    solver.SetPrecOperator(preconditioner_.get());
    solver.SetAztecOption(AZ_solver, AZ_cg);
    solver.SetAztecOption(AZ_output, AZ_none);
    solver.SetAztecOption(AZ_conv, AZ_rhs);
    solver.Iterate(500, tolerance);
    double norm = 0;
    rhs.Norm2(&norm);
    if (solver.TrueResidual() > 10 * tolerance * norm)
      throw NumericalFailure(fmt::format("Multigrid reached a residual of {:.3g} N only after {} iterations", solver.TrueResidual(), solver.NumIters()));
    for (int i = 0; i < n_; ++i) x[i] = solution[i];
    return solver.NumIters();
  }

 private:
  /// Both triangles by rows; the triangle given is freed.
  static std::unique_ptr<Epetra_CrsMatrix> full(SymmetricMatrix&& given, const Epetra_Map& map) {
    const SymmetricMatrix a = std::move(given);
    std::vector<int> count(a.n, 0);
    for (int c = 0; c < a.n; ++c)
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
        ++count[c];
        if (a.row[k] != c) ++count[a.row[k]];
      }
    auto matrix = std::make_unique<Epetra_CrsMatrix>(Copy, map, count.data(), true);
    for (int c = 0; c < a.n; ++c) {
      matrix->InsertGlobalValues(c, static_cast<int>(a.column[c + 1] - a.column[c]), &a.value[a.column[c]], &a.row[a.column[c]]);
      for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k)
        if (a.row[k] != c) matrix->InsertGlobalValues(a.row[k], 1, &a.value[k], &c);
    }
    matrix->FillComplete();
    return matrix;
  }

  int n_;
  Epetra_MpiComm comm_;
  Epetra_Map map_;
  std::unique_ptr<Epetra_CrsMatrix> matrix_;
  std::vector<double> motions_;  // ML keeps a pointer to it
  std::unique_ptr<ML_Epetra::MultiLevelPreconditioner> preconditioner_;
};

}  // namespace

std::unique_ptr<LinearSolver> multigrid_by_trilinos(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction) {
  start_mpi();
  return std::make_unique<Multigrid>(std::move(a), position, direction);
}

}  // namespace talus::fem
