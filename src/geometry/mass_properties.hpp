/// Mass properties of a closed polyhedron of uniform density.
///
///   V = ∫ dV,   m = rho V,   c = ∫ x dV / V,   S = rho ∫ (x - c)(x - c)^T dV,   I = tr(S) 1 - S
///
/// by the divergence theorem over the triangulated boundary, exact for polyhedra [shi2001, eq. 12]: each
/// triangle (a, b, d) spans a signed tetrahedron with the origin, for which
///
///   ∫ dV = det/6,   ∫ x dV = det/24 s,   ∫ x x^T dV = det/120 (s s^T + a a^T + b b^T + d d^T),
///   det = a . (b x d),  s = a + b + d
///
/// symbol   meaning                                        unit      shape
/// rho      density                                        kg/m^3
/// V        volume                                         m^3
/// c        centroid, in the axes of the vertices          m         3
/// S        second moment of mass about c                  kg m^2    3 x 3
/// I        moment of inertia about c                      kg m^2    3 x 3
///
/// A displacement field that is linear in x, as that of the 12-DOF block, has a mass matrix made of m and S
/// alone.
///
/// Throws InputError if the surface is open, not oriented, or encloses a volume below 1e-12 of its bounding
/// box: the message names the edge or face.
#pragma once
#include <array>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "core/types.hpp"

namespace talus::geometry {

struct MassProperties {
  double volume = 0;                  // [m^3]
  double mass = 0;                    // [kg]
  Vec3 centroid = Vec3::Zero();       // [m]
  Mat3 second_moment = Mat3::Zero();  // about the centroid [kg m^2]
  Box3 bounds;                        // of the vertices [m]
  Mat3 inertia() const { return second_moment.trace() * Mat3::Identity() - second_moment; }
};

MassProperties mass_properties(const Polyhedron& block, double density);

/// The same for a bare triangulation, before a Polyhedron is made of it.
MassProperties mass_properties(const std::vector<Vec3>& vertices,
                               const std::vector<std::array<int, 3>>& triangles, double density);

/// A place within the body, about its centroid: that itself if the body is convex, else the middle of the way
/// from its largest triangle inward to the next face [m].
Vec3 place_within(const Polyhedron& block);

/// Volume and bounding box alone.
double volume(const Polyhedron& block);
Box3 bounding_box(const Polyhedron& block);

}  // namespace talus::geometry
