/// From impulses to positions and momenta.
#pragma once
#include <functional>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Marks every body that an onset reaches: through rows that `bear` it is connected to a touch that `begins`.
/// True if there is one. What nothing connects to it keeps the trapezoid, whatever island it belongs to.
bool mark_reached(const IslandContext& in, Step& step, const std::function<bool(const Touch&)>& bear,
                  const std::function<bool(const Touch&)>& begins, const std::function<void(Body&)>& mark);

/// Angular velocity that gives a block this angular momentum about its centroid [kg m^2/s], where and as
/// strained as it is.
void set_spin(const IslandContext& in, int i, const Vec3& momentum, bool strains);

/// Moves the bodies by the impulses of the solution.
class BodyUpdate {
 public:
  BodyUpdate(const IslandContext& in, Step& step);
  /// Over the step of length h; 0: velocities alone.
  void apply(double h);

 private:
  struct TermOfBody {
    int contact, term;
  };
  /// The terms that act on each body, in the order of the contacts.
  void list_terms();

  const IslandContext& in_;
  Step& step_;
  std::vector<std::size_t> first_term_of_;  // into terms_of_, per body and one more
  std::vector<TermOfBody> terms_of_;        // of the bodies, ascending contacts of each
  std::vector<double> theta_of_;            // per contact of the problem
};

}  // namespace talus::coupling
