/// A block on a bed of springs: the skin of a structure as columns along its normals, each a spring per area
/// of its own.
///
/// Where a block has sunk below a face of the skin, every point of that face carries the block's lower
/// surface at the depth d below it:
///
///   s = d - max(0, y)                  compression of the column; y: crushed for good there [m]
///   F = sum_c A_c k clamp(s, 0, L) g_c   [N]
///   A_c: area across the normal, k: stiffness per area, L = p/k, p: crushing pressure
///
/// so that an elastic bed gives k times the volume sunk in, and a crushing one p times the area across the
/// normal, whatever the shape. Columns come as triangles, over which d and s are linear: the sums are
/// integrals, exact also where a triangle comes out of contact, or yields, on the way. Over a step all
/// columns of a part move by the same way along the normal, that of the centre of pressure: the work of the
/// row is that of the columns.
///
/// Within one plane of the skin the part moves along the skin's normal and g = 1: what the block's facets
/// push aside cancels over the whole of them. Across an edge of the structure it does not. There a bed that
/// crushes pushes along the block's facets, and an elastic one as its energy falls, by 1/2 k d^2 for each
/// metre of the face's border that the block reaches past; the part's normal is that of the push, and g_c
/// what a column gives for each metre along it.
///
/// symbol  meaning                                            unit
/// s_c     compression of column c at the start of the step   m
/// x_0     greatest depth at the start of the step            m
#pragma once
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "core/types.hpp"

namespace talus::contact {

constexpr double full_at = 1 - 1e-3;  // of L: what the skin gives way meanwhile left apart

/// The columns of a triangle: a piece of a skin's face with one facet of the block below (or, depth < 0,
/// above) it, so that the depth is linear over it.
struct Column {
  double area = 0;                 // across the normal [m^2]
  std::array<double, 3> depth{};   // at its corners [m]
  std::array<double, 3> spring{};  // s at its corners, below 0 where it carries nothing [m]
  std::array<Vec3, 3> place{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  // of the corners on the face [m]
  Vec3 lift = Vec3::Zero();  // its push over the push along the face's normal: along the block's facet, or as
                             // the energy of an elastic bed asks for [1]
  int cell = 0, facet = 0;   // of the face's grid, where a bed crushes, and of the block
  double mean() const { return (depth[0] + depth[1] + depth[2]) / 3; }
  /// It yields as soon as it goes on.
  bool full(double limit) const { return std::min({spring[0], spring[1], spring[2]}) >= limit * full_at; }
};

/// Spring law of the columns of one part of a face over its own greatest depth x.
class Bed {
 public:
  /// `start`: x_0; `limit`: p/k, infinite for an elastic bed; `deepest`: of the whole face; `crushed`: y [m];
  /// `rested`: it held nothing a step ago.
  Bed(const std::vector<Column>& columns, const Vec3& normal, double start, double stiffness, double limit,
      double deepest, double crushed, bool rested = false);

  double force(double x) const;
  double slope(double x) const;   // dF/dx [N/m]
  double work(double x) const;    // to x along the way down; holds what is crushed beyond L [J]
  double stored(double x) const;  // part of it that comes back [J]
  double way_from(double x)
      const;  // x_0 where x led there unloaded: what rested came with the block and held nothing on the way
  double before(
      double x) const;  // work up to x on the way that led to x_0: what yields now yielded there already [J]
  double crushing_before(double x) const;  // part of that which crushed, 0 at x_0 [J]
  double crushed_after(double x) const;    // y once x was reached [m]

 private:
  /// Means over a triangle of max(0, z) and its square, and the part of it where z > 0, of a linear z.
  struct Above {
    double part = 0, first = 0, second = 0;
  };
  /// The columns of a triangle: compressed by s at the start, by g m more for each metre that x grows. Full
  /// ones hold what they have: some of those that were crushed together have more than L, as others have
  /// less.
  struct Spring {
    double stiffness, gain;       // k A, g
    std::array<double, 3> start;  // rising
    bool full;
    Above above(double shift) const;  // of s + shift
    Above compressed(double shift,
                     double limit) const;  // of min(s + shift, limit), of full ones s + min(shift, 0)
  };
  double shift(const Spring& s, double x) const { return s.gain * (x - start_); }
  double held(const Spring& s, double shift) const {
    return 0.5 * s.stiffness * s.compressed(shift, limit_).second;
  }
  double crushing(const Spring& s, double shift)
      const;  // on the way there, below 0 on the way that led to s if it is full [J]
  std::vector<Spring> springs_;
  double start_, limit_, beyond_, crushed_,
      gain_ = 1;  // beyond: of the face's greatest depth; gain: the columns' mean
  bool rested_;
};

}  // namespace talus::contact
