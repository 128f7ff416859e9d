/// Ground parameters against measured end points or passages at a line.
///
/// Candidates are points of a Sobol' sequence in the box of the parameters; each runs all members of the
/// scene's ensemble with the same draws. What is compared are distributions: the energy distance of Szekely &
/// Rizzo between end points in plan, or between what passes at a line, x computed, y measured,
///
///   D^2 = 2 E|x - y| - E|x - x'| - E|y - y'|
///
/// Half of the candidates cover the box, the rest a box about the best of them, a third as wide. Every fourth
/// measured row is held out: its distance is reported beside that of the rows that were fitted, and plays no
/// part in the choice. Of passages each member's largest values at the line count, over the measured standard
/// deviations.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ensemble/progress.hpp"
#include "scene/scene.hpp"

namespace talus::ensemble {

struct Parameter {
  std::string key;
  double low = 0, high = 0;
  std::string unit;  // SI unit that values are written with; empty: bare
};

/// "KEY=LOW:HIGH", numbers with or without units. Throws InputError.
Parameter parse_parameter(const std::string& text);

struct CalibrationRequest {
  std::string scene;
  scene::Overrides overrides;
  std::filesystem::path measured;  // CSV with columns x, y in scene coordinates; or line and some of energy
                                   // [J], speed [m/s], height [m]
  std::filesystem::path directory;
  std::vector<Parameter> parameters;
  int candidates = 32;
  int threads = 1;
  std::function<void(const Progress&)> progress;  // from any thread, one at a time
  const std::atomic<int>* stop = nullptr;
};

/// Energy distance between two sets of points, sqrt(2 E|a - b| - E|a - a'| - E|b - b'|): in the root of their
/// unit.
double energy_distance(const std::vector<VecX>& a, const std::vector<VecX>& b);

/// Writes calibration.json. Returns lines to print; empty if it was stopped. Throws InputError.
std::vector<std::string> calibrate(const CalibrationRequest& request);

/// What of a request can be refused before anything is written: measurements that cannot be read, a parameter
/// that [[ensemble.vary]] draws. Throws InputError.
void check(const CalibrationRequest& request);

}  // namespace talus::ensemble
