/// What the drivers of Bullet and ODE share: the scene as bench/scenes.py writes it, the frames, the clock.
#pragma once
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace peers {

using Vector = std::array<double, 3>;

struct Body {
  Vector position;
  std::array<double, 4> orientation;  // w, x, y, z
  double speed;                       // along x at t = 0 [m/s]
};

struct Scene {
  double duration = 0, friction = 0, mass = 0;
  Vector inertia{0, 0, 0};   // about the body axes [kg m^2]
  Vector box{0, 0, 0};       // edges; zero if the bodies are hulls
  std::vector<Vector> hull;  // corners about the centroid
  std::vector<std::array<Vector, 3>> triangles;
  std::vector<Body> bodies;
};

inline Scene read_scene(const std::string& path) {
  Scene scene;
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream in(line);
    std::string kind;
    in >> kind;
    const auto vector = [&in] {
      Vector v;
      in >> v[0] >> v[1] >> v[2];
      return v;
    };
    if (kind == "duration") in >> scene.duration;
    if (kind == "friction") in >> scene.friction;
    if (kind == "mass") in >> scene.mass;
    if (kind == "inertia") scene.inertia = vector();
    if (kind == "box") scene.box = vector();
    if (kind == "triangle") scene.triangles.push_back({vector(), vector(), vector()});
    if (kind == "hull") {
      std::size_t count = 0;
      in >> count;
      while (scene.hull.size() < count) scene.hull.push_back(vector());
    }
    if (kind == "body") {
      Body b;
      b.position = vector();
      for (double& q : b.orientation) in >> q;
      in >> b.speed;
      scene.bodies.push_back(b);
    }
    if (in.fail()) throw std::runtime_error("bad line in " + path + ": " + line);
  }
  return scene;
}

inline double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return static_cast<double>(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
}

struct Options {
  std::string scene, frames;
  double step = 1e-3, duration = 0, interval = 0.1;
  int iterations = 50;
};

inline Options read_options(int count, char** text) {
  if (count != 7)
    throw std::runtime_error(
        "usage: driver SCENE STEP ITERATIONS DURATION FRAMES INTERVAL (duration 0: the scene's)");
  Options o;
  o.scene = text[1];
  o.step = std::atof(text[2]);
  o.iterations = std::atoi(text[3]);
  o.duration = std::atof(text[4]);
  o.frames = text[5];
  o.interval = std::atof(text[6]);
  return o;
}

/// Position 3, orientation 4 (w, x, y, z), velocity 3, spin 3.
using Row = std::array<double, 13>;

/// Steps a world and writes a frame every interval; the time of frames is not counted. `World` has step(h),
/// contacts(), row(body).
template <class World>
void drive(World& world, const Scene& scene, const Options& o) {
  const double duration = o.duration > 0 ? o.duration : scene.duration;
  const long steps = std::lround(duration / o.step), every = std::max(1L, std::lround(o.interval / o.step));
  const double h = duration / static_cast<double>(steps);
  std::FILE* file = std::fopen(o.frames.c_str(), "wb");
  if (file == nullptr) throw std::runtime_error("cannot write " + o.frames);
  const auto frame = [&](double t) {
    std::fwrite(&t, sizeof t, 1, file);
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      const Row row = world.row(b);
      std::fwrite(row.data(), sizeof row, 1, file);
    }
  };
  frame(0);
  const double start = cpu_seconds();
  double aside = 0, contacts = 0;
  for (long k = 1; k <= steps; ++k) {
    world.step(h);
    contacts += world.contacts();
    if (k % every != 0 && k != steps) continue;
    const double before = cpu_seconds();
    frame(h * static_cast<double>(k));
    aside += cpu_seconds() - before;
  }
  const double cpu = cpu_seconds() - start - aside;
  std::fclose(file);
  std::printf("{\"cpu\": %.6f, \"steps\": %ld, \"contacts\": %.1f}\n", cpu, steps,
              contacts / static_cast<double>(steps));
}

/// A driver's main: the scene and the step from the command line, World(scene, iterations) stepped to the
/// end.
template <class World>
int run(int count, char** text) {
  try {
    const Options options = read_options(count, text);
    const Scene scene = read_scene(options.scene);
    World world(scene, options.iterations);
    drive(world, scene, options);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
}

}  // namespace peers
