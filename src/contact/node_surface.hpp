/// One node of a skin against the faces of another: what structures touch each other by.
#pragma once
#include "contact/detect.hpp"

namespace talus::contact {

/// Finds the face of `index` that lies nearest to x, within `margin` on either side, under x, and facing it (`outward`: the skin's
/// direction at the node, unit). Fills point_a (on the face), point_b = x, normal, gap and face_a; key and area are the caller's.
/// False if there is none: edges of the two skins that cross are not looked for.
bool node_surface(const SurfaceIndex& index, const Vec3& x, const Vec3& outward, double margin, ContactPoint& out);

}  // namespace talus::contact
