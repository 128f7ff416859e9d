/// Springs of one contact point: by its law, and how they go on from what the contact remembers.
#pragma once
#include <span>
#include <vector>

#include "contact/geometry/corner_cell.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// What the contact remembers, taken over; null: it is new.
const ContactMemory* recall(const std::vector<ContactMemory>& memory, std::uint64_t partner, Touch& t);

/// Whether the force of the law is one of the area that presses.
bool presses_by_area(const ContactLaw& law);

/// What presses on a contact point, for how deep it may come.
struct Stopped {
  double mass;    // [kg]
  double weight;  // [N]
  double length;  // of what presses [m]
  /// Where nothing leads deeper [m].
  double least_depth() const { return 1e-12 * length; }
};
/// Of a block.
Stopped stopped(const dda::Model& m, const Touch& t);

/// Springs and law of a contact point. `cell`: the part of the surface that it presses by (corner_cell.hpp),
/// of no height where all of it is there at once; `crushed`: indentation lost for good in earlier steps [m].
void set_spring(Touch& t, const Stopped& by, const contact::CornerCell& cell, double crushed);

/// Mean force of a spring over the step, from its start to the indentation of the last solution, and its
/// derivative by the latter [N], [N/m]. Its work is that of the law, also of a contact that closes within the
/// step; one that opens, or is open, has the linear law's below 0, which a row cuts and which makes no
/// energy.
double mean_force(const Touch& t, double& derivative);

/// Mass that a contact of the pair stops: the two blocks in series, the one if its partner is held or a
/// structure [kg].
double mass_in_series(const dda::Model& m, const Touch& t);

/// Whether a spring in N/m gives less than the touched cell of a structure (Young's modulus [Pa], edge of its
/// face [m]) does of its own, at whatever point of the face: the cell gives more than both should, and the
/// contact is hard. One with a dashpot stays a spring.
bool within_cell(const ContactLaw& law, double young, double edge);

/// The same of a spring of that stiffness [N/m], whatever it is of; `cell`: Young's modulus times edge [N/m].
bool gives_less_than_cell(const ContactLaw& law, double stiffness, double cell);

/// A loaded spring keeps the stiffness and the form of area that it had where what it has now would hold less
/// at its indentation (a face that tilts to a corner), and where it took over what others held: a softer one
/// would hold its energy only at an indentation that nothing has made.
void keep_stiffness(Touch& t, const ContactMemory& last);

/// Takes what the touched cell of a structure gives of its own off a linear or Hertz's spring, at most half
/// of the spring's.
void relieve(Touch& t, const StructurePart& part);

/// A spring at a structure goes on where it was, whatever became of its point: where the place of a contact
/// on the skin jumps (a node that comes to be covered, a stiffness that changes with the place in the cell),
/// the energy stored stays. A new one that is inside already starts unloaded. `grows`: its area grows from
/// nothing, so that nothing jumps.
void hold_on(Touch& t, const ContactMemory* last, bool grows);

/// Springs of a block at a structure go on from the last step, also under another name: a feature that has
/// just appeared inside takes over from the nearest one within `reach` that has just vanished.
void go_on(std::span<Touch> touches, std::vector<const ContactMemory*>& last,
           const std::vector<ContactMemory>& memory, std::uint64_t partner, double reach);

/// `damping_ratio` is that of the pair moving along its normal, whatever the number of points: c_i = 2 zeta
/// k_i sqrt(m / sum k), the sum over the points closed with it.
void share_dashpots(const dda::Model& m, const CandidatePair& pair, bool lasts, std::span<Touch> touches);

}  // namespace talus::coupling
