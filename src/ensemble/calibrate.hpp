/// Ground parameters against measured end points.
///
/// Candidates are points of a Sobol' sequence in the box of the parameters; each runs all members of the scene's ensemble with the same draws. What is
/// compared are distributions: the energy distance of Szekely & Rizzo between end points in plan, x computed, y measured,
///
///   D^2 = 2 E|x - y| - E|x - x'| - E|y - y'|
///
/// Half of the candidates cover the box, the rest a box about the best of them, a third as wide. Every fourth measured point is held out: its distance is reported
/// beside that of the points that were fitted, and plays no part in the choice.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace talus::ensemble {

struct Parameter {
  std::string key;
  double low = 0, high = 0;
  std::string unit;   // SI unit that values are written with; empty: bare
};

/// "KEY=LOW:HIGH", numbers with or without units. Throws InputError.
Parameter parse_parameter(const std::string& text);

struct CalibrationRequest {
  std::string scene;
  scene::Overrides overrides;
  std::filesystem::path measured;   // CSV with columns x, y in scene coordinates
  std::filesystem::path directory;
  std::vector<Parameter> parameters;
  int candidates = 32;
  int threads = 1;
  std::function<void(int done, int asked)> progress;
  const std::atomic<int>* stop = nullptr;
};

/// Energy distance between two sets of points in plan [m].
double energy_distance(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b);

/// Writes calibration.json. Returns lines to print; empty if it was stopped. Throws InputError.
std::vector<std::string> calibrate(const CalibrationRequest& request);

}  // namespace talus::ensemble
