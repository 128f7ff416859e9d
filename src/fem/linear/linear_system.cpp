#include "fem/linear/linear_system.hpp"

#include <algorithm>

#include "core/sort_unique.hpp"
#include "fem/discretisation/hanging.hpp"

namespace talus::fem {

void SymmetricMatrix::multiply(const double* x, double* y) const {
  std::fill(y, y + n, 0.0);
  for (int c = 0; c < n; ++c) {
    double sum = 0;
    for (std::int64_t k = column[c]; k < column[c + 1]; ++k) {
      const int r = row[k];
      if (r == c) {
        sum += value[k] * x[c];
      } else {
        sum += value[k] * x[r];
        y[r] += value[k] * x[c];
      }
    }
    y[c] += sum;
  }
}

void Spring::add_force(const AlignedVector& u, AlignedVector& f) const {
  Vec3 d = Vec3::Zero();
  for (std::size_t k = 0; k < node.size(); ++k)
    d += weight[k] * Vec3(u[4 * node[k]], u[4 * node[k] + 1], u[4 * node[k] + 2]);
  const Vec3 force = stiffness * d;
  for (std::size_t k = 0; k < node.size(); ++k)
    for (int c = 0; c < 3; ++c) f[4 * node[k] + c] += weight[k] * force[c];
}

namespace {

/// T K_ab T^T, node by node.
ElementMatrix framed(const ElementMatrix& k, const Mat3& t) {
  ElementMatrix out;
  for (Eigen::Index b = 0; b < 24; b += 3)
    for (Eigen::Index a = 0; a < 24; a += 3) out.block<3, 3>(a, b) = t * k.block<3, 3>(a, b) * t.transpose();
  return out;
}

/// Springs between the nodes that theirs follow.
std::vector<Spring> followed(const Followed& follows, const std::vector<Spring>& springs) {
  std::vector<Spring> out;
  for (const Spring& spring : springs) {
    Spring one{{}, {}, spring.stiffness};
    for (std::size_t k = 0; k < spring.node.size(); ++k)
      follows.each(spring.node[k], [&](int node, double weight) {
        one.node.push_back(node), one.weight.push_back(weight * spring.weight[k]);
      });
    out.push_back(std::move(one));
  }
  return out;
}

/// Entries of cells and springs, lower part by column, in order; no values.
SymmetricMatrix pattern_of(const HexMesh& mesh, const Followed& follows, const DofMap& dofs,
                           const std::vector<Spring>& springs) {
  const int cells = static_cast<int>(mesh.hexes.size()), nodes = static_cast<int>(mesh.nodes.size());
  // Node-to-node graph, lower part by column.
  std::vector<std::vector<int>> touched(nodes);
  for (int cell = 0; cell < cells; ++cell)
    for (int a : mesh.hexes[cell])
      follows.each(a, [&](int i, double) {
        for (int b : mesh.hexes[cell]) follows.each(b, [&](int j, double) { touched[i].push_back(j); });
      });
  for (int a = 0; a < nodes; ++a) touched[a].push_back(a);  // the diagonal is stored, zero or not
  for (const Spring& spring : springs)
    for (int a : spring.node)
      for (int b : spring.node) touched[a].push_back(b);
  for (auto& list : touched) { sort_unique(list); }
  SymmetricMatrix m;
  m.n = dofs.size;
  m.column.assign(m.n + 1, 0);
  for (int column = 0; column < m.n; ++column) {
    for (int other : touched[dofs.node(column)])
      for (int c = 0; c < 3; ++c)
        if (dofs.number[other][c] >= column) m.row.push_back(dofs.number[other][c]);
    std::sort(m.row.begin() + m.column[column], m.row.end());
    m.column[column + 1] = static_cast<std::int64_t>(m.row.size());
  }
  return m;
}

}  // namespace

SymmetricMatrix assemble_stiffness(const HexMesh& mesh, const DofMap& dofs, double shear, double bulk,
                                   const std::vector<Spring>& given, const std::vector<char>* live,
                                   const std::vector<Mat3>* frames, const SymmetricMatrix* like) {
  const Followed follows(mesh);
  const std::vector<Spring> springs = followed(follows, given);
  SymmetricMatrix m = like != nullptr ? SymmetricMatrix{like->n, like->column, like->row, {}}
                                      : pattern_of(mesh, follows, dofs, springs);
  m.value.assign(m.row.size(), 0.0);
  bool fits = true;
  const auto add = [&](int row, int column, double value) {
    const auto first = m.row.begin() + m.column[column], last = m.row.begin() + m.column[column + 1],
               at = std::lower_bound(first, last, row);
    if (at == last || *at != row)
      fits = false;
    else
      m.value[at - m.row.begin()] += value;
  };
  each_stiffness(mesh, shear, bulk, [&](int cell, const ElementMatrix& shared) {
    if (live != nullptr && !(*live)[cell]) return;
    const ElementMatrix k =
        frames != nullptr ? framed(shared, (*frames)[static_cast<std::size_t>(cell)]) : shared;
    for (int b = 0; b < 24; ++b) {
      follows.each(mesh.hexes[cell][b / 3], [&](int of_column, double by_column) {
        const int column = dofs.number[of_column][b % 3];
        if (column < 0) return;
        for (int a = 0; a < 24; ++a)
          follows.each(mesh.hexes[cell][a / 3], [&](int of_row, double by_row) {
            const int row = dofs.number[of_row][a % 3];
            if (row >= column) add(row, column, by_row * by_column * k(a, b));
          });
      });
    }
  });
  for (const Spring& spring : springs)
    for (std::size_t b = 0; b < spring.node.size(); ++b)
      for (std::size_t a = 0; a < spring.node.size(); ++a)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) {
            const int column = dofs.number[spring.node[b]][j], row = dofs.number[spring.node[a]][i];
            if (column >= 0 && row >= column)
              add(row, column, spring.weight[a] * spring.weight[b] * spring.stiffness(i, j));
          }
  return fits ? m : assemble_stiffness(mesh, dofs, shear, bulk, given, live, frames);  // `like` lacked some
}

}  // namespace talus::fem
