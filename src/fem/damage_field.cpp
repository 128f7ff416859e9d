#include "fem/damage_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.hpp"

namespace talus::fem {

LawGeometry law_geometry(const HexMesh& mesh, int cell) {
  LawGeometry g{};
  const auto& hex = mesh.hexes[cell];
  for (int q = 0; q < 8; ++q) {
    const Mat3 j = jacobian(mesh, cell, gauss_point(q));
    const Mat3 inverse_t = j.inverse().transpose();
    const std::array<Vec3, 8> reference = shape_gradients(gauss_point(q));
    for (int a = 0; a < 8; ++a) {
      const Vec3 grad = inverse_t * reference[a];
      for (int x = 0; x < 3; ++x) g.gradient[a][x][q] = grad[x];
    }
    g.weight[q] = j.determinant();
    g.volume += g.weight[q];
  }
  for (int a = 0; a < 8; ++a) g.node[a] = 4 * hex[a];
  const Mat3 centre = jacobian(mesh, cell, Vec3::Zero());
  for (int k = 0; k < 3; ++k)
    for (int x = 0; x < 3; ++x) g.frame.edge[k][x] = 2 * centre(x, k);
  return g;
}

DamageField::DamageField(const HexMesh& mesh, const material::ConcreteDamage::Parameters& p, bool finite)
    : mesh_(&mesh), law_(p), cap_(p.cap), finite_(finite), slot_(mesh.hexes.size(), -1) {}

LawResult DamageField::evaluate(const LawGeometry& g, const double* u, const double* v, const material::DamageCell& old,
                                material::DamageCell& next, double* f) const {
  typedef double Points[8];
  Points h[9] = {}, hr[9] = {};
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) {
      const double ua = u[g.node[a] + c];
      for (int x = 0; x < 3; ++x)
        for (int q = 0; q < 8; ++q) h[3 * c + x][q] += ua * g.gradient[a][x][q];
    }
  if (v)
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) {
        const double va = v[g.node[a] + c];
        for (int x = 0; x < 3; ++x)
          for (int q = 0; q < 8; ++q) hr[3 * c + x][q] += va * g.gradient[a][x][q];
      }
  // Order of the laws: xx yy zz yz zx xy, engineering shears.
  alignas(64) double strain[6][8], rate[6][8], stress[6][8], energy[8], dissipation[8];
  const auto symmetric = [&](const Points* d, const Points* with, double (*out)[8]) {
    for (int q = 0; q < 8; ++q) {
      out[0][q] = d[0][q], out[1][q] = d[4][q], out[2][q] = d[8][q];
      out[3][q] = d[5][q] + d[7][q], out[4][q] = d[2][q] + d[6][q], out[5][q] = d[1][q] + d[3][q];
    }
    if (!finite_) return;
    // H^T D, symmetrised: D = H/2 gives the Green-Lagrange term, D = H' its rate.
    const double factor = d == with ? 0.5 : 1.0;
    for (int i = 0; i < 3; ++i)
      for (int q = 0; q < 8; ++q) {
        const double x = with[3 * i][q], y = with[3 * i + 1][q], z = with[3 * i + 2][q];
        const double a = factor * d[3 * i][q], b = factor * d[3 * i + 1][q], c = factor * d[3 * i + 2][q];
        out[0][q] += x * a, out[1][q] += y * b, out[2][q] += z * c;
        out[3][q] += y * c + z * b, out[4][q] += x * c + z * a, out[5][q] += x * b + y * a;
      }
  };
  const auto mean_dilatation = [&](double (*e)[8]) {
    double theta = 0;
    for (int q = 0; q < 8; ++q) theta += g.weight[q] * (e[0][q] + e[1][q] + e[2][q]);
    theta /= g.volume;
    for (int q = 0; q < 8; ++q) {
      const double shift = (theta - (e[0][q] + e[1][q] + e[2][q])) * (1.0 / 3);
      e[0][q] += shift, e[1][q] += shift, e[2][q] += shift;
    }
  };
  symmetric(h, h, strain);
  mean_dilatation(strain);
  if (v) {
    symmetric(hr, h, rate);
    mean_dilatation(rate);
  }
  LawResult result;
  result.grew = law_.stress8(&strain[0][0], v ? &rate[0][0] : nullptr, g.frame, old, next, &stress[0][0], energy, dissipation);
  double pressure = 0;
  for (int q = 0; q < 8; ++q) {
    result.energy += g.weight[q] * energy[q];
    result.dissipation += g.weight[q] * dissipation[q];
    pressure += g.weight[q] * (stress[0][q] + stress[1][q] + stress[2][q]);
    // A bound on the largest principal strain: the Frobenius norm.
    const double norm_sq = strain[0][q] * strain[0][q] + strain[1][q] * strain[1][q] + strain[2][q] * strain[2][q] +
                           0.5 * (strain[3][q] * strain[3][q] + strain[4][q] * strain[4][q] + strain[5][q] * strain[5][q]);
    result.largest_strain = std::max(result.largest_strain, norm_sq);
  }
  result.largest_strain = std::sqrt(result.largest_strain);
  pressure /= 3 * g.volume;
  Points p[9];
  for (int q = 0; q < 8; ++q) {
    const double shift = pressure - (stress[0][q] + stress[1][q] + stress[2][q]) * (1.0 / 3);
    const double w = g.weight[q];
    const double s[9] = {w * (stress[0][q] + shift), w * stress[5][q], w * stress[4][q], w * stress[5][q], w * (stress[1][q] + shift),
                         w * stress[3][q], w * stress[4][q], w * stress[3][q], w * (stress[2][q] + shift)};
    for (int i = 0; i < 9; ++i) p[i][q] = s[i];
  }
  if (finite_) {
    Points s[9];
    std::memcpy(s, p, sizeof p);
    for (int c = 0; c < 3; ++c)
      for (int x = 0; x < 3; ++x)
        for (int q = 0; q < 8; ++q) p[3 * c + x][q] += h[3 * c][q] * s[x][q] + h[3 * c + 1][q] * s[3 + x][q] + h[3 * c + 2][q] * s[6 + x][q];
  }
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) {
      Points sum;
      for (int q = 0; q < 8; ++q)
        sum[q] = p[3 * c][q] * g.gradient[a][0][q] + p[3 * c + 1][q] * g.gradient[a][1][q] + p[3 * c + 2][q] * g.gradient[a][2][q];
      f[3 * a + c] = ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
    }
  return result;
}

bool DamageField::try_cell(int cell, const double* u, const double* v, double* f) {
  const LawGeometry g = law_geometry(*mesh_, cell);
  const material::DamageCell none{};
  material::DamageCell next{};
  double force[24];
  const LawResult result = evaluate(g, u, v, none, next, force);
  if (!result.grew) return false;
  slot_[cell] = static_cast<int>(cells_.size());
  cells_.push_back(cell);
  geometry_.push_back(g);
  old_.push_back(none);
  next_.push_back(next);
  result_.push_back(result);
  for (int a = 0; a < 8; ++a)
    for (int c = 0; c < 3; ++c) f[g.node[a] + c] += force[3 * a + c];
  return true;
}

void DamageField::add_forces(const double* u, const double* v, double* f) {
  double force[24];
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    result_[i] = evaluate(geometry_[i], u, v, old_[i], next_[i], force);
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) f[geometry_[i].node[a] + c] += force[3 * a + c];
  }
}

void DamageField::accept() { old_ = next_; }

std::vector<int> DamageField::spent(double limit, double open_limit, const std::vector<char>& kept) const {
  std::vector<int> list;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    bool all = result_[i].largest_strain > open_limit && (kept.empty() || !kept[cells_[i]]);
    for (int q = 0; q < 8 && all; ++q) all = all && std::max(next_[i].d_t[q], next_[i].d_c[q]) >= cap_ * (1 - 1e-12);
    if (all || result_[i].largest_strain > limit) list.push_back(cells_[i]);
  }
  return list;
}

void DamageField::remove(int cell) {
  const int at = slot_[cell], last = static_cast<int>(cells_.size()) - 1;
  if (at < 0) return;
  // Keep the order of joining: sums over the cells stay in one order.
  cells_.erase(cells_.begin() + at);
  geometry_.erase(geometry_.begin() + at);
  old_.erase(old_.begin() + at);
  next_.erase(next_.begin() + at);
  result_.erase(result_.begin() + at);
  slot_[cell] = -1;
  for (int i = at; i < last; ++i) slot_[cells_[i]] = i;
}

double DamageField::stored() const {
  double sum = 0;
  for (const LawResult& r : result_) sum += r.energy;
  return sum;
}
double DamageField::dissipation() const {
  double sum = 0;
  for (const LawResult& r : result_) sum += r.dissipation;
  return sum;
}
double DamageField::tension(int cell) const {
  if (slot_[cell] < 0) return 0;
  const auto& d = old_[slot_[cell]].d_t;
  return *std::max_element(d, d + 8);
}
double DamageField::tension_least(int cell) const {
  if (slot_[cell] < 0) return 0;
  const auto& d = old_[slot_[cell]].d_t;
  return *std::min_element(d, d + 8);
}
double DamageField::compression(int cell) const {
  if (slot_[cell] < 0) return 0;
  const auto& d = old_[slot_[cell]].d_c;
  return *std::max_element(d, d + 8);
}
double DamageField::largest() const {
  double most = 0;
  for (int cell : cells_) most = std::max({most, tension(cell), compression(cell)});
  return most;
}

void DamageField::save(std::vector<double>& state) const {
  state.push_back(static_cast<double>(cells_.size()));
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    state.push_back(cells_[i]);
    const double* d = reinterpret_cast<const double*>(&old_[i]);
    state.insert(state.end(), d, d + 64);
  }
}

std::size_t DamageField::restore(std::span<const double> state) {
  std::fill(slot_.begin(), slot_.end(), -1);
  cells_.clear(), geometry_.clear(), old_.clear(), next_.clear(), result_.clear();
  const std::size_t count = state.empty() ? 0 : static_cast<std::size_t>(state[0]);
  if (state.size() < 1 + 65 * count) throw NumericalFailure("the saved damage belongs to another structure");
  for (std::size_t i = 0; i < count; ++i) {
    const double* from = &state[1 + 65 * i];
    const int cell = static_cast<int>(from[0]);
    material::DamageCell d;
    std::memcpy(&d, from + 1, sizeof d);
    slot_[cell] = static_cast<int>(i);
    cells_.push_back(cell);
    geometry_.push_back(law_geometry(*mesh_, cell));
    old_.push_back(d);
    next_.push_back(d);
    result_.emplace_back();
  }
  return 1 + 65 * count;
}

}  // namespace talus::fem
