// Size limits of terrain and rock masses: what a contact query costs on terrains of 1e3, 1e5 and 1e6
// triangles with the same local roughness, how long a terrain of a million triangles takes to load, and the
// cutting of 10,000 blocks. Prints CPU time and peak memory.
#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <numbers>

#include "contact/detection/detect.hpp"
#include "geometry/cut.hpp"
#include "geometry/mesh.hpp"
#include "geometry/random.hpp"
#include "geometry/shape.hpp"
#include "geometry/terrain.hpp"

using namespace talus;

namespace {

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double peak_gib() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return static_cast<double>(use.ru_maxrss) / (1024.0 * 1024.0);
}

/// Square of n x n cells of one metre; rough by 0.2 m where asked.
geometry::Mesh ground(int n, double roughness) {
  geometry::Mesh m;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      m.vertices.emplace_back(j, i,
                              2 * std::sin(0.05 * i) * std::cos(0.04 * j) +
                                  roughness * geometry::Random(static_cast<std::uint64_t>(i) * 100003u +
                                                               static_cast<std::uint64_t>(j))
                                                  .uniform());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int k = i * (n + 1) + j;
      m.triangles.push_back({k, k + 1, k + n + 2});
      m.triangles.push_back({k, k + n + 2, k + n + 1});
    }
  return m;
}

/// Mean CPU time of a query at 2000 places where the block touches the ground [s], the least of twenty
/// batches. The places lie in the corner of 12 m that all terrains share (same ground, same contacts: what a
/// block meets from step to step), or anywhere (each query finds a cold cache).
double query_seconds(const contact::SurfaceIndex& index, const Polyhedron& block, double width,
                     long& contacts) {
  geometry::Random random(2);
  std::vector<Pose> poses;
  for (int k = 0; k < 2000; ++k) {
    Pose p;
    const double x = random.uniform(5, width - 5), y = random.uniform(5, width - 5), a = random.uniform(0, 3);
    p.c = Vec3(x, y, index.height(x, y) + 0.7 * block.radius);
    p.F = Eigen::AngleAxisd(a, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    poses.push_back(p);
  }
  std::vector<contact::ContactPoint> out;
  double best = 1e9;
  for (int batch = 0; batch < 20; ++batch) {
    const double start = cpu_seconds();
    contacts = 0;
    for (const Pose& p : poses) {
      out.clear();
      contacts += contact::surface_block(index, block, p, 0.05, out);
    }
    best = std::min(best, (cpu_seconds() - start) / static_cast<double>(poses.size()));
  }
  return best;
}

geometry::CutJointSet joints(const char* name, double dip_direction, double dip, double spacing) {
  const double degree = std::numbers::pi / 180;
  geometry::CutJointSet s;
  s.name = name, s.dip_direction = dip_direction * degree, s.dip = dip * degree, s.spacing = spacing;
  return s;
}

}  // namespace

int main() {
  geometry::ShapeSpec spec;
  spec.kind = "EOTA221";
  spec.volume = 1;
  const Polyhedron block = geometry::make_shape_with_shift(spec).body;
  for (const double roughness : {0.0, 0.2}) {
    double first = 0, first_anywhere = 0;
    for (const int n : {22, 224, 708}) {
      const geometry::Mesh mesh = ground(n, roughness);
      const double start = cpu_seconds();
      const geometry::Terrain terrain = geometry::make_terrain(mesh.vertices, mesh.triangles, {}, "ground");
      const contact::SurfaceIndex index(terrain.surface);
      const double built = cpu_seconds() - start;
      long contacts = 0, contacts_anywhere = 0;
      const double t = query_seconds(index, block, 22, contacts),
                   anywhere = query_seconds(index, block, n, contacts_anywhere);
      if (first == 0) first = t, first_anywhere = anywhere;
      fmt::print(
          "terrain of {} triangles, rough by {} m: built in {:.2f} s; query in one place {:.2f} us ({:.2f} "
          "of the smallest terrain's), {:.1f} contacts; anywhere {:.2f} us ({:.2f}), {:.1f} contacts\n",
          mesh.triangles.size(), roughness, built, 1e6 * t, t / first, static_cast<double>(contacts) / 2000,
          1e6 * anywhere, anywhere / first_anywhere, static_cast<double>(contacts_anywhere) / 2000);
    }
  }
  {
    const std::string file = (std::filesystem::temp_directory_path() / "talus_bench_million.stl").string();
    geometry::write_mesh(file, ground(708, 0.2));
    const double start = cpu_seconds();
    const geometry::Terrain terrain = geometry::load_terrain(file);
    const double loaded = cpu_seconds() - start;
    const contact::SurfaceIndex index(terrain.surface);
    fmt::print(
        "{} triangles from STL: read in {:.2f} s, with search structure {:.2f} s; peak memory {:.2f} GiB\n",
        terrain.surface.triangles.size(), loaded, cpu_seconds() - start, peak_gib());
    std::filesystem::remove(file);
  }
  geometry::CutSpec cut;
  cut.box = Box3(Vec3::Zero(), Vec3::Constant(44));
  cut.joint_sets = {joints("a", 100, 80, 2.05), joints("b", 10, 75, 2.05), joints("c", 190, 12, 2.05)};
  const double start = cpu_seconds();
  const geometry::CutResult r = geometry::cut(cut);
  double sum = 0;
  for (const auto& b : r.blocks) sum += b.volume;
  fmt::print("{} blocks cut in {:.2f} s, volume kept to {:.1e}; peak memory {:.2f} GiB\n", r.blocks.size(),
             cpu_seconds() - start, std::abs(sum / r.region_volume - 1), peak_gib());
}
