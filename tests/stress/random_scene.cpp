#include "stress/random_scene.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "geometry/random.hpp"
#include "verify/scene_text.hpp"

namespace talus::stress {
namespace {

using geometry::Random;
using verify::number;

int below(Random& r, int n) { return static_cast<int>(r.uniform() * n); }
double log_uniform(Random& r, double a, double b) { return a * std::pow(b / a, r.uniform()); }

struct Shape {
  std::string keys;
  double radius, least;  // of the ball around it, its least extent [m]
};

Shape shape(Random& r) {
  const double size = r.uniform(0.2, 1.0);
  const auto of_volume = [&](const std::string& name, double roundness) {
    return Shape{fmt::format("shape = \"{}\"\nvolume = {}\nseed = {}\n", name, number(size * size * size),
                             1 + below(r, 1000)),
                 roundness * size, 0.3 * size};
  };
  const auto box = [](const Vec3& e) {
    return Shape{"shape = \"box\"\nsize = " + verify::vector(e) + "\n", 0.5 * e.norm(), e.minCoeff()};
  };
  switch (below(r, 9)) {
    case 0: return box(Vec3(size, size, size));
    case 1: return box(size * Vec3(r.uniform(0.3, 1.5), r.uniform(0.3, 1.5), r.uniform(0.3, 1.5)));
    case 2: return box(size * Vec3(r.uniform(1, 2), r.uniform(1, 2), 0.02));
    case 3: return box(size * Vec3(2, r.uniform(0.05, 0.2), r.uniform(0.05, 0.2)));
    case 4: return of_volume("tetrahedron", 1.6);
    case 5: return of_volume("dodecahedron", 0.9);
    case 6: return of_volume("random-convex", 2.2);
    case 7: return of_volume("random-concave", 3);
    default: {
      std::string points;
      for (int i = 0; i < 4; ++i) {
        const Vec3 x = size * Vec3(r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(-1, 1)) +
                       0.4 * size * Vec3(i == 1, i == 2, i == 3);
        points += (i > 0 ? ", " : "") + verify::vector(x);
      }
      return {"shape = \"convex\"\nvertices = [" + points + "]\n", 4 * size, 0.1 * size};
    }
  }
}

/// Ground material is "ground"; returns its description.
std::string ground(Random& r, std::string& text) {
  const auto plane = [&](const Vec3& normal, const Vec3& point) {
    text += fmt::format("[[plane]]\npoint = {}\nnormal = {}\nmaterial = \"ground\"\n", verify::vector(point),
                        verify::vector(normal));
  };
  const auto step = [&](int i, const Vec3& size, const Vec3& at, double turn) {
    text += fmt::format(
        "[[block]]\nname = \"S{}\"\nmaterial = \"ground\"\nshape = \"box\"\nsize = {}\nposition = "
        "{}\norientation = {{ rotation_vector = [0.0, {}, 0.0] }}\nfixed = true\n",
        i, verify::vector(size), verify::vector(at), number(turn));
  };
  switch (below(r, 6)) {
    case 0: plane(Vec3::UnitZ(), Vec3::Zero()); return "level";
    case 1: plane(Vec3(r.uniform(-0.9, 0.9), r.uniform(-0.3, 0.3), 1), Vec3::Zero()); return "slope";
    case 2:
      plane(Vec3(1, 0, r.uniform(0.8, 2)), Vec3::Zero());
      plane(Vec3(-1, 0.1, r.uniform(0.8, 2)), Vec3::Zero());
      return "valley";
    case 3:
      plane(Vec3::UnitZ(), Vec3::Zero());
      plane(Vec3::UnitX(), Vec3(-0.8, 0, 0));
      plane(-Vec3::UnitY(), Vec3(0, 0.8, 0));
      return "corner";
    case 4:
      for (int i = 0; i < 5; ++i)
        step(i, Vec3(1, 8, 1), Vec3(i - 1.0, 0, -0.5 - 0.3 * i), i % 2 == 0 ? 0.0 : 0.1);
      plane(Vec3::UnitZ(), Vec3(0, 0, -3));
      return "stairs";
    default:
      text += fmt::format(
          "[site]\nmaterial = \"ground\"\ncrest = [-4.0, 0.0, 1.0]\ndip_direction = \"90 deg\"\nwidth = "
          "40.0\n");
      for (double length : {4.0, 2.0, 3.0, 30.0})
        text += fmt::format("[[site.face]]\ndip = \"{} deg\"\nlength = {}\n",
                            number(length > 10 ? 2.0 : r.uniform(-10, 60)), number(length));
      return "terrain";
  }
}

std::string law(Random& r, RandomScene& scene) {
  const double frictions[] = {0, r.uniform(0, 1), r.uniform(0, 1), 10};
  const double friction = frictions[below(r, 4)];
  std::string keys = "friction = " + number(friction) + "\n";
  scene.summary += fmt::format(" mu {:.3g}", friction);
  if (r.uniform() < 0.5) {
    keys += "normal_stiffness = \"hard\"\n";
    scene.summary += " hard";
  } else {
    const bool per_area = r.uniform() < 0.4;
    scene.stiffness = per_area ? log_uniform(r, 1e7, 1e12) : log_uniform(r, 1e5, 1e11);
    keys += fmt::format("normal_stiffness = \"{} {}\"\n", number(scene.stiffness), per_area ? "Pa/m" : "N/m");
    scene.summary += fmt::format(" k {:.2g} {}", scene.stiffness, per_area ? "Pa/m" : "N/m");
    const double ratios[] = {0, r.uniform(0, 0.3), 1};
    const double ratio = ratios[below(r, 3)];
    keys += "damping_ratio = " + number(ratio) + "\n";
    if (ratio > 0) scene.summary += fmt::format(" zeta {:.2g}", ratio);
  }
  const double restitutions[] = {-1, -1, 0, r.uniform(), 1};
  if (const double e = restitutions[below(r, 5)]; e >= 0) {
    keys += "restitution = " + number(e) + "\n";
    scene.summary += fmt::format(" e {:.2g}", e);
  }
  if (r.uniform() < 0.15) {
    keys += "rolling_resistance = " + number(r.uniform(0.02, 0.3)) + "\n";
    scene.summary += " rolling";
  }
  if (r.uniform() < 0.1) {
    keys += "cohesion = 1e4\ntension = 5e3\n";
    scene.summary += " cohesion";
  }
  return keys;
}

}  // namespace

RandomScene random_scene(std::uint64_t seed) {
  Random r(0x632be59bd9b4e019ull * seed);
  RandomScene scene;
  const int kinds[] = {1, 2, 2, 3, 3, 4 + below(r, 4), 8 + below(r, 5)};
  const int n = kinds[below(r, 7)];
  scene.summary = fmt::format("seed {}: {} blocks", seed, n);
  const bool deformable = r.uniform() < 0.25;
  const double young = log_uniform(r, 1e7, 1e11);
  std::string stone = "density = 2600.0\n";
  if (deformable) {
    stone += fmt::format("young = {}\npoisson = {}\n", number(young), number(r.uniform(0, 0.45)));
    scene.summary += fmt::format(" E {:.2g}", young);
  }
  const std::string keys = law(r, scene);
  std::string bodies;
  scene.summary += " " + ground(r, bodies);
  const bool thrown = r.uniform() < 0.4, turning = r.uniform() < 0.6;
  const double spread = r.uniform(0, 1.2);
  double height = 2;
  scene.smallest = scene.thinnest = 1;
  for (int i = 0; i < n; ++i) {
    const Shape s = shape(r);
    scene.smallest = std::min(scene.smallest, 0.5 * s.radius);  // s.radius is a bound
    scene.thinnest = std::min(scene.thinnest, s.least);
    height += s.radius;
    const Vec3 at(r.uniform(-spread, spread), r.uniform(-spread, spread), height + 0.5 * r.uniform());
    height += s.radius + 0.5;
    bodies +=
        fmt::format("[[block]]\nname = \"B{}\"\nmaterial = \"rock\"\n{}position = {}\ndeformable = {}\n", i,
                    s.keys, verify::vector(at), deformable);
    if (r.uniform() < 0.7) bodies += verify::turned(r.uniform(0, 3) * r.direction());
    if (thrown) bodies += verify::velocity(r.uniform(0, 8) * r.direction());
    if (turning) bodies += verify::spin(r.uniform(0, 10) * r.direction());
  }
  scene.text = fmt::format(
      "schema = 1\n[simulation]\nduration = {}\nthreads = 1\n[output]\ninterval = 10.0\nhistory_interval = "
      "0.05\n",
      number(n <= 4 ? 2.5 : 2.0));
  for (const char* name : {"rock", "ground"})
    scene.text += fmt::format("[[material]]\nname = \"{}\"\n{}", name, stone);
  scene.text += "[[interface]]\nbetween = [\"*\", \"*\"]\n" + keys + bodies;
  return scene;
}

}  // namespace talus::stress
