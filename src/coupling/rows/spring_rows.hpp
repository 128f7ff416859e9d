/// Contact springs as rows: those at a structure by their tangent at the predicted end.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// n . J A^-1 J^T n of the row that is being made [1/kg].
double normal_compliance(const IslandContext& in, const Step& step, const contact::ProblemContact& c);

/// The rule without loss at a structure; where the step does not resolve the contact, the force at the end.
void secant_row(const IslandContext& in, const Step& step, Touch& t, contact::ProblemContact& c, double h,
                bool first_pass);

/// Whether the impulse of such a contact is its law's at the indentation reached, to `allowed` of it.
bool follows_law(const IslandContext& in, const Step& step, const Touch& t, double h, double allowed);

/// Shear spring by the same rule as the normal one; `moved` (frame) is what its ends move apart where the
/// velocity is u_ref. At a point of a structure that the step resolves its force is that of the mean of the
/// elongations a step before and a step after, p = -k (h_- + h_+)/2 (s_nm + s_np)/2: the secant of a linear
/// law, without loss.
void shear_row(const IslandContext& in, const Step& step, Touch& t, contact::ProblemContact& c, double h,
               const Vec3& moved, const Vec3& u_ref);

}  // namespace talus::coupling
