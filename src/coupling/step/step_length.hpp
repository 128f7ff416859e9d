/// Longest steps by what moves and what it stands at, and what events may cost.
#pragma once
#include <algorithm>
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Contacts times factorisations of a time step, or of an event, per contact.
constexpr double factorisations = 15;

constexpr double lengthening = 1.02;  // of a step at a structure, at most

inline bool hard_alone(const std::vector<Touch>& touches) {
  return std::all_of(touches.begin(), touches.end(), [](const Touch& t) { return t.stiffness == 0; });
}

/// Longest step by what moves; `time_stepped`: of a time-stepped island, else as far as onsets are located
/// [s].
double step_limit(const IslandContext& in, const Step& step, double remaining, bool time_stepped);

/// Step at structures: equal parts of the macro step below the stable step, halved as the contacts ask. They
/// are lengthened again by little at a time: a leapfrog whose step jumps near its stable one feeds its
/// highest modes, jump by jump. Short parts of a short macro step bind no later one.
double structure_step(const IslandContext& in, Step& step, double duration, double longest);

/// What a time step with so many contacts may cost at most: contacts times factorisations.
double worth_of_a_step(double contacts);

/// Whether events would cost the island more than time stepping, over what is left of the macro step. `work`:
/// of its contact problems so far, contacts times factorisations. `rebounds_alone`: only what is thrown back
/// counts.
bool too_much_happens(const IslandContext& in, const Step& step, double work, double duration);

bool costs_too_much(const IslandContext& in, const Step& step, double work, double duration,
                    bool rebounds_alone);

}  // namespace talus::coupling
