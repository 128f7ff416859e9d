/// What of a block lies below the faces of a structure's skin, or so little above them that it may within the
/// step: its lower surface seen along each face's normal, clipped by the face. Areas across the normal,
/// depths and their first and second moments are exact for plane facets.
///
/// A face's share is cut in up to four parts by two lines through the middle of all that has sunk in along
/// nearly the same normal (within 25 degrees), so that a block smaller than a face rests on four places, too.
/// Where a bed crushes, faces are cut into cells as well: each remembers how deep it was crushed.
#pragma once
#include <limits>

#include "contact/detection/detect.hpp"
#include "contact/laws/bed.hpp"

namespace talus::contact {

constexpr int crater_cells = 4;  // along each side of a face that crushes

struct Footprint {
  int triangle = 0;             // of the skin's face, the first of its four
  int sector = 0;               // 0 to 3, by the signs across the two lines
  Vec3 normal = Vec3::UnitZ();  // of the quadrilateral, outward
  Vec3 centre = Vec3::Zero(), u = Vec3::UnitX(), v = Vec3::UnitY();  // its middle and axes
  bool edge = false;  // the block lies in faces of another direction, too: the force acts as the columns'
                      // energy asks for, across the normal as well
  double deepest = -std::numeric_limits<double>::infinity();  // of the whole part [m]
  double volume = 0;                                          // sunk in [m^3]
  double crushed = 0;        // since the bed was looked at before (coupling/ground/craters.hpp) [m^3]
  Vec3 push = Vec3::Zero();  // 1/2 d^2 along the borders of the face, outward: what columns past them give a
                             // block that moves there [m^3]
  std::vector<Column> columns;
};

/// Appends the parts of block B with columns deeper than -reach, ordered by face and sector. `yield`: depth
/// at which a column crushes, where pieces are cut so that the force is exact, infinite: never, and no cells
/// [m].
void skin_bed(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double reach, double yield,
              std::vector<Footprint>& out);

/// The triangle of the quadrilateral whose first one is given that a point of it lies on, and that point
/// moved onto it.
int triangle_of_face(const TriangleSurface& skin, int first, Vec3& x);

}  // namespace talus::contact
