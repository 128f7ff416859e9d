/// Whether bonds and cohesion on springs may give way to the oscillation of the blocks that hang on them.
///
/// What is let go swings about its rest: a bond that would bear its load at rest is pulled by up to twice as
/// much. With x the way from here to the rest of the island on its springs, of blocks that do not strain,
///
///   (K + A / T^2) x = f,    K = sum J^T k J over springs that press or pull, f all loads at present (1)
///
/// a bond of stiffness k, stretched by s, with J x its way to rest and J v its rate, is pulled by up to
///
///   k (s + J x + ((J x)^2 + (J v t)^2)^(1/2)),   t = pi / (2 w) (2)
///
/// w^2 = x.K x / x.A x or v.K v / v.A v, that of the motion with more energy, in each part that springs
/// connect; t is a quarter of its period: a column of many blocks is stretched at a steady rate for so long.
/// From rest (2) is exact for one mode, and 1 % too much for eight cubes that hang on each other; underway it
/// is at most 2.6 times the load at rest, where 2 is right. Along the surface cohesion is lost as the shear
/// of both tangents, each by (2), comes to friction times the least that the normal spring presses by, and
/// cohesion.
///
/// symbol   meaning                                                              unit
/// A        masses and inertias of the blocks                                    kg, kg m^2
/// v        velocities, of what hangs nowhere without its mean                   m/s, rad/s
/// T        time after which what no spring holds is far away: 1 s               s
#pragma once
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// True for a closed spring whose bond or cohesion is lost for good once its strength is reached.
bool loses_strength(const IslandContext& in, const Touch& t);
/// By touch, of these: it may come to the strength of its bond, or its shear to the bound of what cohesion
/// holds.
std::vector<bool> may_give_way(const IslandContext& in, const Step& step);

}  // namespace talus::coupling
