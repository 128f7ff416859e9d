#include "fem/kernels/element_operator.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "fem/kernels/assumed_strain.hpp"

namespace talus::fem {

void point_geometry(const HexMesh& mesh, int cell, const Vec3& xi, double out[10]) {
  const Mat3 j = jacobian(mesh, cell, xi);
  const Mat3 inverse = j.inverse();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[3 * r + c] = inverse(r, c);
  out[9] = j.determinant();
}

CellShape shape_of(const HexMesh& mesh, int cell) {
  const auto& h = mesh.hexes[cell];
  const Vec3& o = mesh.nodes[h[0]];
  const Vec3 a = mesh.nodes[h[1]] - o, b = mesh.nodes[h[3]] - o, c = mesh.nodes[h[4]] - o;
  const double tolerance = 1e-13 * (a.norm() + b.norm() + c.norm());
  const auto differs = [&](int node, const Vec3& expected) { return (mesh.nodes[h[node]] - o - expected).norm() > tolerance + 4e-16 * mesh.nodes[h[node]].norm(); };
  if (differs(2, a + b) || differs(5, a + c) || differs(6, a + b + c) || differs(7, b + c)) return CellShape::general;
  const bool along_axes = !differs(1, Vec3(a.x(), 0, 0)) && !differs(3, Vec3(0, b.y(), 0)) && !differs(4, Vec3(0, 0, c.z()));
  return along_axes ? CellShape::brick : CellShape::affine;
}

ElementOperator::ElementOperator(const HexMesh& mesh, double shear, double bulk, bool viscosity)
    : mesh_(&mesh), shear_(shear), bulk_(bulk), where_(mesh.hexes.size()) {
  std::array<std::vector<int>, 3> list;
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) list[static_cast<std::size_t>(shape_of(mesh, cell))].push_back(cell);
  for (int p = 0; p < 3; ++p) {
    pack_[p] = make_pack(list[p], static_cast<CellShape>(p), viscosity);
    for (int lane = 0; lane < static_cast<int>(list[p].size()); ++lane) where_[list[p][lane]] = {p, lane};
  }
}

ElementPack ElementOperator::make_pack(const std::vector<int>& cells, CellShape shape, bool viscosity) const {
  const bool brick = shape == CellShape::brick, general = shape == CellShape::general;
  const int w = kernels().width, points = general ? 8 : 1, own = brick ? 0 : 18, numbers = brick ? 4 : 10;
  ElementPack pack;
  pack.shape = shape;
  pack.groups = (static_cast<long>(cells.size()) + w - 1) / w;
  const long lanes = pack.groups * w;
  pack.runs.assign(pack.groups > 0 ? 1 : 0, {0, pack.groups});
  pack.cells.assign(lanes, -1);
  pack.nodes.resize(lanes * 8);
  pack.geometry.resize(lanes * (own + numbers * points));
  pack.scale.assign(lanes, 0.0);
  pack.energy.assign(lanes, 0.0);
  pack.bound.assign(lanes, 0.0);
  pack.local.assign(lanes, 1);
  pack.own.assign(lanes, 1);
  if (viscosity) {
    pack.mean.assign(lanes * 24, 0.0);
    pack.volume.assign(lanes, 1.0);
    pack.length.assign(lanes, 0.0);
  }
  for (long lane = 0; lane < lanes; ++lane) {
    const bool real = lane < static_cast<long>(cells.size());
    const int cell = real ? cells[lane] : cells.back();  // padding repeats a cell with scale 0
    const long g = lane / w, l = lane % w;
    if (real) pack.cells[lane] = cell, pack.scale[lane] = 1;
    for (int a = 0; a < 8; ++a) pack.nodes[(g * 8 + a) * w + l] = 4 * mesh_->hexes[cell][a];
    const CellDirections directions = cell_directions(*mesh_, cell);
    double* geometry = pack.geometry.data() + g * (own + numbers * points) * w + l;
    for (int i = 0; i < own / 2; ++i) geometry[i * w] = directions.normal(i % 3, i / 3), geometry[(9 + i) * w] = directions.edge(i % 3, i / 3);
    for (int q = 0; q < points; ++q) {
      double values[10];
      point_geometry(*mesh_, cell, general ? gauss_point(q) : Vec3(Vec3::Zero()), values);
      if (brick) values[1] = values[4], values[2] = values[8], values[3] = values[9];
      for (int i = 0; i < numbers; ++i) geometry[(own + q * numbers + i) * w] = values[i];
    }
    if (viscosity) {
      double volume = 0;
      std::array<Vec3, 8> mean;
      mean.fill(Vec3::Zero());
      for (int q = 0; q < 8; ++q) {
        const Mat3 j = point_jacobian(*mesh_, cell, q);
        const Mat3 inverse_t = j.inverse().transpose();
        const double weight = j.determinant();
        volume += weight;
        const std::array<Vec3, 8> grad = shape_gradients(gauss_point(q));
        for (int a = 0; a < 8; ++a) mean[a] += weight * (inverse_t * grad[a]);
      }
      for (int a = 0; a < 8; ++a)
        for (int c = 0; c < 3; ++c) pack.mean[(g * 24 + 3 * a + c) * w + l] = mean[a][c];
      pack.volume[lane] = volume;
      pack.length[lane] = std::cbrt(volume);
    }
  }
  return pack;
}

namespace {
KernelArguments arguments(const ElementPack& pack, double shear, double bulk, bool finite, const double* u, double* f) {
  KernelArguments k;
  k.nodes = pack.nodes.data();
  k.geometry = pack.geometry.data();
  k.scale = pack.scale.data();
  k.u = u;
  k.f = f;
  k.last = pack.groups;
  k.shear = shear;
  k.bulk = bulk;
  k.shape = pack.shape;
  k.finite = finite;
  return k;
}
}  // namespace

void ElementOperator::add_internal_force(const double* u, double* f, bool finite, bool measures, const ElasticLimits* limits) {
  for (ElementPack& pack : pack_) {
    if (pack.groups == 0) continue;
    KernelArguments k = arguments(pack, shear_, bulk_, finite, u, f);
    if (measures) k.energy = pack.energy.data(), k.bound = pack.bound.data(), k.limits = limits;
    find_busy(pack);
    for (const auto& run : pack.busy) {
      std::tie(k.first, k.last) = run;
      kernels().internal_force(k);
    }
  }
}

void ElementOperator::add_internal_force_of(const std::vector<int>& cells, const double* u, double* f, bool finite, double factor) const {
  if (cells.empty()) return;
  ElementPack pack = pack_of(cells);
  for (double& s : pack.scale) s *= factor;
  add_internal_force_of(pack, u, f, finite);
}

void ElementOperator::add_internal_force_of(const ElementPack& pack, const double* u, double* f, bool finite) const {
  kernels().internal_force(arguments(pack, shear_, bulk_, finite, u, f));
}

void ElementOperator::add_bulk_viscosity(const double* u, const double* v, double* f, double density, double wave_speed) {
  for (ElementPack& pack : pack_) {
    if (pack.groups == 0 || pack.mean.empty()) continue;
    ViscosityArguments k;
    k.nodes = pack.nodes.data();
    k.mean = pack.mean.data();
    k.volume = pack.volume.data();
    k.length = pack.length.data();
    k.scale = pack.scale.data();
    k.u = u;
    k.v = v;
    k.f = f;
    k.density = density;
    k.wave_speed = wave_speed;
    find_busy(pack);
    for (const auto& run : pack.busy) {
      std::tie(k.first, k.last) = run;
      kernels().bulk_viscosity(k);
    }
  }
}

void ElementOperator::restrict_to(const std::vector<char>& local, const std::vector<char>& own) {
  const long w = kernels().width;
  for (ElementPack& pack : pack_) {
    pack.runs.clear();
    pack.stale = true;
    for (long lane = 0; lane < static_cast<long>(pack.cells.size()); ++lane) {
      const int cell = pack.cells[lane];
      pack.local[lane] = cell >= 0 && local[cell];
      pack.own[lane] = cell >= 0 && own[cell];
      if (!pack.local[lane]) continue;
      const long group = lane / w;
      if (pack.runs.empty() || pack.runs.back().second < group) pack.runs.emplace_back(group, group + 1);
      else pack.runs.back().second = group + 1;
    }
  }
}

void ElementOperator::find_busy(ElementPack& pack) const {
  if (!pack.stale) return;
  pack.stale = false;
  pack.busy.clear();
  const long w = kernels().width;
  for (const auto& [first, last] : pack.runs)
    for (long group = first; group < last; ++group) {
      const auto scale = pack.scale.begin() + group * w;
      if (std::all_of(scale, scale + w, [](double s) { return s == 0; })) continue;
      if (pack.busy.empty() || pack.busy.back().second < group) pack.busy.emplace_back(group, group + 1);
      else pack.busy.back().second = group + 1;
    }
}

void ElementOperator::mark_nodes(std::vector<char>& touched) const {
  const long per_group = 8L * kernels().width;
  for (const ElementPack& pack : pack_)
    for (const auto& [first, last] : pack.runs)
      for (long i = first * per_group; i < last * per_group; ++i) touched[static_cast<std::size_t>(pack.nodes[i]) / 4] = 1;
}

void ElementOperator::set_on(int cell, bool on) {
  const Place at = where_[cell];
  double& scale = pack_[at.pack].scale[at.lane];
  pack_[at.pack].stale = pack_[at.pack].stale || (scale != 0) != on;
  scale = on ? 1 : 0;
  if (!on) pack_[at.pack].energy[at.lane] = pack_[at.pack].bound[at.lane] = 0;
}

double ElementOperator::total_energy() const {
  double sum = 0;
  for (const ElementPack& pack : pack_)
    for (std::size_t lane = 0; lane < pack.energy.size(); ++lane)
      if (pack.own[lane]) sum += pack.energy[lane];
  return sum;
}

void ElementOperator::cells_above(double limit, std::vector<int>& cells) const {
  cells.clear();
  for (const ElementPack& pack : pack_)
    for (long lane = 0; lane < static_cast<long>(pack.cells.size()); ++lane)
      if (pack.bound[lane] > limit && pack.local[lane]) cells.push_back(pack.cells[lane]);
  std::sort(cells.begin(), cells.end());
}

}  // namespace talus::fem
