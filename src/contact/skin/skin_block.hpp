/// Contacts of a block with the skin of a structure: flat faces press on the skin's nodes, vertices on its
/// faces, all else touches as on any surface.
///
/// Where a face of the block lies along faces of the skin (within 10 degrees), each skin triangle is clipped
/// by it, and each node gets
///
///   A_i = integral N_i dA over what is covered,   gap_i = distance of node i from the face
///
/// so that a uniform gap gives a uniform pressure, and force and moment of the pressure are exact. A node
/// outside the outline of the face takes its share at the centroid of N_i over what is covered. The key of
/// such a contact is (face, node): it does not change while the face lies there. Neighbouring faces of the
/// block that are nearly parallel (triangles of a bent face) press on a node as one, at the centroid of what
/// they cover and with its mean gap.
#pragma once
#include "contact/detection/detect.hpp"

namespace talus::contact {

int skin_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
               std::vector<ContactPoint>& out);

}  // namespace talus::contact
