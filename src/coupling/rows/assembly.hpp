/// The contact problem of a step: rows with their frames, Jacobians at mid-step and biases by mode; masses of
/// its bodies.
#pragma once
#include <span>
#include <vector>

#include "coupling/motion/node_places.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

struct ContactPath;
struct RowMotion;

class RowAssembly {
 public:
  RowAssembly(const IslandContext& in, Step& step);
  /// All rows of a step of length h, and its bodies.
  void assemble(double h, bool time_stepped, bool first_pass);

  // Piece by piece, of impulses of no duration and corrections of positions:
  void clear();
  /// Rows of touches begin. Without structures the pool of Jacobians keeps its size: all of it is written
  /// anew.
  void begin() { begin(false); }
  /// The same of a correction of positions, in which the surfaces of structures stay where they are.
  void begin_correction() { begin(true); }
  /// A row of the problem under assembly: at once, or without structures its place alone.
  void take(Touch& t, double h, bool first_pass);
  void add_row(Touch& t, double h, bool first_pass);
  /// Every row that has its place alone.
  void fill_rows(double h, bool first_pass);
  /// Blocks first, then nodes or skins of structures.
  void finish_bodies();

 private:
  /// The next row, its terms and the room for their Jacobians; at a skin that moves the terms follow from the
  /// nodes that it names.
  void begin(bool surfaces_stand);
  void place_row(Touch& t);
  void fill_row(Touch& t, double h, bool first_pass);
  /// Jacobian of both sides at the place where the impulse acts, and what it makes of their velocities.
  RowMotion add_terms(Touch& t, contact::ProblemContact& c, const ContactPath& path, double h);
  void add_surface_row(Touch& t, double h, bool first_pass);
  /// Adds the terms of a point of a structure's skin, with the frame's rows; returns its predicted velocity
  /// (world) and adds sign times that to u_ref (frame). `tilt`: of a point above the face, what a node's
  /// velocity along the normal moves it aside by, per entry.
  Vec3 add_structure_terms(int row, int structure, const SurfaceWeights& w, const Mat3& frame, double sign,
                           Vec3& u_ref, std::span<const Vec3> tilt = {});
  /// The terms of a point of a structure's skin, as add_structure_terms(); returns the point's mean velocity
  /// over the step, which is its displacement over h.
  Vec3 add_condensed_terms(int row, int structure, const SurfaceWeights& w, const Mat3& frame, double sign,
                           Vec3& u_ref);

  const IslandContext& in_;
  Step& step_;
  NodePlaces node_places_;
  bool surfaces_stand_ = false;
  std::size_t jacobians_ = 0;  // entries of the Jacobians of the rows that have their place
  std::vector<double> pool_;   // masses and inverses of the problem's bodies
  std::vector<std::size_t> pool_offset_;
};

}  // namespace talus::coupling
