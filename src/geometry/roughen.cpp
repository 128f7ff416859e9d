#include "geometry/roughen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "core/error.hpp"
#include "geometry/random.hpp"

namespace talus::geometry {
namespace {

constexpr double edges_a_length = 3;  // shortest waves of the field are about 2 l long: six edges each
constexpr double most_triangles = 2e7;
constexpr double mean_square = 181.0 / 231;  // of f^2 + (1 - f)^2 over a spacing, f the quintic

double at_lattice(std::uint32_t seed, std::int64_t i, std::int64_t j) {
  const auto mixed = (static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15ull) ^
                     (static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4full) ^
                     (static_cast<std::uint64_t>(seed) << 32);
  Random random(mixed);
  random.bits();
  return random.normal();
}

double quintic(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

std::uint64_t edge_key(int a, int b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) |
         static_cast<std::uint32_t>(std::max(a, b));
}

class Divider {
 public:
  Divider(TriangleSurface& s, const std::vector<const Roughness*>& of) : s_(s), of_(of) {
    if (s_.material.empty()) s_.material.assign(s_.triangles.size(), s_.default_material);
  }

  /// Divides until no edge of a rough face is longer than asked for.
  void run() {
    refuse_too_many(fewest());
    while (mark()) split();
  }

 private:
  /// A triangle without an edge longer than h has an area of sqrt(3)/4 h^2 at most.
  double fewest() const {
    double sum = 0;
    for (std::size_t t = 0; t < s_.triangles.size(); ++t) {
      const Roughness* rough = of_[static_cast<std::size_t>(s_.material[t])];
      if (rough == nullptr) continue;
      const auto& [a, b, c] = s_.triangles[t];
      const double longest = rough->length / edges_a_length;
      sum += 0.5 * (vertex(b) - vertex(a)).cross(vertex(c) - vertex(a)).norm() /
             (std::sqrt(3) / 4 * longest * longest);
    }
    return sum;
  }

  static void refuse_too_many(double triangles) {
    if (triangles <= most_triangles) return;
    throw InputError(Problem{
        .key = "material.roughness.length",
        .rule = fmt::format("the terrain would be divided into more than {:g} triangles", most_triangles),
        .remedy = "crop the terrain (site.crop), make the rough area smaller, or the length larger"});
  }

  bool mark() {
    middle_.clear();
    for (std::size_t t = 0; t < s_.triangles.size(); ++t) {
      const Roughness* rough = of_[static_cast<std::size_t>(s_.material[t])];
      if (rough == nullptr) continue;
      for (int k = 0; k < 3; ++k) {
        const int a = s_.triangles[t][static_cast<std::size_t>(k)],
                  b = s_.triangles[t][static_cast<std::size_t>((k + 1) % 3)];
        const double longest = rough->length / edges_a_length;
        if ((vertex(a) - vertex(b)).squaredNorm() > longest * longest * (1 + 1e-9))
          middle_.try_emplace(edge_key(a, b), -1);
      }
    }
    return !middle_.empty();
  }

  const Vec3& vertex(int v) const { return s_.vertices[static_cast<std::size_t>(v)]; }

  int middle(int a, int b) {
    const auto found = middle_.find(edge_key(a, b));
    if (found == middle_.end()) return -1;
    if (found->second < 0) {
      found->second = static_cast<int>(s_.vertices.size());
      s_.vertices.push_back(0.5 * (vertex(std::min(a, b)) + vertex(std::max(a, b))));
    }
    return found->second;
  }

  void split() {
    std::vector<std::array<int, 3>> triangles;
    std::vector<int> material;
    for (std::size_t t = 0; t < s_.triangles.size(); ++t) {
      std::array<int, 3> v = s_.triangles[t];
      std::array<int, 3> m{middle(v[0], v[1]), middle(v[1], v[2]), middle(v[2], v[0])};
      const auto put = [&](int a, int b, int c) {
        triangles.push_back({a, b, c}), material.push_back(s_.material[t]);
      };
      const auto marked = std::count_if(m.begin(), m.end(), [](int x) { return x >= 0; });
      if (marked == 0) {
        put(v[0], v[1], v[2]);
      } else if (marked == 3) {
        put(v[0], m[0], m[2]), put(m[0], v[1], m[1]), put(m[2], m[1], v[2]), put(m[0], m[1], m[2]);
      } else {
        // One marked edge, or two of which the first is followed by the other: turned so that the first is
        // edge 0.
        while (!(m[0] >= 0 && (marked == 1 || m[1] >= 0)))
          std::rotate(v.begin(), v.begin() + 1, v.end()), std::rotate(m.begin(), m.begin() + 1, m.end());
        if (marked == 1) {
          put(v[0], m[0], v[2]), put(m[0], v[1], v[2]);
        } else {
          put(m[0], v[1], m[1]);
          if ((vertex(v[0]) - vertex(m[1])).squaredNorm() <= (vertex(m[0]) - vertex(v[2])).squaredNorm())
            put(v[0], m[0], m[1]), put(v[0], m[1], v[2]);
          else
            put(v[0], m[0], v[2]), put(m[0], m[1], v[2]);
        }
      }
      refuse_too_many(static_cast<double>(triangles.size()));
    }
    s_.triangles = std::move(triangles);
    s_.material = std::move(material);
  }

  TriangleSurface& s_;
  const std::vector<const Roughness*>& of_;  // by material
  std::unordered_map<std::uint64_t, int> middle_;
};

}  // namespace

double rough_height(std::uint32_t seed, double x, double y) {
  const double i = std::floor(x), j = std::floor(y), u = quintic(x - i), v = quintic(y - j);
  const auto g = [&](int di, int dj) {
    return at_lattice(seed, static_cast<std::int64_t>(i) + di, static_cast<std::int64_t>(j) + dj);
  };
  return ((1 - u) * (1 - v) * g(0, 0) + u * (1 - v) * g(1, 0) + (1 - u) * v * g(0, 1) + u * v * g(1, 1)) /
         mean_square;
}

void roughen(TriangleSurface& s, std::span<const Roughness> materials, const Vec3& origin) {
  if (materials.empty()) return;
  int most = s.default_material;
  for (const int m : s.material) most = std::max(most, m);
  for (const Roughness& r : materials) most = std::max(most, r.material);
  std::vector<const Roughness*> of(static_cast<std::size_t>(most) + 1, nullptr);
  for (const Roughness& r : materials) of[static_cast<std::size_t>(r.material)] = &r;
  Divider(s, of).run();
  std::vector<double> lift(s.vertices.size(), 0.0);
  std::vector<int> faces(s.vertices.size(), 0);
  std::vector<char> smooth(s.vertices.size(), 0);
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const Roughness* rough = of[static_cast<std::size_t>(s.material[t])];
    for (const int v : s.triangles[t]) {
      const auto k = static_cast<std::size_t>(v);
      ++faces[k];
      if (rough == nullptr)
        smooth[k] = 1;
      else
        lift[k] +=
            rough->amplitude * rough_height(rough->seed, (s.vertices[k].x() + origin.x()) / rough->length,
                                            (s.vertices[k].y() + origin.y()) / rough->length);
    }
  }
  for (std::size_t k = 0; k < s.vertices.size(); ++k)
    if (faces[k] > 0 && smooth[k] == 0) s.vertices[k].z() += lift[k] / faces[k];
}

}  // namespace talus::geometry
