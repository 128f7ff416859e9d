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

}  // namespace

int multigrid_by_trilinos(const SymmetricMatrix& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const double* b, double* x,
                          double tolerance) {
  start_mpi();
  Epetra_MpiComm comm(MPI_COMM_SELF);
  Epetra_Map map(a.n, 0, comm);
  std::vector<int> count(a.n, 0);
  for (int c = 0; c < a.n; ++c)
    for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k) {
      ++count[c];
      if (a.row[k] != c) ++count[a.row[k]];
    }
  Epetra_CrsMatrix matrix(Copy, map, count.data(), true);
  for (int c = 0; c < a.n; ++c) {
    const int entries = static_cast<int>(a.column[c + 1] - a.column[c]);
    matrix.InsertGlobalValues(c, entries, &a.value[a.column[c]], &a.row[a.column[c]]);
    for (std::int64_t k = a.column[c]; k < a.column[c + 1]; ++k)
      if (a.row[k] != c) matrix.InsertGlobalValues(a.row[k], 1, &a.value[k], &c);
  }
  matrix.FillComplete();
  matrix.OptimizeStorage();

  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : position) centre += p / a.n;
  std::vector<double> motions(6 * static_cast<std::size_t>(a.n), 0.0);
  for (int d = 0; d < a.n; ++d) {
    const Vec3 r = position[d] - centre;
    motions[static_cast<std::size_t>(direction[d]) * a.n + d] = 1;
    for (int k = 0; k < 3; ++k) motions[static_cast<std::size_t>(3 + k) * a.n + d] = Vec3::Unit(k).cross(r)[direction[d]];
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
  // Nodes that are held in some directions only leave less than three equations behind: then no blocks.
  bool blocks = a.n % 3 == 0;
  for (int d = 0; d < a.n && blocks; ++d) blocks = direction[d] == d % 3;
  list.set("PDE equations", blocks ? 3 : 1);
  list.set("null space: type", "pre-computed");
  list.set("null space: dimension", 6);
  list.set("null space: vectors", motions.data());
  ML_Epetra::MultiLevelPreconditioner preconditioner(matrix, list);

  Epetra_Vector rhs(Copy, map, const_cast<double*>(b)), solution(map);
  Epetra_LinearProblem problem(&matrix, &solution, &rhs);
  AztecOO solver(problem);
  solver.SetPrecOperator(&preconditioner);
  solver.SetAztecOption(AZ_solver, AZ_cg);
  solver.SetAztecOption(AZ_output, AZ_none);
  solver.SetAztecOption(AZ_conv, AZ_rhs);
  solver.Iterate(500, tolerance);
  if (solver.TrueResidual() > 10 * tolerance * [&] { double norm; rhs.Norm2(&norm); return norm; }())
    throw NumericalFailure(fmt::format("Multigrid reached a residual of {:.3g} N only after {} iterations", solver.TrueResidual(), solver.NumIters()));
  for (int i = 0; i < a.n; ++i) x[i] = solution[i];
  return solver.NumIters();
}

}  // namespace talus::fem
