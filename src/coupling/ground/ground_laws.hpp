/// Laws of the ground beyond Coulomb's (docs/theory/ground.md).
///
///   friction    mu(s) = mu + (mu_most - mu) 2/pi atan(s / s_0) [leine2014]
///
///   ds/dt = |u_t| in contact, -beta s out of it
///
///   ploughing   T = (sigma + rho u_t^2 / 2) sum y_i A_i / sqrt(sum A_j)
///
///   y_i: depth of a contact point below the ground as it was, A_i: its area
///
///   vegetation  F = -eta v
///
///   while the centroid is lower than the vegetation above the ground
///
/// Ploughing is a part of the cone of friction, so that it opposes what slides and holds what does not.
#pragma once
#include <span>

#include "coupling/environment.hpp"
#include "coupling/touch/touch.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

/// Whether a law of the environment changes with the way slid.
bool remembers_way(const ContactLaws& laws);
/// Coefficient of friction of a touch after so much more of its way [m].
double friction_now(const dda::State& state, const Touch& touch, double ahead = 0);
/// Widths A_i / sqrt(sum A_j) of the touches of a pair that have sunk in.
void share_width(std::span<Touch> touches);
/// A touch's part of T at a slip speed [m/s] [N].
double ploughing(const Touch& touch, double slip);
/// Lets a block's way go on by a step of length h [s]; `slip`: fastest of its contacts [m/s], negative out of
/// contact; `recovery`: beta [1/s].
void go_on_sliding(dda::State& state, int block, double slip, double recovery, double h);

/// Whether anything grows on a ground.
bool any_vegetation(const ContactLaws& laws);
/// Drag over mass of a block whose centroid is at c, eta/m of the densest vegetation that it is in [1/s].
double vegetation_drag(const dda::Model::Block& block, const Environment& environment, const Vec3& c);
/// Normals of the planes, and of the face of the terrain below a point: along them the height above each
/// goes.
std::vector<Vec3> normals_below(const Environment& environment, const Vec3& c);

}  // namespace talus::coupling
