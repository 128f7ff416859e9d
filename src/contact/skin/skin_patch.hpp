/// Where faces of a block lie along the skin of a structure: each skin triangle clipped by them, and each
/// node's part of what is covered. Internal to src/contact.
///
///   A_i = integral N_i dA,   M_i = integral N_i x dA   over what is covered
#pragma once
#include <vector>

#include "contact/skin/skin_near.hpp"

namespace talus::contact {

/// What of the skin's shape function of one vertex is covered: area and first moment.
struct SkinShare {
  int vertex = 0;
  double area = 0;
  Vec3 moment = Vec3::Zero();
  int triangle = -1;
};

/// One face of the block that lies on the skin.
struct SkinPatch {
  int face = 0;
  Vec3 point, normal;             // a point of the block's face; out of the structure
  double straightest = 1;         // least cosine between both sides' normals
  std::vector<SkinShare> shares;  // by skin vertex, ascending once complete
};

/// Appends the patches of the block's faces that lie along the skin within 10 degrees and are no strips
/// across another face of the structure.
void cover_skin(const SkinNear& at, std::vector<SkinPatch>& patches);

/// Appends the contacts of the patches on the nodes of the skin. Faces of the block that press on a node side
/// by side (triangles of a bent face) are one contact, and so are shares of several nodes at one place: else
/// a piece with a rough face has ten contacts where it has one.
void press_on_nodes(const SkinNear& at, const std::vector<SkinPatch>& patches,
                    std::vector<ContactPoint>& out);

}  // namespace talus::contact
