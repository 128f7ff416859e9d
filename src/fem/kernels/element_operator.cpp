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
  const auto differs = [&](int node, const Vec3& expected) {
    return (mesh.nodes[h[node]] - o - expected).norm() > tolerance + 4e-16 * mesh.nodes[h[node]].norm();
  };
  if (differs(2, a + b) || differs(5, a + c) || differs(6, a + b + c) || differs(7, b + c))
    return CellShape::general;
  const bool along_axes =
      !differs(1, Vec3(a.x(), 0, 0)) && !differs(3, Vec3(0, b.y(), 0)) && !differs(4, Vec3(0, 0, c.z()));
  return along_axes ? CellShape::brick : CellShape::affine;
}

std::vector<ElementOperator::Lane> ElementOperator::lanes_of(const HexMesh& mesh) {
  std::array<int, 3> count{};
  std::vector<Lane> lanes(mesh.hexes.size());
  for (std::size_t cell = 0; cell < lanes.size(); ++cell) {
    const int pack = static_cast<int>(shape_of(mesh, static_cast<int>(cell)));
    lanes[cell] = {pack, count[static_cast<std::size_t>(pack)]++};
  }
  return lanes;
}

ElementOperator::ElementOperator(const HexMesh& mesh, double shear, double bulk, bool viscosity,
                                 const std::vector<Lane>& lanes)
    : mesh_(&mesh), shear_(shear), bulk_(bulk), where_(mesh.hexes.size()) {
  const int w = kernels().width;
  std::array<std::vector<int>, 3> list;
  std::array<int, 3> last{-1, -1, -1};                       // group of the whole that was put in last
  for (std::size_t cell = 0; cell < lanes.size(); ++cell) {  // in a pack lanes rise with the cells
    const auto p = static_cast<std::size_t>(lanes[cell].pack);
    if (const int group = lanes[cell].lane / w; group != last[p])
      last[p] = group, list[p].resize((list[p].size() + static_cast<std::size_t>(w) - 1) /
                                          static_cast<std::size_t>(w) * static_cast<std::size_t>(w),
                                      -1);
    const std::size_t start = list[p].size() / static_cast<std::size_t>(w) * static_cast<std::size_t>(w),
                      lane = start + static_cast<std::size_t>(lanes[cell].lane % w);
    list[p].resize(lane, -1);
    list[p].push_back(static_cast<int>(cell));
    where_[cell] = {lanes[cell].pack, static_cast<int>(lane)};
  }
  for (std::size_t p = 0; p < 3; ++p) pack_[p] = make_pack(list[p], static_cast<CellShape>(p), viscosity);
}

ElementPack ElementOperator::make_pack(const std::vector<int>& cells, CellShape shape, bool viscosity) const {
  const bool brick = shape == CellShape::brick, general = shape == CellShape::general;
  const int w = kernels().width, points = general ? 8 : 1, own = brick ? 0 : 18, numbers = brick ? 4 : 10;
  ElementPack pack;
  pack.shape = shape;
  pack.groups = (static_cast<long>(cells.size()) + w - 1) / w;
  const long lanes = pack.groups * w;
  pack.cells.assign(lanes, -1);
  pack.nodes.resize(lanes * 8);
  pack.geometry.resize(lanes * (own + numbers * points));
  pack.scale.assign(lanes, 0.0);
  pack.energy.assign(lanes, 0.0);
  pack.bound.assign(lanes, 0.0);
  pack.own.assign(lanes, 1);
  if (viscosity) {
    pack.mean.assign(lanes * 24, 0.0);
    pack.volume.assign(lanes, 1.0);
    pack.length.assign(lanes, 0.0);
  }
  int some = -1;  // of the group
  for (long lane = 0; lane < lanes; ++lane) {
    const long g = lane / w, l = lane % w;
    for (long k = lane; l == 0 && k < std::min(lane + w, static_cast<long>(cells.size())); ++k)
      if (cells[k] >= 0) some = cells[k];
    const bool real = lane < static_cast<long>(cells.size()) && cells[lane] >= 0;
    const int cell = real ? cells[lane] : some;  // padding repeats a cell with scale 0
    if (real) pack.cells[lane] = cell, pack.scale[lane] = 1;
    for (int a = 0; a < 8; ++a) pack.nodes[(g * 8 + a) * w + l] = 4 * mesh_->hexes[cell][a];
    const CellDirections directions = cell_directions(*mesh_, cell);
    double* geometry = pack.geometry.data() + g * (own + numbers * points) * w + l;
    for (int i = 0; i < own / 2; ++i)
      geometry[i * w] = directions.normal(i % 3, i / 3),
                   geometry[(9 + i) * w] = directions.edge(i % 3, i / 3);
    for (int q = 0; q < points; ++q) {
      double values[10];
      point_geometry(*mesh_, cell, general ? gauss_point(q) : Vec3(Vec3::Zero()), values);
      if (brick) values[1] = values[4], values[2] = values[8], values[3] = values[9];
      for (int i = 0; i < numbers; ++i) geometry[(own + q * numbers + i) * w] = values[i];
    }
    if (viscosity) {
      const TrilinearMap map(mesh_->nodes, mesh_->hexes[cell]);
      double volume = 0;
      std::array<Vec3, 8> mean;
      mean.fill(Vec3::Zero());
      for (int q = 0; q < 8; ++q) {
        const Mat3 j = map.jacobian(gauss_point(q));
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
KernelArguments arguments(const ElementPack& pack, double shear, double bulk, bool finite, const double* u,
                          double* f) {
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

void ElementOperator::add_internal_force(const double* u, double* f, bool finite, bool measures,
                                         const ElasticLimits* limits) {
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

void ElementOperator::add_internal_force_of(const std::vector<int>& cells, const double* u, double* f,
                                            bool finite, double factor) const {
  if (cells.empty()) return;
  ElementPack pack = pack_of(cells);
  for (double& s : pack.scale) s *= factor;
  add_internal_force_of(pack, u, f, finite);
}

void ElementOperator::add_internal_force_of(const ElementPack& pack, const double* u, double* f,
                                            bool finite) const {
  kernels().internal_force(arguments(pack, shear_, bulk_, finite, u, f));
}

void ElementOperator::add_bulk_viscosity(const double* u, const double* v, double* f, double density,
                                         double wave_speed) {
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

void ElementOperator::restrict_to(const std::vector<char>& local) {
  const long w = kernels().width;
  for (std::size_t p = 0; p < pack_.size(); ++p) {
    ElementPack& old = pack_[p];
    std::vector<int> list;
    for (long group = 0; group < old.groups; ++group) {
      const auto first = old.cells.begin() + group * w;
      if (std::none_of(first, first + w, [&](int cell) { return cell >= 0 && local[cell]; })) continue;
      for (auto cell = first; cell != first + w; ++cell)
        list.push_back(*cell >= 0 && local[*cell] ? *cell : -1);
    }
    const bool viscosity = !old.mean.empty();
    std::vector<char> on(old.cells.size());
    for (std::size_t lane = 0; lane < on.size(); ++lane) on[lane] = old.scale[lane] != 0;
    std::vector<Lane> was(list.size());
    for (std::size_t lane = 0; lane < list.size(); ++lane)
      if (list[lane] >= 0) was[lane] = where_[list[lane]];
    for (const int cell : old.cells)
      if (cell >= 0) where_[cell] = {};
    old = ElementPack{};
    pack_[p] = make_pack(list, static_cast<CellShape>(p), viscosity);
    for (std::size_t lane = 0; lane < list.size(); ++lane)
      if (list[lane] >= 0) {
        where_[list[lane]] = {static_cast<int>(p), static_cast<int>(lane)};
        if (!on[was[lane].lane]) set_on(list[lane], false);
      }
  }
}

void ElementOperator::count_only(const std::vector<char>& own) {
  for (ElementPack& pack : pack_)
    for (std::size_t lane = 0; lane < pack.cells.size(); ++lane)
      pack.own[lane] = pack.cells[lane] >= 0 && own[pack.cells[lane]];
}

std::size_t ElementPack::memory_consumption() const {
  const std::size_t numbers = geometry.capacity() + scale.capacity() + energy.capacity() + bound.capacity() +
                              mean.capacity() + volume.capacity() + length.capacity();
  return numbers * sizeof(double) + (cells.capacity() + nodes.capacity()) * sizeof(int) + own.capacity();
}

std::size_t ElementOperator::memory_consumption() const {
  std::size_t bytes = where_.capacity() * sizeof(Lane);
  for (const ElementPack& pack : pack_) bytes += pack.memory_consumption();
  return bytes;
}

void ElementOperator::find_busy(ElementPack& pack) const {
  if (!pack.stale) return;
  pack.stale = false;
  pack.busy.clear();
  const long w = kernels().width;
  for (long group = 0; group < pack.groups; ++group) {
    const auto scale = pack.scale.begin() + group * w;
    if (std::all_of(scale, scale + w, [](double s) { return s == 0; })) continue;
    if (pack.busy.empty() || pack.busy.back().second < group)
      pack.busy.emplace_back(group, group + 1);
    else
      pack.busy.back().second = group + 1;
  }
}

void ElementOperator::mark_nodes(std::vector<char>& touched) const {
  for (const ElementPack& pack : pack_)
    for (const int n : pack.nodes) touched[static_cast<std::size_t>(n) / 4] = 1;
}

void ElementOperator::set_on(int cell, bool on) {
  const Lane at = where_[cell];
  if (at.pack < 0) return;
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
      if (pack.bound[lane] > limit && pack.cells[lane] >= 0) cells.push_back(pack.cells[lane]);
  std::sort(cells.begin(), cells.end());
}

}  // namespace talus::fem
