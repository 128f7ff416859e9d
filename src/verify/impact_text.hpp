/// Scene text and histories of structures that are struck.
#pragma once
#include <string>
#include <vector>

#include "verify/scene_text.hpp"
#include "verify/suite.hpp"

namespace talus::verify {

/// A [[structure]] of kind box without support, preload and damage; `more` may name them.
std::string structure_box(const std::string& name, const Vec3& size, const Vec3& position,
                          const std::array<int, 3>& cells, const std::string& material,
                          const std::string& more);

inline const char* const held_below = "support = [\"-z\"]\npreload = \"none\"\n";
inline const char* const unsupported = "support = []\npreload = \"none\"\n";

/// Resultant of the contacts on structures, one sample a coupled step; force acts on the structures, mean
/// over (time - dt, time].
struct ContactSample {
  double time, dt;
  Vec3 force;
};
std::vector<ContactSample> resultants(const Outcome& o);

/// Stretches of contact: opened at a force, closed after a pause of `pause` seconds without any.
struct ContactSpell {
  double start, end, peak, peak_time;
  Vec3 impulse;
};
std::vector<ContactSpell> spells(const std::vector<ContactSample>& samples, double pause);

/// Mean of the component along `direction` over a window [N].
double window_mean(const std::vector<ContactSample>& samples, const Vec3& direction, double start,
                   double window);

/// What holds after every run with a structure: forces and moments in balance to 1e-12, the impulse on the
/// structure is the momentum the blocks lost to 1e-9 (without gravity and other partners), works on both
/// sides as recorded, ledger closed to `residual` of the energy of the impact.
void judge_interface(CaseRun& c, const Outcome& o, const std::string& title, double residual,
                     bool taken_judged = true);

}  // namespace talus::verify
