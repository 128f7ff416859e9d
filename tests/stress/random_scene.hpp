/// A few random blocks on random ground, as a user would write them: the same seed gives the same scene on
/// every machine.
#pragma once
#include <cstdint>
#include <string>

namespace talus::stress {

struct RandomScene {
  std::string text;
  std::string summary;   // blocks, ground, law
  double smallest = 0;   // radius of the smallest block [m]
  double thinnest = 0;   // least extent of a block [m]
  double stiffness = 0;  // of the contact springs [N/m] or [Pa/m]; 0: hard
};

RandomScene random_scene(std::uint64_t seed);

}  // namespace talus::stress
