// deal.II's conjugate gradients, preconditioned by a cycle of two levels and Trilinos' smoothed aggregation
// (ML).
//
//   K = C^T (sum_cells K_e + sum_springs w^T k w) C        multiplied by the kernels, never stored
//   A = P^T K P = sum_cells (P_e^T K_e P_e) + ...          assembled from the cells
//
// P: the six rigid motions of each aggregate (a node and those that share a cell with it), made orthonormal
// [vanek1996]. A cycle smooths by Chebyshev polynomials of D^-1 K, corrects by one cycle of ML on A, whose
// near null space is what P makes of the rigid motions, and smooths again.
//
// symbol   meaning                                           unit    shape
// K        stiffness                                         N/m     rows x rows
// P        motions of aggregates                             1       rows x 6 aggregates
// A        stiffness of the aggregates                       N/m     6 aggregates x 6 aggregates
// D        diagonal of K                                     N/m     rows
#include <deal.II/base/mpi.h>
#include <deal.II/lac/diagonal_matrix.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/lac/precondition.h>
#include <deal.II/lac/solver_cg.h>
#include <deal.II/lac/trilinos_precondition.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>
#include <fmt/format.h>
#include <ml_MultiLevelPreconditioner.h>
#include <mpi.h>
#include <Teuchos_ParameterList.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numeric>

#include "core/disjoint_sets.hpp"
#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/partition.hpp"
#include "fem/kernels/element_operator.hpp"
#include "fem/linear/linear_system.hpp"

namespace talus::fem {
namespace {

/// deal.II and ML ask MPI for its rank; a run on one process starts it here, the first time that a system is
/// this large.
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

constexpr int motions = 6;  // of a rigid body

class Multigrid : public LinearSolver {
 public:
  Multigrid(const Discretisation& cells, const DofMap& dofs, ElementOperator& elements,
            std::vector<Spring> springs, Partition* partition)
      : cells_(cells),
        mesh_(cells.mesh()),
        follows_(mesh_),
        elements_(elements),
        springs_(std::move(springs)),
        partition_(partition),
        comm_(partition != nullptr ? MPI_COMM_WORLD : MPI_COMM_SELF),
        in_(4 * mesh_.nodes.size(), 0.0),
        out_(in_.size()),
        stiffness_(*this) {
    for (int d = 0; d < dofs.size; ++d)
      if (own(dofs.node(d))) dof_.push_back(d), place_.push_back(dofs.place[d]);
    rows_ = ascending(dof_.size());
    aggregate();
    find_motions();
    set_smoother();
    set_coarse();
  }

  int solve(const double* b, double* x, double tolerance) override {
    const BlasInUse blas_in_use;
    constexpr unsigned most_iterations = 500;
    Vector rhs(rows_, comm_), solution(rows_, comm_), left(rows_, comm_);
    for (std::size_t row = 0; row < dof_.size(); ++row) rhs.local_element(row) = b[dof_[row]];
    dealii::SolverControl control(most_iterations, tolerance * rhs.l2_norm());
    try {
      dealii::SolverCG<Vector>(control).solve(stiffness_, solution, rhs, Cycle{*this});
    } catch (const dealii::SolverControl::NoConvergence&) {  // judged by what is left
    }
    multiply(solution, left);
    left.sadd(-1, 1, rhs);
    if (!(left.l2_norm() <= 10 * control.tolerance()))
      throw NumericalFailure(fmt::format("Multigrid reached a residual of {:.3g} N only after {} iterations",
                                         left.l2_norm(), control.last_step()));
    for (std::size_t row = 0; row < dof_.size(); ++row) x[dof_[row]] = solution.local_element(row);
    return static_cast<int>(control.last_step());
  }

 private:
  using Vector = dealii::LinearAlgebra::distributed::Vector<double>;
  struct Stiffness : dealii::Subscriptor {
    explicit Stiffness(const Multigrid& multigrid) : of(multigrid) {}
    void vmult(Vector& y, const Vector& x) const { of.multiply(x, y); }
    std::size_t m() const { return of.rows_.size(); }
    double el(std::size_t, std::size_t) const { return 0; }  // the diagonal is given
    const Multigrid& of;
  };
  struct Cycle {
    const Multigrid& of;
    void vmult(Vector& z, const Vector& r) const { of.cycle(z, r); }
  };
  using Smoother = dealii::PreconditionChebyshev<Stiffness, Vector, dealii::DiagonalMatrix<Vector>>;

  bool own(int node) const { return partition_ == nullptr || partition_->owns_node(node); }
  dealii::IndexSet ascending(std::size_t count) const {
    namespace mpi = dealii::Utilities::MPI;
    return mpi::create_ascending_partitioning(
        comm_, static_cast<dealii::types::global_dof_index>(count))[mpi::this_mpi_process(comm_)];
  }

  void multiply(const Vector& x, Vector& y) const {
    for (std::size_t row = 0; row < place_.size(); ++row) in_[place_[row]] = x.local_element(row);
    if (partition_ != nullptr) partition_->exchange(in_);
    cells_.distribute(in_);
    std::fill(out_.begin(), out_.end(), 0.0);
    elements_.add_internal_force(in_.data(), out_.data(), false, false);
    for (const Spring& spring : springs_) spring.add_force(in_, out_);
    cells_.condense(out_);
    for (std::size_t row = 0; row < place_.size(); ++row) y.local_element(row) = out_[place_[row]];
  }

  void cycle(Vector& z, const Vector& r) const {
    smoother_.vmult(z, r);
    Vector left(r), force(coarse_rows_, comm_), motion(coarse_rows_, comm_);
    multiply(z, left);
    left.sadd(-1, 1, r);
    const auto each = [&](auto&& use) {
      for (std::size_t row = 0; row < place_.size(); ++row)
        for (int k = 0, at = place_[row]; k < motions; ++k)
          use(row, motions * (aggregate_[at / 4] - first_aggregate_) + k, motion_[k][at]);
    };
    each([&](std::size_t row, int k, double p) { force.local_element(k) += p * left.local_element(row); });
    coarse_.vmult(motion, force);
    each([&](std::size_t row, int k, double p) { z.local_element(row) += p * motion.local_element(k); });
    smoother_.step(z, r);
  }

  /// A free node whose neighbours belong to no aggregate yet takes them into a new one; what is left goes to
  /// that of a neighbour.
  void aggregate() {
    const int nodes = static_cast<int>(mesh_.nodes.size());
    std::vector<char> free(nodes, 0);
    for (const int at : place_) free[at / 4] = 1;
    std::vector<int> first(nodes + 2, 0);  // of each node, in the list of cells that have it as a corner
    const auto corners = [&](auto&& use) {
      for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell)
        for (const int a : mesh_.hexes[cell]) follows_.each(a, [&](int n, double) { use(n, cell); });
    };
    corners([&](int n, int) { ++first[n + 2]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int> cell_of(first.back());
    corners([&](int n, int cell) { cell_of[first[n + 1]++] = cell; });
    aggregate_.assign(nodes, -1);
    const auto beside = [&](int n, auto&& use) {
      for (int at = first[n]; at < first[n + 1]; ++at)
        for (const int a : mesh_.hexes[cell_of[at]])
          follows_.each(a, [&](int m, double) {
            if (free[m]) use(aggregate_[m]);
          });
    };
    int count = 0;
    const auto begin = [&](int n) {
      beside(n, [&](int& of) { of = of < 0 ? count : of; });
      aggregate_[n] = count++;
    };
    for (int n = 0; n < nodes; ++n) {
      bool alone = free[n] != 0;
      beside(n, [&](int of) { alone = alone && of < 0; });
      if (alone) begin(n);
    }
    std::vector<int> late(aggregate_);
    for (int n = 0; n < nodes; ++n)
      if (free[n]) beside(n, [&](int of) { late[n] = late[n] < 0 ? of : late[n]; });
    aggregate_ = std::move(late);
    for (int n = 0; n < nodes; ++n)
      if (free[n] && aggregate_[n] < 0) begin(n);
    coarse_rows_ = ascending(motions * count);
    first_aggregate_ = count > 0 ? static_cast<int>(coarse_rows_.nth_index_in_set(0) / motions) : 0;
    for (int& of : aggregate_)
      if (of >= 0) of += first_aggregate_;
    if (partition_ != nullptr) partition_->exchange_numbers(aggregate_);
  }

  /// Rigid motion `k` about the origin at x.
  static Vec3 rigid(int k, const Vec3& x) {
    return k < 3 ? Vec3(Vec3::Unit(k)) : Vec3(Vec3::Unit(k - 3).cross(x));
  }

  /// P, and what it makes of the rigid motions of the whole.
  void find_motions() {
    const int count = static_cast<int>(coarse_rows_.n_elements()) / motions;
    std::vector<std::vector<int>> members(count);  // places in nodal fields
    Vec3 centre = Vec3::Zero();
    for (const int at : place_) {
      members[aggregate_[at / 4] - first_aggregate_].push_back(at);
      centre += mesh_.nodes[at / 4] / static_cast<double>(rows_.size());
    }
    if (partition_ != nullptr) partition_->sum({centre.data(), 3});
    for (AlignedVector& motion : motion_) motion.assign(in_.size(), 0.0);
    null_space_.assign(motions * coarse_rows_.n_elements(), 0.0);
    for (int i = 0; i < count; ++i) {
      const int size = static_cast<int>(members[i].size());
      Vec3 middle = Vec3::Zero();
      for (const int at : members[i]) middle += mesh_.nodes[at / 4] / size;
      MatX p = MatX::Zero(size, motions), rigid_motions(size, motions);
      for (int k = 0; k < motions; ++k) {
        VecX v(size);
        for (int r = 0; r < size; ++r) {
          const int at = members[i][r];
          v[r] = rigid(k, mesh_.nodes[at / 4] - middle)[at % 4];
          rigid_motions(r, k) = rigid(k, mesh_.nodes[at / 4] - centre)[at % 4];
        }
        const double before = v.norm();
        for (int twice = 0; twice < 2; ++twice) v -= p * (p.transpose() * v);
        constexpr double dependent = 1e-6;  // nodes on a line, or held: fewer than six motions
        if (v.norm() > dependent * before) p.col(k) = v.normalized();
        for (int r = 0; r < size; ++r) motion_[k][members[i][r]] = p(r, k);
      }
      Eigen::Map<MatX>(null_space_.data(), motions * count, motions).middleRows(motions * i, motions) =
          p.transpose() * rigid_motions;
    }
    if (partition_ != nullptr)
      for (AlignedVector& motion : motion_) partition_->exchange(motion);
  }

  void set_smoother() {
    diagonal_.assign(in_.size(), 0.0);
    each_stiffness(mesh_, elements_.shear(), elements_.bulk(), [&](int cell, const ElementMatrix& k) {
      for (int a = 0; a < 24; ++a)
        follows_.each(mesh_.hexes[cell][a / 3],
                      [&](int n, double w) { diagonal_[4 * n + a % 3] += w * w * k(a, a); });
    });
    for (const Spring& spring : springs_)
      for (int a = 0; a < 3 * static_cast<int>(spring.node.size()); ++a)
        follows_.each(spring.node[a / 3], [&](int n, double w) {
          const double by = w * spring.weight[a / 3];
          diagonal_[4 * n + a % 3] += by * by * spring.stiffness(a % 3, a % 3);
        });
    if (partition_ != nullptr) partition_->exchange(diagonal_);
    typename Smoother::AdditionalData data;
    data.degree = 3;
    data.smoothing_range = 15;
    data.eig_cg_n_iterations = 15;
    data.preconditioner = std::make_shared<dealii::DiagonalMatrix<Vector>>();
    Vector& inverse = data.preconditioner->get_vector();
    inverse.reinit(rows_, comm_);
    for (std::size_t row = 0; row < place_.size(); ++row)
      inverse.local_element(row) = 1 / diagonal_[place_[row]];
    smoother_.initialize(stiffness_, data);
  }

  /// Rows of P that belong to points which nodes carry by weights: side by side for each aggregate in `of`.
  struct Projected {
    std::vector<int> of;
    MatX rows;
  };
  void add(Projected& q, int point, int node, double weight) const {
    follows_.each(node, [&](int n, double w) {
      if (aggregate_[n] < 0) return;
      const auto at = std::find(q.of.begin(), q.of.end(), aggregate_[n]);
      const int column = motions * static_cast<int>(at - q.of.begin());
      if (at == q.of.end()) {
        q.of.push_back(aggregate_[n]);
        q.rows.conservativeResize(Eigen::NoChange, column + motions);
        q.rows.rightCols<motions>().setZero();
      }
      for (int k = 0; k < motions; ++k)
        for (int c = 0; c < 3; ++c) q.rows(3 * point + c, column + k) += w * weight * motion_[k][4 * n + c];
    });
  }

  /// Calls with the share of every cell and spring in A. Aggregates that reach over soft springs from one
  /// body to the next would move both as one, at the cost of the cells' own stiffness: what such springs
  /// couple is left to the conjugate gradients, and A sees each body on springs to the ground.
  template <class Use>
  void each_share(Use&& use) const {
    constexpr double firm = 0.3;  // of the geometric mean of both diagonal entries
    each_stiffness(mesh_, elements_.shear(), elements_.bulk(), [&](int cell, const ElementMatrix& k) {
      Projected q{{}, MatX(24, 0)};
      for (int a = 0; a < 8; ++a) add(q, a, mesh_.hexes[cell][a], 1);
      use(q, k);
    });
    if (springs_.empty()) return;
    DisjointSets bodies(static_cast<int>(mesh_.nodes.size()));
    for (const auto& hex : mesh_.hexes)
      for (const int a : hex)
        follows_.each(a, [&](int n, double) { bodies.join(hex[0], n), bodies.join(a, n); });
    for (const Spring& spring : springs_) {
      const std::size_t size = spring.node.size();
      bool whole = false;
      std::map<int, Projected> of_body;
      for (std::size_t a = 0; a < size; ++a) {
        const int body = bodies.root(spring.node[a]);
        add(of_body.try_emplace(body, Projected{{}, MatX(3, 0)}).first->second, 0, spring.node[a],
            spring.weight[a]);
        for (std::size_t b = 0; b < a; ++b)
          for (int c = 0; c < 3 && bodies.root(spring.node[b]) != body; ++c)
            whole = whole || std::abs(spring.weight[a] * spring.weight[b] * spring.stiffness(c, c)) >
                                 firm * std::sqrt(diagonal_[4 * spring.node[a] + c] *
                                                  diagonal_[4 * spring.node[b] + c]);
      }
      Projected q{{}, MatX(3, 0)};
      for (std::size_t a = 0; whole && a < size; ++a) add(q, 0, spring.node[a], spring.weight[a]);
      if (whole) of_body = {{0, q}};
      for (const auto& [body, part] : of_body) use(part, spring.stiffness);
    }
  }

  void set_coarse() {
    dealii::DynamicSparsityPattern pattern(coarse_rows_.size(), coarse_rows_.size(), coarse_rows_);
    std::vector<dealii::types::global_dof_index> columns;
    const auto each_row = [&](const Projected& q, auto&& use) {
      columns.clear();
      for (const int of : q.of)
        for (int k = 0; k < motions; ++k) columns.push_back(motions * of + k);
      for (std::size_t i = 0; i < columns.size(); ++i)
        if (coarse_rows_.is_element(columns[i])) use(columns[i], static_cast<Eigen::Index>(i));
    };
    each_share([&](const Projected& q, const auto&) {
      each_row(q, [&](auto row, Eigen::Index) { pattern.add_entries(row, columns.begin(), columns.end()); });
    });
    coarse_matrix_.reinit(coarse_rows_, pattern, comm_);
    pattern.reinit(0, 0);
    double scale = 0;
    each_share([&](const Projected& q, const auto& k) {
      const MatX share = q.rows.transpose() * (k * q.rows);
      if (share.size() > 0) scale = std::max(scale, share.diagonal().maxCoeff());
      each_row(q, [&](auto row, Eigen::Index i) {
        coarse_matrix_.add(row, columns.size(), columns.data(), share.col(i).data(), false);
      });
    });
    coarse_matrix_.compress(dealii::VectorOperation::add);
    for (const auto row : coarse_rows_)  // of a motion that the aggregate has not nothing else is in the row
      if (coarse_matrix_.diag_element(row) == 0) coarse_matrix_.set(row, row, scale);
    coarse_matrix_.compress(dealii::VectorOperation::insert);
    Teuchos::ParameterList list;
    ML_Epetra::SetDefaults("SA", list);
    list.set("ML output", 0);
    list.set("smoother: type", "Chebyshev");
    list.set("smoother: sweeps", 2);
    list.set("aggregation: type", "Uncoupled");
    list.set("aggregation: threshold", 0.0);
    list.set("coarse: type", "Amesos-KLU");
    list.set("coarse: max size", 1000);
    list.set("low memory usage", true);
    list.set("PDE equations", motions);
    list.set("null space: type", "pre-computed");
    list.set("null space: dimension", motions);
    list.set("null space: vectors", null_space_.data());
    const BlasInUse blas_in_use;
    coarse_.initialize(coarse_matrix_, list);
  }

  const Discretisation& cells_;
  const HexMesh& mesh_;
  const Followed follows_;
  ElementOperator& elements_;
  std::vector<Spring> springs_;
  Partition* partition_;  // null: all on this process
  MPI_Comm comm_;
  std::vector<int> dof_,
      place_;  // of each row: degree of freedom as the caller numbers them; in nodal fields
  dealii::IndexSet rows_, coarse_rows_;  // of this process
  std::vector<int> aggregate_;           // of each node here, among those of all processes; -1: held
  int first_aggregate_ = 0;
  std::array<AlignedVector, motions> motion_;  // P, nodes x 4
  AlignedVector diagonal_;                     // D, nodes x 4
  mutable AlignedVector in_, out_;
  Stiffness stiffness_;
  Smoother smoother_;
  dealii::TrilinosWrappers::SparseMatrix coarse_matrix_;  // A
  std::vector<double> null_space_;                        // ML keeps a pointer to it
  dealii::TrilinosWrappers::PreconditionAMG coarse_;
};

}  // namespace

std::unique_ptr<LinearSolver> make_multigrid(const Discretisation& cells, const DofMap& dofs,
                                             ElementOperator& elements, std::vector<Spring> springs,
                                             Partition* partition) {
  start_mpi();
  return std::make_unique<Multigrid>(cells, dofs, elements, std::move(springs), partition);
}

}  // namespace talus::fem
