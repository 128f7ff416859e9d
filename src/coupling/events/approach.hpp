/// Which approach of two bodies is an impact, and which parting none.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Where the impulse of a touch acts on both sides at the start of the step [m].
Vec3 acting_point(const IslandContext& in, const Touch& t);

/// Velocity of B against A along the face, both at the point x as in the contact equation [m/s]. Sides that
/// are d apart, in each other since their birth, differ by d times their spin at points of their own.
Vec3 slip_velocity(const IslandContext& in, const Touch& t, const Vec3& x);

/// Normal speed of the slowest impact that rebounds: a bounce too low for the accuracy asked for is none, nor
/// is a parting as slow. An error u of velocity acts over the time L / V in which the two go by the size of a
/// block, V their speed against each other or that of a fall by L: 0.03 accuracy V is a thirtieth of what the
/// accuracy allows [m/s].
double slow_speed(const IslandContext& in, const Touch& t);

/// Approach below which a touch is resting contact and no impact: round-off, or a part of the motion of the
/// two against each other, however slow that has become. A touch that carried force in the last step moves at
/// its normal by what the step's own error leaves. The error acts over the time of a fall by L: of motions
/// that are faster than that fall, a part of the fall's speed. A spring takes what would rebound beneath the
/// accuracy [m/s].
double impact_speed(const IslandContext& in, const Touch& t);

/// Closed, and an approach is stopped by an impulse of no duration.
bool meets_hard(const IslandContext& in, const Touch& t);

/// A spring that presses already: what its two sides approach by is taken by its force, and is no impact.
bool spring_presses(const IslandContext& in, const Touch& t);

/// Comes on fast enough to be thrown back.
bool rebounds(const IslandContext& in, const Touch& t);

/// Something that is to be thrown back has closed.
bool rebound_waits(const IslandContext& in, const Step& step);

/// Whether anything is in contact, or held by fixed points, at the start of the step.
bool any_contact(const IslandContext& in, const Step& step);

}  // namespace talus::coupling
