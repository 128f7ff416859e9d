/// The ground over and under a point.
#pragma once
#include <limits>

#include "contact/detection/detect.hpp"

namespace talus::contact {

/// What a plumb line through a point meets of a terrain. Faces that face up bear; those that face down are
/// the undersides of overhangs. Of a two-sided sheet all faces bear and nothing is solid.
struct Plumb {
  double floor = std::numeric_limits<double>::quiet_NaN();  // highest face that bears, below the first
                                                            // underside above the point [m]; NaN: none
  int triangle = -1;                                        // that face
  double above = std::numeric_limits<double>::infinity();   // first face above the point [m]
  bool solid = false;  // the point lies in the rock: the first face above it faces up
};

Plumb plumb_at(const SurfaceIndex& terrain, const Vec3& p);

}  // namespace talus::contact
