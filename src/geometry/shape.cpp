#include "geometry/shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "core/reject.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/mesh.hpp"
#include "geometry/random.hpp"

namespace talus::geometry {
namespace {

using std::numbers::pi;

std::string text(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

/// Scales points about the middle of their box to the full extents `size`.
void fit(std::vector<Vec3>& points, const Vec3& size) {
  Box3 box;
  for (const Vec3& p : points) box.extend(p);
  const Vec3 scale = size.cwiseQuotient(box.sizes()), middle = box.center();
  for (Vec3& p : points) p = (p - middle).cwiseProduct(scale);
}

std::vector<Vec3> signs(const Vec3& v) {
  std::vector<Vec3> out;
  for (int i = 0; i < 8; ++i)
    out.emplace_back(i & 1 ? v.x() : -v.x(), i & 2 ? v.y() : -v.y(), i & 4 ? v.z() : -v.z());
  return out;
}

std::vector<Vec3> eota(const Vec3& s) {
  std::vector<Vec3> out;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 v = s / 4;
    v[axis] = s[axis] / 2;
    for (const Vec3& p : signs(v)) out.push_back(p);
  }
  return out;
}

/// (0, +-1, +-g) and its even permutations: the icosahedron; dual: the dodecahedron.
std::vector<Vec3> golden(double a, double b) {
  std::vector<Vec3> out;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 4; ++i) {
      Vec3 v = Vec3::Zero();
      v[(axis + 1) % 3] = i & 1 ? a : -a;
      v[(axis + 2) % 3] = i & 2 ? b : -b;
      out.push_back(v);
    }
  return out;
}

std::vector<Vec3> sphere(int longitudes, int latitudes) {
  std::vector<Vec3> out{{0, 0, 1}, {0, 0, -1}};
  for (int i = 1; i <= latitudes; ++i)
    for (int j = 0; j < longitudes; ++j) {
      const double a = pi * i / (latitudes + 1), b = 2 * pi * j / longitudes;
      out.emplace_back(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
  return out;
}

/// Sphere of 320 triangles, its points moved along their radius: star-shaped about the origin, so never
/// crossing itself.
Mesh dented_rock(unsigned seed) {
  Mesh mesh = convex_hull(golden(1, std::numbers::phi));
  for (Vec3& v : mesh.vertices) v.normalize();
  for (int level = 0; level < 2; ++level) {
    Mesh fine;
    fine.vertices = mesh.vertices;
    std::vector<std::array<int, 3>> known;  // edge a, b -> middle
    const auto middle = [&](int a, int b) {
      if (a > b) std::swap(a, b);
      for (const auto& k : known)
        if (k[0] == a && k[1] == b) return k[2];
      fine.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      known.push_back({a, b, static_cast<int>(fine.vertices.size()) - 1});
      return known.back()[2];
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      fine.triangles.push_back({a, ab, ca});
      fine.triangles.push_back({b, bc, ab});
      fine.triangles.push_back({c, ca, bc});
      fine.triangles.push_back({ab, bc, ca});
    }
    mesh = std::move(fine);
  }
  Random random(seed);
  struct Feature {
    Vec3 direction;
    double depth, width;
  };
  std::vector<Feature> features;
  for (int i = 0; i < 14; ++i)
    features.push_back({random.direction(), random.uniform(-0.12, 0.12), random.uniform(0.3, 0.7)});
  for (int i = 0; i < 3; ++i)
    features.push_back({random.direction(), random.uniform(-0.40, -0.25), random.uniform(0.35, 0.6)});
  for (Vec3& v : mesh.vertices) {
    double r = 1;
    for (const Feature& f : features)
      r += f.depth * std::exp(-(v - f.direction).squaredNorm() / (f.width * f.width));
    v *= std::max(r, 0.35);
  }
  return mesh;
}

/// The extents asked for: `size`, or proportions alone (to be scaled by volume or mass).
Vec3 extents(const ShapeSpec& s, const Vec3& proportions) {
  if (s.size.isZero()) {
    if (s.volume > 0 || s.mass > 0) return proportions;
    reject("size", "", fmt::format("a {} needs its size", s.kind),
           "give size = [x, y, z], or volume, or mass");
  }
  if (!(s.size.minCoeff() > 0) || !s.size.allFinite())
    reject("size", text(s.size), "extents must be positive", "give size = [x, y, z] in metres");
  return s.size;
}

}  // namespace

const std::vector<std::string>& shape_kinds() {
  static const std::vector<std::string> kinds = {"box",    "tetrahedron",   "dodecahedron",  "icosahedron",
                                                 "sphere", "EOTA111",       "EOTA221",       "convex",
                                                 "file",   "random-convex", "random-concave"};
  return kinds;
}

Shape make_shape_with_shift(const ShapeSpec& s) {
  Mesh mesh;
  const auto hull = [&](std::vector<Vec3> points, const Vec3& size) {
    fit(points, size);
    mesh = convex_hull(points);
  };
  const Vec3 one = Vec3::Ones();
  if (s.size.minCoeff() > 0 && s.size.minCoeff() < 1e-6 * s.size.maxCoeff())
    reject("size", text(s.size), "one extent is less than a millionth of another",
           "give a body: contact needs its thickness");
  if (s.kind == "box") {
    mesh = convex_hull(signs(extents(s, one) / 2));
  } else if (s.kind == "tetrahedron") {
    hull({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, extents(s, one));
  } else if (s.kind == "dodecahedron") {
    auto points = golden(1 / std::numbers::phi, std::numbers::phi);
    for (const Vec3& p : signs(one)) points.push_back(p);
    hull(points, extents(s, one));
  } else if (s.kind == "icosahedron") {
    hull(golden(1, std::numbers::phi), extents(s, one));
  } else if (s.kind == "sphere") {
    const int m = s.longitudes ? s.longitudes : 12, n = s.latitudes ? s.latitudes : 5;
    if (m < 3 || m > 100)
      reject("longitudes", std::to_string(m), "must be 3 to 100", "give the number of meridians");
    if (n < 1 || n > 100)
      reject("latitudes", std::to_string(n), "must be 1 to 100",
             "give the number of circles between the poles");
    if (s.diameter < 0)
      reject("diameter", fmt::format("{}", s.diameter), "must be positive", "give it in metres");
    auto points = sphere(m, n);
    if (s.diameter > 0) {  // its corners lie on the sphere
      for (Vec3& p : points) p *= s.diameter / 2;
      mesh = convex_hull(points);
    } else {
      hull(points, extents(s, one));
    }
  } else if (s.kind == "EOTA111") {
    mesh = convex_hull(eota(extents(s, one)));
  } else if (s.kind == "EOTA221") {
    mesh = convex_hull(eota(extents(s, Vec3(2, 2, 1))));
  } else if (s.kind == "convex") {
    mesh = convex_hull(s.vertices);
  } else if (s.kind == "file") {
    if (s.file.empty()) reject("file", "", "a mesh file is needed", "give file = \"rock.obj\"");
    mesh = read_closed_mesh(s.file);
    if (const int pieces = body_count(mesh); pieces > 1)
      throw InputError(Problem{
          .file = s.file,
          .key = "mesh",
          .value = fmt::format("{} pieces", pieces),
          .rule = "holds pieces that do not hang together",
          .remedy = "give each as a block of its own; rock_mass.blocks takes a file with a group for each"});
  } else if (s.kind == "random-convex" || s.kind == "random-concave") {
    if (!(s.aspect.minCoeff() > 0))
      reject("aspect", text(s.aspect), "proportions must be positive", "give aspect = [a, b, c]");
    const Vec3 size = extents(s, s.aspect);
    if (s.kind == "random-convex") {
      Random random(s.seed);
      std::vector<Vec3> points;
      for (int i = 0; i < 24; ++i) points.push_back(random.direction() * random.uniform(0.85, 1.0));
      hull(convex_hull(points).vertices, size);
    } else {
      mesh = dented_rock(s.seed);
      fit(mesh.vertices, size);
    }
  } else {
    std::string all;
    for (const std::string& k : shape_kinds()) all += (all.empty() ? "" : ", ") + k;
    reject("shape", s.kind, "is not a known shape", "use one of " + all);
  }

  MassProperties p = mass_properties(mesh.vertices, mesh.triangles, 1.0);
  double wanted = 0;
  if (s.volume != 0) {
    if (!(s.volume > 0)) reject("volume", fmt::format("{}", s.volume), "must be positive", "give it in m^3");
    wanted = s.volume;
  }
  if (s.mass != 0) {
    if (!(s.mass > 0)) reject("mass", fmt::format("{}", s.mass), "must be positive", "give it in kg");
    if (!(s.density > 0))
      reject("density", fmt::format("{}", s.density), "must be positive where a mass is given",
             "give the material's density");
    if (wanted > 0 && std::abs(s.mass / s.density - wanted) > 1e-9 * wanted)
      reject("mass", fmt::format("{}", s.mass),
             fmt::format("disagrees with volume times density, {} kg", wanted * s.density),
             "give volume or mass, not both");
    wanted = s.mass / s.density;
  }
  const double scale = wanted > 0 ? std::cbrt(wanted / p.volume) : 1.0;
  for (Vec3& v : mesh.vertices) v = (v - p.centroid) * scale;
  // Taking the centroid off rounds; take off what is left, so that the body is centred to the last digits.
  const Vec3 rest = mass_properties(mesh.vertices, mesh.triangles, 1.0).centroid;
  for (Vec3& v : mesh.vertices) v -= rest;
  Shape shape;
  shape.shift = p.centroid + rest / scale;
  shape.body = make_polyhedron(mesh.vertices, mesh.triangles);
  shape.volume = volume(shape.body);
  return shape;
}

}  // namespace talus::geometry
