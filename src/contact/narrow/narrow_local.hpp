/// Contacts by local features: exact for concave polyhedra and triangulated surfaces, no decomposition.
///
/// A pair of features is a contact if it is close and the normal lies in the normal cones of both, that is,
/// if the pair is locally the closest:
///
///   vertex v of B, face f of A:  v projects into f,  0 <= gap <= margin              normal n_f
///   vertex v of A, face f of B:  the same with the roles exchanged                   normal -n_f
///   convex edges e_A, e_B:       closest points inside both, n in the arcs of both   normal +-(e_A x e_B)
///   vertex-edge, vertex-vertex:  separated, direction inside both cones              normal = direction
///
///
/// Sides between coplanar triangles are no edges, hence no internal-edge hits: every normal is the normal of
/// a true feature of the surface. A vertex behind the surface takes the nearest face that its cone admits.
#pragma once
#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_math.hpp"

namespace talus::contact::narrow {

int concave_concave(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b,
                    double margin, std::vector<ContactPoint>& out);
int surface_polyhedron(const SurfaceIndex::Impl& surface, const Polyhedron& b, const Pose& pose_b,
                       double margin, std::vector<ContactPoint>& out);

}  // namespace talus::contact::narrow
