/// A block on a bed of springs: the skin of a structure as columns along its normals, each a spring per area of its own.
///
/// Where a block has sunk below a face of the skin, every point of that face carries the block's lower surface at the depth d below it:
///
///   s = min(d, x - y)                  compression of the column; x: greatest depth around it, y: crushed for good there [m]
///   F = sum_c A_c k clamp(s, 0, L) g_c A_c: area across the normal, k: stiffness per area, L = p/k, p: crushing pressure [N]
///
/// so that an elastic bed gives k times the volume sunk in, and a crushing one p times the area across the normal, whatever the shape. Over a step all
/// columns of a part move by the same way along the normal, that of the centre of pressure: the work of the row is that of the columns.
///
/// Within one plane of the skin the part moves along the skin's normal and g = 1: what the block's facets push aside cancels over the whole of them. Across an
/// edge of the structure it does not: there the part's normal is that of the block's facets, and g_c what a column gives for each metre along it.
///
/// symbol  meaning                                            unit
/// s_c     compression of column c at the start of the step   m
/// x_0     greatest depth at the start of the step            m
#pragma once
#include <limits>
#include <vector>

#include "core/types.hpp"

namespace talus::contact {

/// A piece of a skin's face with the block's surface below (or, depth < 0, above) it.
struct Column {
  double area = 0;    // across the normal [m^2]
  double depth = 0;   // [m]
  Vec3 place = Vec3::Zero();   // on the face [m]
  Vec3 lift = Vec3::Zero();    // into the block across its facet, over its part along the face's normal [1]
  int cell = 0;                // of the face's grid, where a bed crushes
  double most = std::numeric_limits<double>::infinity();   // that it may be compressed, x - y of its cell [m]
};

/// Spring law of the columns of one part of a face over its own greatest depth x.
class Bed {
 public:
  /// `start`: x_0; `limit`: p/k, infinite for an elastic bed; `deepest`: of the whole face; `crushed`: y [m].
  Bed(const std::vector<Column>& columns, const Vec3& normal, double start, double stiffness, double limit, double deepest, double crushed);

  double force(double x) const;
  double slope(double x) const;                      // dF/dx [N/m]
  double work(double x) const;                       // to x along the way down; holds what is crushed beyond L [J]
  double stored(double x) const;                     // part of it that comes back [J]
  double before(double x) const;                     // work up to x on the way that led to x_0: what yields now yielded there already [J]
  double crushing_before(double x) const;            // part of that which crushed, 0 at x_0 [J]
  double crushed_after(double x) const;              // y once x was reached [m]

 private:
  struct Spring { double stiffness, compression, gain; };  // k A_c, s_c, g_c
  double compression(const Spring& s, double x) const { return s.compression + s.gain * (x - start_); }
  bool yields(const Spring& s) const { return s.compression >= limit_ * (1 - 1e-3); }   // what the skin gives way meanwhile left apart
  std::vector<Spring> springs_;
  double start_, limit_, beyond_, crushed_, gain_ = 1;   // beyond: of the face's greatest depth; gain: the columns' mean
};

}  // namespace talus::contact
