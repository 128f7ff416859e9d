// Contact springs as rows: linear ones exactly, curved ones and those at a structure by their tangent at the
// predicted end.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"

namespace talus::coupling {

/// n . J A^-1 J^T n of the row that is being made [1/kg].
double IslandStepper::normal_compliance(const contact::ProblemContact& c) const {
  double sum = 0;
  for (int k = 0; k < c.terms; ++k) {
    const contact::ContactTerm& term = step_.problem.terms[static_cast<std::size_t>(c.first_term + k)];
    const double* j = step_.problem.jacobians.data() + term.jacobian;
    if (term.body < static_cast<int>(step_.bodies.size())) {
      const Body& b = step_.bodies[static_cast<std::size_t>(term.body)];
      Vec12 row = Vec12::Zero();
      for (int i = 0; i < b.ndof; ++i) row[i] = j[3 * i];
      sum += row.head(b.ndof).dot(b.free.inverse.topLeftCorner(b.ndof, b.ndof) * row.head(b.ndof));
    } else if (in_.condensed) {
      const Skin& s = step_.skins[static_cast<std::size_t>(term.body) - step_.bodies.size()];
      const Eigen::Map<const VecX, 0, Eigen::InnerStride<3>> row(j, s.inverse.rows());
      sum += row.dot(s.inverse * row);
    } else {
      const NodeBody& n = step_.nodes[static_cast<std::size_t>(term.body) - step_.bodies.size()];
      sum += (j[0] * j[0] + j[3] * j[3] + j[6] * j[6]) / n.mass;
    }
  }
  return sum;
}

/// Whether the step resolves the contact's own oscillation, so that the rule without loss may be used.
bool IslandStepper::conserving(const Touch& t, const contact::ProblemContact& c, double h) const {
  return h * h * std::max(t.stiffness, t.normal_law.slope(-t.gap_ref)) * normal_compliance(c) < 1;
}

namespace {

/// Of a point of a skin [1/kg].
double inverse_mass(const Structure& structure, const SurfaceWeights& w) {
  double inverse = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
    inverse += w.weight[i] * w.weight[i] / structure.node_mass(w.node[i]);
  return inverse;
}

}  // namespace

/// True if the step that is searched for resolves the swing of a part of an elastic foundation, h^2 k W < 1,
/// k its stiffness and W the inverse mass of block and skin along its normal. Along the normal its row holds
/// it at the end of the step; what tilts it moves it at the start alone, and feeds the tilting where the step
/// does not resolve it.
bool IslandStepper::part_resolved(const Touch& t) const {
  const dda::Model::Block& block = in_.model.blocks[static_cast<std::size_t>(t.b)];
  Mat12 mass, inverse;
  dda::impulse_mass(in_.model, in_.state, t.b, !block.deformable, mass, inverse);
  const Vec12 row = point_row(block, in_.state.rotation(t.b), dda::pose(in_.state, t.b).F.inverse(),
                              t.at.point_a - in_.state.c[static_cast<std::size_t>(t.b)], t.at.normal);
  const StructurePart& part = in_.env.structures[static_cast<std::size_t>(t.a.index)];
  const double compliance =
      row.dot(inverse * row) +
      inverse_mass(*part.structure, skin_weights(t, part.index->surface(), t.at.point_a));
  return step_.found_for * step_.found_for * t.stiffness * compliance < 1;
}

/// Springs between structures: a node of one skin on its spring, whose own oscillation a longer step would
/// take the energy of, as long as they hold or meet with more than rattles [s].
double IslandStepper::skin_spring_limit(double ahead) const {
  constexpr double resolved_phase = 0.7;
  double fastest_sq = 0, brought = 0, rattles = 0;  // twice the energies
  for (const Touch& t : step_.touches) {
    if (t.b >= 0 || t.stiffness == 0 ||
        t.at.gap > 2 * ahead * std::max(0.0, -t.approach) + in_.scale.touch_gap())
      continue;
    const Structure& a = *in_.env.structures[static_cast<std::size_t>(t.a.index)].structure;
    const SurfaceWeights w = skin_weights(t, in_.skin(t.a.index), t.at.point_a);
    const double inverse =
        1 / in_.env.structures[static_cast<std::size_t>(t.b_structure)].structure->node_mass(t.b_node) +
        inverse_mass(a, w);
    if (!(inverse > 0)) continue;
    fastest_sq = std::max(fastest_sq, t.stiffness * inverse);
    brought += t.approach * t.approach / inverse + 2 * t.stored;
    rattles += in_.gentle_speed() * in_.gentle_speed() / inverse;
  }
  return brought > rattles ? resolved_phase / std::sqrt(fastest_sq) : std::numeric_limits<double>::infinity();
}

/// A block at a structure: its force rises within a quarter of the period of the block on all its springs, in
/// series with the touched cells, which a stiffer spring does not outrun [s]. Hard contacts have the cells
/// alone; they count for the blocks that bring energy: what they would give in stopping where they approach,
/// and what their force holds already, so that a piece that lies on the structure or moves along with it does
/// not count. What a step loses goes with its square: blocks with a part of the largest energy take as many
/// exchanges as the root of that part. On Hertz's law, which is never hard contact, the touched nodes are
/// resolved, too. `ahead`: a step within which an open contact would have to close to count [s].
double IslandStepper::rise_limit(double ahead) const {
  double limit =
      in_.island->surfaces.empty() ? std::numeric_limits<double>::infinity() : skin_spring_limit(ahead);
  if (step_.bodies.empty()) return limit;  // structures alone
  constexpr double resolved_phase = 0.95;  // conserving() asks for 1
  constexpr double fewest = 2;             // a step that still resolves the contact's own oscillation
  struct AtSkin {
    double stiffness = 0, hard = 0, approach = 0, stored = 0,
           fastest_sq = 0;  // hard: the part of hard contacts; fastest: of a node on Hertz's spring [1/s^2]
    Vec3 force = Vec3::Zero();
  };
  std::vector<AtSkin> skin(step_.bodies.size());
  double most = 0;  // twice the energy, as below
  for (const Body& b : step_.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    most = std::max(most, in_.model.blocks[k].mass * in_.state.v[k].squaredNorm());
  }
  constexpr double least = 0.01;  // of the largest energy
  const double rattles = in_.gentle_speed() * in_.gentle_speed() / least;
  for (const Touch& t : step_.touches) {
    if (t.b < 0 || !in_.deformable_structure(t)) continue;
    AtSkin& s = skin[static_cast<std::size_t>(in_.local[static_cast<std::size_t>(t.b)])];
    s.stored += 2 * t.stored;
    if (t.at.gap > 2 * ahead * std::max(0.0, -t.approach) + in_.scale.touch_gap()) continue;
    const StructurePart& part = in_.env.structures[static_cast<std::size_t>(t.a.index)];
    const double cell = part.structure->young() * face_edge(part.index->surface(), t.at.face_a);
    const double k = t.stiffness > 0 ? t.stiffness * cell / (t.stiffness + cell) : cell;
    s.stiffness += k;
    if (t.stiffness == 0)
      s.hard += k;
    else if (t.normal_law.relief > 0)
      s.fastest_sq = std::max(
          s.fastest_sq,
          t.stiffness * inverse_mass(*part.structure, skin_weights(t, part.index->surface(), t.at.point_a)));
    s.approach = std::max(s.approach, -t.approach);
    s.force += t.warm;
  }
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    AtSkin& s = skin[i];
    if (s.stiffness == 0) continue;
    const double mass = in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)].mass;
    const double brought = mass * s.approach * s.approach + s.force.squaredNorm() / s.stiffness;
    const bool sprung = s.stiffness > s.hard * (1 + contact::tolerances().same_stiffness);
    const double scale = std::max(
        most,
        sprung ? 0.0 : mass * rattles);  // debris that only rattles is at rest for the accuracy asked for
    const bool gentle = brought < least * scale;
    if (gentle && !sprung) continue;
    if (gentle) s.stiffness -= s.hard;
    const double energy =
        sprung ? mass * in_.state.v[static_cast<std::size_t>(step_.bodies[i].block)].squaredNorm() + s.stored
               : brought;
    const double part = scale > 0 ? std::min(1.0, std::sqrt(energy / scale)) : 1.0;
    const double exchanges = std::max(std::min<double>(fewest, in_.settings.exchanges_per_rise),
                                      part * in_.settings.exchanges_per_rise);
    limit = std::min(limit, 0.5 * M_PI * std::sqrt(mass / s.stiffness) / exchanges);
    if (s.fastest_sq > 0)
      limit = std::min(limit, resolved_phase / std::sqrt(s.fastest_sq + s.stiffness / mass));
  }
  return limit;
}

/// The rule without loss at a structure; where the step does not resolve the contact, the force at the end.
void IslandStepper::secant_row(Touch& t, contact::ProblemContact& c, double h, bool first_pass) {
  t.theta = 1;
  if (first_pass && !conserving(t, c, h)) t.mode = Mode::spring_end;
  if (t.mode == Mode::spring_secant) t.normal_law.begin_step(-t.at.gap);
  // p = h (F(x) - dashpot x velocity), h the mean of this step and the one before, F by its tangent: at the
  // indentation that the last force leads to, then at the one reached.
  const double warm = t.frame.col(0).dot(t.warm) * h;
  if (first_pass) t.indentation = -(t.gap_ref + h * normal_compliance(c) * std::max(0.0, warm));
  Tangent at = tangent_at_structure(t, h);
  if (!at.follows_law) {
    // Open as far as can be told: from zero, with the slope of the way it could still go.
    const double way = std::max(h * std::abs(t.u_ref), contact::tolerances().overlap_none * in_.scale.length);
    t.indentation = at.force = 0;
    at.slope =
        t.mode == Mode::spring_secant ? t.normal_law.work(way) / (way * way) : t.normal_law.force(way) / way;
    at.slope = std::max(at.slope, contact::tolerances().level_law * t.stiffness);
  } else if (t.indentation > 0 && at.slope < 1e-3 * t.stiffness) {
    // A level stretch of the law (crushing, or the hollow that it left) still needs a row: a hundredth of
    // what the bodies' inertia gives, so that round-off in it stays small.
    at.slope = std::max(at.slope, std::min(t.stiffness, 0.01 / (h * h * normal_compliance(c))));
  }
  const double share =
      t.mode == Mode::spring_secant ? 0.5 : 1;  // of the dashpot's velocity that is the end's
  const double lasts = lasts_at_structure(t, h);
  c.compliance[0] = 1 / (lasts * h * at.slope + share * lasts * t.dashpot);
  c.bias[0] =
      -c.compliance[0] * (lasts * at.force - lasts * at.slope * (t.gap_ref + t.indentation - h * t.u_ref) -
                          (1 - share) * lasts * t.dashpot * t.approach);
}

/// What an impulse of such a contact lasts for: from half step to half step, as the structure's own forces do
/// [s].
double IslandStepper::lasts_at_structure(const Touch& t, double h) const {
  return t.mode == Mode::spring_secant ? step_.between_half_steps(t, h) : h;
}

/// Force and tangent of such a contact's law over the step, where it ends at the touch's indentation.
IslandStepper::Tangent IslandStepper::tangent_at_structure(const Touch& t, double h) const {
  const double end = t.indentation,
               before = -t.at.gap +
                        step_.length_before(t, h) * t.approach;  // the latter: at the start of the last step
  Tangent at;
  if (t.mode == Mode::spring_end) {
    at.force = t.normal_law.force(std::max(end, 0.0));
    at.slope = t.normal_law.slope(end);
    at.follows_law = end > 0;
    return at;
  }
  at.force = t.normal_law.secant(before, end, at.slope);
  at.follows_law = end > 0 || before > 0;
  if (end <= 0 && before > 0) {
    // It comes out on the way from where it was a step ago, and gives back what it held there: no more than
    // the books of the half step in between leave it.
    at.force = std::min(at.force, 2 * std::max(0.0, t.stored - t.sheared) / (before - end));
    at.slope = std::max(at.force / (before - end), contact::tolerances().level_law * t.stiffness);
  }
  return at;
}

/// Whether the impulse of such a contact is its law's at the indentation reached, to `allowed` of it.
bool IslandStepper::follows_law(const Touch& t, double h, double allowed) const {
  const contact::ProblemContact& c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
  const double u = t.u_ref - (t.indentation + t.gap_ref) / h;  // at the end [m/s]
  const Tangent at = tangent_at_structure(t, h);
  const double damped = t.dashpot * (t.mode == Mode::spring_secant ? 0.5 * (t.approach + u) : u);
  const double asked = std::max(0.0, lasts_at_structure(t, h) * ((at.follows_law ? at.force : 0.0) - damped));
  return std::abs(c.impulse[0] - asked) <=
         allowed * (c.impulse[0] + h * t.stiffness * contact::tolerances().follows_law * in_.scale.length);
}

/// Shear spring by the same rule as the normal one; `moved` (frame) is what its ends move apart where the
/// velocity is u_ref. At a point of a structure that the step resolves its force is that of the mean of the
/// elongations a step before and a step after, p = -k (h_- + h_+)/2 (s_nm + s_np)/2: the secant of a linear
/// law, without loss.
void IslandStepper::shear_row(Touch& t, contact::ProblemContact& c, double h, const Vec3& moved,
                              const Vec3& u_ref) {
  const Vec3 d = t.frame.transpose() * t.shear,
             way = t.frame.transpose() *
                   t.shear_way;  // elongation at the start, and what the step before added
  t.shears_by_half = t.mode == Mode::spring_secant && in_.deformable_structure(t) && !t.normal_law.bed &&
                     h * h * t.shear_stiffness * normal_compliance(c) < 1;
  for (int i = 1; i < 3; ++i) {
    if (t.shears_by_half) {
      c.compliance[i] = 2 / (step_.between_half_steps(t, h) * h * t.shear_stiffness);
      c.bias[i] = (2 * d[i] - way[i] + moved[i]) / h - u_ref[i];
    } else if (t.mode == Mode::spring_mean) {
      c.compliance[i] = 4 / (h * h * t.shear_stiffness);
      c.bias[i] = 2 * (2 * d[i] + moved[i]) / h - u_ref[i];
    } else {
      c.compliance[i] = 1 / (h * h * t.shear_stiffness);
      c.bias[i] = (d[i] + moved[i]) / h - u_ref[i];
    }
  }
}

bool IslandStepper::gives_way(const Touch& t) const {
  const contact::ProblemContact& c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
  const double least = c.friction > 0 ? std::min(c.tension, c.cohesion / c.friction) : c.tension;
  if (c.cohesion > 0 && at_coulomb_bound(c, c.impulse)) return true;  // slid
  return least > 0 ? c.impulse[0] <= -least * (1 - contact::tolerances().at_bound) : c.impulse.isZero(0);
}

double IslandStepper::normal_energy_at_end(const Touch& t) const {
  if (t.indentation < 0 && t.pulls()) return gives_way(t) ? 0 : pull_energy(t, t.indentation);
  const double end =
      t.normal_law.stored(std::max(0.0, t.indentation));  // also while a dashpot holds it back from pressing
  // A leapfrog's energy is that of the half step: the mean of both ends.
  if (t.mode == Mode::spring_secant) return 0.5 * (t.normal_law.stored(-t.at.gap) + end);
  return end;
}

double IslandStepper::spring_energy_at_end(const Touch& t, double h) const {
  return normal_energy_at_end(t) + shear_energy_at_end(t, h);
}

/// A leapfrog's energy is that of the half step: the mean of both ends.
double IslandStepper::shear_energy_at_end(const Touch& t, double h) const {
  if (t.shear_stiffness == 0) return 0;
  const Vec3 end = shear_at_end(t, h);
  if (!t.shears_by_half) return 0.5 * t.shear_stiffness * end.squaredNorm();
  return 0.25 * t.shear_stiffness * (end.squaredNorm() + (end - shear_way(t, h)).squaredNorm());
}

/// By which the step has stretched the shear spring; none where it let go.
Vec3 IslandStepper::shear_way(const Touch& t, double h) const {
  if (!t.shears_by_half || t.impulse.isZero(0)) return Vec3::Zero();
  return shear_at_end(t, h) - t.shear;
}

Vec3 IslandStepper::shear_at_end(const Touch& t, double h) const {
  // Mean (or end) force over the step names the elongation; sliding shortens it to what friction holds.
  const contact::ProblemContact& c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
  const Vec3 force = t.frame.col(1) * c.impulse[1] + t.frame.col(2) * c.impulse[2];
  const Vec3 held = -force / ((t.shears_by_half ? step_.between_half_steps(t, h) : h) * t.shear_stiffness);
  const bool slides = at_coulomb_bound(c, c.impulse);
  if (t.shears_by_half) return slides ? held : Vec3(2 * held - (t.shear - t.shear_way));
  if (t.mode != Mode::spring_mean) return held;
  const Vec3 end = 2 * held - t.shear;
  if (!slides) return end;
  // The mean of a force that follows friction's limit is the limit's mean; at the end it is the limit's end.
  const double longest =
      (c.friction * std::max(0.0, t.normal_law.force(t.indentation)) + c.cohesion / h) / t.shear_stiffness;
  if (!(c.impulse[0] > 0) || end.dot(held) <= 0) return Vec3::Zero();
  return end * std::min(1.0, longest / end.norm());
}

}  // namespace talus::coupling
