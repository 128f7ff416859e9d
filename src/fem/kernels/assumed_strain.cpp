#include "fem/kernels/assumed_strain.hpp"

#include <algorithm>
#include <cmath>

namespace talus::fem {
CellDirections cell_directions(const HexMesh& mesh, int cell) {
  const Mat3 j = jacobian(mesh, cell, Vec3::Zero());
  const Mat3 edge = j.colwise().normalized();
  if ((edge - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-13) return {Mat3::Identity(), Mat3::Identity()};
  const Mat3 duals = j.inverse().transpose();
  return {duals.colwise().normalized(), edge};
}

AssumedStrain::AssumedStrain(const HexMesh& mesh, int cell, double nu) : poisson(nu) {
  for (double& share : lateral) share = 1;
  const TrilinearMap map(mesh.nodes, mesh.hexes[static_cast<std::size_t>(cell)]);
  double volume = 0;
  for (int q = 0; q < 8; ++q) volume += weight[q] = map.jacobian(gauss_point(q)).determinant();
  for (double& w : weight) w /= volume;
  even = std::all_of(weight, weight + 8, [](double w) { return std::abs(w - 0.125) < 1e-14; });
  const CellDirections d = cell_directions(mesh, cell);
  oblique = !d.edge.isIdentity(1e-14);
  for (int x = 0; x < 3; ++x) {
    direction[x][0] = direction[x][7] = 0;
    for (int k = 0; k < 3; ++k)
      direction[x][1 << k] = d.normal(x, k), direction[x][7 - (1 << k)] = d.edge(x, k);
  }
}

namespace {
using Row = Eigen::Matrix<double, 1, 24>;
using Strain = Eigen::Matrix<double, 6, 24>;  // of the displacements: xx yy zz yz zx xy, engineering shears
using Moduli = Eigen::Matrix<double, 6, 6>;

/// E n of a strain (engineering shears), as a matrix.
Eigen::Matrix<double, 3, 6> product_with(const Vec3& n) {
  Eigen::Matrix<double, 3, 6> p;
  p << n.x(), 0, 0, 0, 0.5 * n.z(), 0.5 * n.y(), 0, n.y(), 0, 0.5 * n.z(), 0, 0.5 * n.x(), 0, 0, n.z(),
      0.5 * n.y(), 0.5 * n.x(), 0;
  return p;
}

/// Moduli of the strains whose stress vanishes on the faces of normal n.
Moduli without_traction(const Moduli& c, const Vec3& n) {
  Eigen::Matrix<double, 6, 3> added = product_with(n).transpose();  // the strain sym(a n)
  added.bottomRows<3>() *= 2;
  const Eigen::Matrix<double, 6, 3> stress = c * added;
  return c - stress * (added.transpose() * stress).inverse() * stress.transpose();
}
}  // namespace

ElementMatrix element_stiffness(const HexMesh& mesh, int cell, double shear, double bulk) {
  const double young = 9 * bulk * shear / (3 * bulk + shear);
  const CellDirections directions = cell_directions(mesh, cell);
  Moduli c = Moduli::Zero();
  c.topLeftCorner<3, 3>().setConstant(bulk - 2.0 / 3 * shear);
  c.topLeftCorner<3, 3>().diagonal().array() += 2 * shear;
  c.bottomRightCorner<3, 3>().diagonal().setConstant(shear);
  std::array<Strain, 8> b;
  const TrilinearMap map(mesh.nodes, mesh.hexes[static_cast<std::size_t>(cell)]);
  double volume = 0;
  Strain mean = Strain::Zero();
  for (std::size_t q = 0; q < 8; ++q) {
    const Mat3 j = map.jacobian(gauss_point(static_cast<int>(q)));
    const Mat3 to_space = j.inverse().transpose();
    const std::array<Vec3, 8> reference = shape_gradients(gauss_point(static_cast<int>(q)));
    b[q].setZero();
    for (int n = 0; n < 8; ++n) {
      const Vec3 g = to_space * reference[static_cast<std::size_t>(n)];
      for (int d = 0; d < 3; ++d) {
        b[q](d, 3 * n + d) = g[d];
        b[q](3 + d, 3 * n + (d + 1) % 3) = g[(d + 2) % 3];
        b[q](3 + d, 3 * n + (d + 2) % 3) = g[(d + 1) % 3];
      }
    }
    volume += j.determinant();
    mean += j.determinant() * b[q];
  }
  mean /= volume;
  const auto mode = [&](int function) {
    Strain sum = Strain::Zero();
    for (std::size_t q = 0; q < 8; ++q) {
      const bool minus =
          (__builtin_popcount(static_cast<unsigned>(function) & ~static_cast<unsigned>(q)) & 1) != 0;
      sum += (minus ? -0.125 : 0.125) * b[q];
    }
    return sum;
  };
  ElementMatrix k = volume * (mean.transpose() * c * mean);
  for (int d = 0; d < 3; ++d) {
    const Strain linear = mode(1 << d);
    k += volume * (linear.transpose() * without_traction(c, directions.normal.col(d)) * linear);
    const Vec3 t = directions.edge.col(d);
    const Row along = t.transpose() * product_with(t) * mode(7 - (1 << d));
    k += volume * young * (along.transpose() * along);
  }
  return k;
}

bool same_shape(const HexMesh& mesh, int a, int b) {
  for (int i = 1; i < 8; ++i) {
    const Vec3 da = mesh.nodes[mesh.hexes[a][i]] - mesh.nodes[mesh.hexes[a][0]],
               db = mesh.nodes[mesh.hexes[b][i]] - mesh.nodes[mesh.hexes[b][0]];
    if ((da - db).norm() > 1e-13 * da.norm()) return false;
  }
  return true;
}

}  // namespace talus::fem
