// Rows of the contact problem: frames, Jacobians at mid-step, biases by mode.
#include "coupling/rows/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "contact/narrow/narrow_math.hpp"
#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/rows/rolling.hpp"
#include "coupling/rows/spring_rows.hpp"
#include "coupling/step/update.hpp"
#include "coupling/structures/condensed.hpp"
#include "coupling/structures/leapfrog.hpp"
#include "coupling/touch/crossed_edges.hpp"
#include "coupling/touch/touch_spring.hpp"

namespace talus::coupling {

/// Where a contact is at mid-step and at the end, carried by the bodies that own its normal and its points.
struct ContactPath {
  const Body* a = nullptr;  // null: fixed, or a structure
  const Body* b = nullptr;
  bool structure = false;   // A is one whose surface moves
  bool from_start = false;  // the impulse is one of the start
  Vec3 n_mid, n_end;        // normal
  Vec3 p_mid, p_end;        // where the impulse acts
  Vec3 a_end, b_end;        // points of both sides
  Mat3 turned, turned_on;   // of the frame: from the start to mid-step, from there to the end
};

/// Velocities of both sides of a contact in its frame, B against A, and where A ends.
struct RowMotion {
  Vec3 u_ref = Vec3::Zero();     // J v_ref [m/s]
  Vec3 u_before = Vec3::Zero();  // by the velocities at the start that work is accounted with [m/s]
  Vec3 u_skin = Vec3::Zero();    // the part of a structure's surface [m/s]
  Vec3 a_end;
  bool stretches = false;  // a shear spring by the mean of both velocities
  bool by_mean = false;    // the impulse works by the mean of both velocities
};
namespace {

/// The point of a skin that weights name.
Vec3 on_nodes(const Structure& structure, const SurfaceWeights& w) {
  Vec3 x = Vec3::Zero();
  for (int i = 0; i < w.count; ++i)
    x += w.weight[static_cast<std::size_t>(i)] *
         structure.skin().node_position(w.node[static_cast<std::size_t>(i)]);
  return x;
}

/// Where springs act within the step its impulses do not all act from its start: x + h v^+ holds for blocks
/// of the springs' end rule alone.
bool onsets_by_trapezoid(const Step& step, const Body* a, const Body& b) {
  return step.sprung && !(b.end_rule && (a == nullptr || a->end_rule));
}

ContactPath path_of(const IslandContext& in, const Step& step, const Touch& t) {
  ContactPath path;
  const Body& body_b = step.bodies[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)])];
  const Body* body_a = nullptr;
  if (t.a.kind == Partner::Kind::block) {
    const int l = in.local[static_cast<std::size_t>(t.a.index)];
    if (l >= 0) body_a = &step.bodies[static_cast<std::size_t>(l)];
  }
  path.a = body_a, path.b = &body_b;
  path.structure = in.moving_surface(t.a);
  // Normal and point at mid-step and at the end, carried by the bodies that own them.
  Pose fixed_pose;
  if (t.a.kind == Partner::Kind::block && body_a == nullptr) fixed_pose = dda::pose(in.state, t.a.index);
  const NormalOwner owner =
      normal_owner(t, in.model, in.env, body_a != nullptr ? &body_a->start : &fixed_pose);
  const Body* carrier = owner == NormalOwner::a ? body_a : owner == NormalOwner::b ? &body_b : nullptr;
  path.from_start = in.leapfrog() && t.stiffness > 0;
  Vec3 &n_mid = path.n_mid, &n_end = path.n_end, &p_mid = path.p_mid, &p_end = path.p_end;
  n_mid = n_end = t.at.normal;
  if (carrier != nullptr) {
    if (!path.from_start) n_mid = carrier->half_turn * t.at.normal;
    n_end = carrier->full_turn * t.at.normal;
  }
  const auto mid_of = [&](const Body* b, const Vec3& x) {
    return b != nullptr && !path.from_start ? b->at_mid(x) : x;
  };
  const auto end_of = [](const Body* b, const Vec3& x) { return b != nullptr ? b->at_end(x) : x; };
  const Vec3 b_mid = mid_of(&body_b, t.at.point_b), b_end = end_of(&body_b, t.at.point_b);
  const Vec3 a_mid = mid_of(body_a, t.at.point_a), a_end_body = end_of(body_a, t.at.point_a);
  path.a_end = a_end_body, path.b_end = b_end;
  p_mid = acts_between(owner, a_mid, b_mid);
  p_end = owner == NormalOwner::a ? b_end : owner == NormalOwner::b ? a_end_body : 0.5 * (a_end_body + b_end);
  path.turned = carrier != nullptr ? carrier->half_turn : Mat3::Identity();
  path.turned_on = path.turned;
  if (owner == NormalOwner::edges && in.island->structures.empty()) {
    if (const auto edges = crossed_edges(t, in.model, in.env, body_a != nullptr ? body_a->start : fixed_pose,
                                         body_b.start)) {
      const auto at_mid = [](const Body* b, const Vec3& d) {
        return b != nullptr ? Vec3(b->half_turn * d) : d;
      };
      const auto at_end = [](const Body* b, const Vec3& d) { return b != nullptr ? Vec3(b->carry * d) : d; };
      const EdgeMeeting mid =
          meet(a_mid, at_mid(body_a, edges->a), b_mid, at_mid(&body_b, edges->b), t.at.normal);
      const EdgeMeeting end =
          meet(a_end_body, at_end(body_a, edges->a), b_end, at_end(&body_b, edges->b), t.at.normal);
      n_mid = mid.normal, p_mid = mid.between();
      n_end = end.normal, p_end = end.between();
      path.turned = Quat::FromTwoVectors(t.at.normal, n_mid).toRotationMatrix();
      path.turned_on = Quat::FromTwoVectors(n_mid, n_end).toRotationMatrix();
    }
  }
  return path;
}

/// What the row bears: friction at mid-step, cohesion, tension, and the ground in the way.
void set_strength(const IslandContext& in, Touch& t, contact::ProblemContact& c, double h, const Vec3& u_ref,
                  bool at_structure) {
  c.friction = friction_now(in.state, t, 0.5 * h * u_ref.tail<2>().norm());  // at mid-step
  const bool apart = at_structure && !t.glued &&
                     t.at.gap > in.scale.near_gap();  // rows at a structure reach ahead of what touches
  if (!apart) {
    c.cohesion = t.cohesion() * h;
    c.tension = t.tension() * h;
  }
  t.ploughing = 0;
  if (t.width > 0) {
    t.ploughing = h * ploughing(t, u_ref.tail<2>().norm());
    c.cohesion += t.ploughing;
  }
}

/// A gap that may close within the step: g + h u_n >= 0 at its end.
void onset_row(const IslandContext& in, Touch& t, contact::ProblemContact& c, const ContactPath& path,
               double h, bool first_pass, const Vec3& u_ref) {
  // At a structure what is bonded stays where it is, and an overlap is left to the correction.
  const double end = !path.structure ? 0.0 : t.glued ? t.at.gap : std::min(0.0, t.at.gap);
  c.bias[0] = (t.gap_ref - end) / h - u_ref[0];
  if (!first_pass) c.bias.tail<2>().setZero();
  if (path.structure) return;
  // The step ends at x + h v^+ (apply): what the linearisation's own displacement has beyond h v_ref is
  // taken off. A crossing is projected, never pushed.
  const auto beyond = [&](const Body& b) { return Vec3(b.ref.c - b.start.c - h * b.v_ref.head<3>()); };
  Vec3 ahead = beyond(*path.b);
  if (path.a != nullptr) ahead -= beyond(*path.a);
  c.bias[0] = std::max(0.0, c.bias[0] - path.n_end.dot(ahead) / h);
  // What closes within the step as it moves is thrown back at its start, -e u, and flies on from there.
  if (t.at.gap + h * t.approach < 0 && rebounds(in, t)) {
    const auto flown = [](const Body& b) { return Vec3((b.free.velocity - b.v0).head<3>()); };
    const Vec3 falls = path.a != nullptr ? Vec3(flown(*path.b) - flown(*path.a)) : flown(*path.b);
    c.bias[0] = t.law->restitution_at(t.approach) * t.approach - path.n_end.dot(falls);
  }
}

/// A spring by its law about the end of the last pass, at the mean of the step or at its end.
void spring_row(const IslandContext& in, Touch& t, contact::ProblemContact& c, const ContactPath& path,
                double h, bool first_pass, const Vec3& u_ref) {
  // The law about the indentation reached by the last pass: force + slope (x - x_last), x = -gap_ref -
  // theta h (u - u_ref).
  const bool mean = t.mode == Mode::spring_mean;
  t.theta = mean ? 0.5 : 1;
  // At a condensed step the indentation follows the velocity at the end, whatever the rule of the
  // positions.
  const bool by_rate = path.structure && in.condensed && !mean;
  if (by_rate) t.gap_ref = t.at.gap + h * u_ref[0];
  if (first_pass) t.indentation = -t.gap_ref;
  double slope = t.normal_law.slope(t.indentation);
  const bool balanced =
      !mean && !first_pass && !path.structure && (path.b->follows || (path.a != nullptr && path.a->follows));
  const double force = mean       ? mean_force(t, slope)
                       : balanced ? t.balanced_force
                                  : t.normal_law.force(t.indentation);
  slope = std::max(
      slope, contact::tolerances().level_law * t.stiffness);  // a level stretch of the law still needs a row
  const double spring = t.theta * h * h * slope, dashpot = t.theta * h * t.dashpot;
  c.compliance[0] = 1 / (spring + dashpot);
  c.bias[0] = c.compliance[0] * (h * slope * (t.gap_ref + t.indentation) - h * force - spring * u_ref[0] +
                                 (mean ? dashpot * t.approach : 0.0));
}

/// The shear spring is stretched by the way of the point that its force acts at, by the velocities that tell
/// the force's work: a depth inside the other side, what turns moves another way.
void add_shear(const IslandContext& in, const Step& step, Touch& t, contact::ProblemContact& c,
               const ContactPath& path, const RowMotion& m, double h) {
  if (!(t.shear_stiffness > 0 && c.friction + c.cohesion > 0) ||
      (t.mode != Mode::spring_mean && t.mode != Mode::spring_end && t.mode != Mode::spring_secant))
    return;
  const bool by_rates = path.from_start || !path.structure || (in.condensed && t.mode == Mode::spring_end);
  const Vec3 way = m.stretches ? Vec3(0.5 * (m.u_before + m.u_ref)) : m.u_ref;
  shear_row(in, step, t, c, h,
            by_rates ? Vec3(h * way)
                     : Vec3(t.frame.transpose() * ((path.b_end - t.at.point_b) - (m.a_end - t.at.point_a))),
            m.u_ref);
}

}  // namespace

void write_jacobian(double* to, const Mat3& frame, const Vec3& arm, const Mat3& strain_map,
                    const Mat3& rotation, int ndof, double sign) {
  Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic>> j(to, 3, ndof);
  const Mat3 ft = sign * frame.transpose();
  j.leftCols<3>() = ft;
  j.middleCols<3>(3) = -ft * skew(arm);
  if (ndof < 12) return;
  const Vec3 X = strain_map * arm;
  for (int k = 0; k < 6; ++k) {
    Vec6 e = Vec6::Zero();
    e[k] = 1;
    j.col(6 + k) = ft * (rotation * (dda::strain_tensor(e) * X));
  }
}

NormalOwner normal_owner(const Touch& t, const dda::Model& model, const Environment& env,
                         const Pose* pose_a) {
  if (t.a.kind == Partner::Kind::plane || (t.glued && t.bonded.area > 0)) return NormalOwner::a;
  // Edges found across each other by their own search: a face that they border may press on an area with
  // them, but does not carry their normal.
  const bool of_edges =
      contact::form_of(t.at.key) == contact::Form::edge_edge && (t.at.face_a < 0 || t.on_edge);
  if (of_edges && (t.a.kind != Partner::Kind::structure ||
                   env.structures[static_cast<std::size_t>(t.a.index)].fixed_surface))
    return NormalOwner::edges;
  if (t.at.face_a < 0) return t.at.face_b >= 0 ? NormalOwner::b : NormalOwner::edges;
  if (t.at.face_b < 0 && t.a.kind == Partner::Kind::block) return NormalOwner::a;
  // Both sides name a face: the normal belongs to the one it is parallel to, A first.
  Vec3 face;
  if (t.a.kind == Partner::Kind::block) {
    const Polyhedron& shape = *model.blocks[static_cast<std::size_t>(t.a.index)].shape;
    face = pose_a->F.inverse().transpose() * shape.face_normals[static_cast<std::size_t>(t.at.face_a)];
  } else {
    const TriangleSurface& s = t.a.kind == Partner::Kind::terrain
                                   ? env.terrain->surface()
                                   : env.structures[static_cast<std::size_t>(t.a.index)].index->surface();
    const auto& tri = s.triangles[static_cast<std::size_t>(t.at.face_a)];
    const Vec3& v0 = s.vertices[static_cast<std::size_t>(tri[0])];
    face = (s.vertices[static_cast<std::size_t>(tri[1])] - v0)
               .cross(s.vertices[static_cast<std::size_t>(tri[2])] - v0);
  }
  if (t.at.normal.cross(face).norm() <= contact::tolerances().true_edge * face.norm()) return NormalOwner::a;
  return t.at.face_b >= 0 ? NormalOwner::b : NormalOwner::edges;
}

RowAssembly::RowAssembly(const IslandContext& in, Step& step) : in_(in), step_(step) {}

void RowAssembly::clear() {
  step_.problem.clear();
  step_.nodes.clear();
  node_places_.clear();
  step_.held.clear();
}

Vec3 RowAssembly::add_structure_terms(int row, int structure, const SurfaceWeights& w, const Mat3& frame,
                                      double sign, Vec3& u_ref, std::span<const Vec3> tilt) {
  if (surfaces_stand_) return Vec3::Zero();
  if (in_.condensed) return add_condensed_terms(row, structure, w, frame, sign, u_ref);
  const Structure& s = *in_.env.structures[static_cast<std::size_t>(structure)].structure;
  Vec3 velocity = Vec3::Zero();
  for (int i = 0; i < w.count; ++i) {
    const int node = w.node[static_cast<std::size_t>(i)];
    const double weight = w.weight[static_cast<std::size_t>(i)];
    if (weight == 0 && tilt.empty()) continue;
    const Vec3 v_hat = s.skin().predicted_velocity(node),
               aside = tilt.empty() ? Vec3(Vec3::Zero()) : tilt[static_cast<std::size_t>(i)];
    velocity += weight * v_hat + frame.col(0).dot(v_hat) * aside;
    const double mass = s.skin().node_mass(node);
    if (!std::isfinite(mass)) {
      step_.held.push_back({structure, node, row, sign * weight, sign * aside});
      continue;
    }
    const auto [place, fresh] = node_places_.place(structure, node);
    if (fresh) step_.nodes.push_back({structure, node, v_hat, s.skin().node_velocity(node), mass});
    const int offset = static_cast<int>(step_.problem.jacobians.size());
    const Mat3 j = sign * frame.transpose() * (weight * Mat3::Identity() + aside * frame.col(0).transpose());
    step_.problem.jacobians.insert(step_.problem.jacobians.end(), j.data(), j.data() + 9);
    step_.problem.terms.push_back({static_cast<int>(step_.bodies.size()) + place, offset});
  }
  u_ref += sign * (frame.transpose() * velocity);
  return velocity;
}

void RowAssembly::add_surface_row(Touch& t, double h, bool first_pass) {
  t.normal = t.at.normal;
  t.frame = contact_frame(t.normal);
  t.row = static_cast<int>(step_.problem.contacts.size());
  contact::ProblemContact c;
  c.first_term = static_cast<int>(step_.problem.terms.size());
  Vec3 u_ref = Vec3::Zero();
  Vec3 a = Vec3::Zero();
  if (t.a.kind == Partner::Kind::structure) {
    const TriangleSurface& skin = in_.env.structures[static_cast<std::size_t>(t.a.index)].index->surface();
    const SurfaceWeights face = surface_weights(skin, t.at.face_a, t.at.point_a);
    // The face's side goes along with the face to where the node is, g away along its normal, which turns by
    // n' = -sum grad N_i (n . v_i): together they may turn as one, and friction over a gap or a depth makes
    // no moment.
    std::array<Vec3, 12> tilt = weight_gradients(skin, t.at.face_a, face);
    for (Vec3& aside : tilt) aside *= -(t.at.point_b - t.at.point_a).dot(t.normal);
    a = add_structure_terms(t.row, t.a.index, face, t.frame, -1, u_ref, tilt);
  }
  SurfaceWeights node;
  node.count = 1, node.node[0] = t.b_node, node.weight[0] = 1;
  const Vec3 b = add_structure_terms(t.row, t.b_structure, node, t.frame, 1, u_ref);
  c.terms = static_cast<int>(step_.problem.terms.size()) - c.first_term;
  c.friction = friction_now(in_.state, t);
  if (!t.broken) {
    c.cohesion = t.law->cohesion * t.at.area * h;
    c.tension = t.law->tension * t.at.area * h;
  }
  t.theta = 1;
  t.u_ref = u_ref[0];
  t.gap_ref = t.at.gap + h * t.normal.dot(b - a);
  if (t.mode == Mode::end)
    c.bias[0] = (t.gap_ref - std::min(0.0, t.at.gap)) / h - t.u_ref;
  else
    secant_row(in_, step_, t, c, h, first_pass);
  if (t.shear_stiffness > 0 && t.mode != Mode::end && c.friction + c.cohesion > 0)
    shear_row(in_, step_, t, c, h, t.frame.transpose() * (h * (b - a)), u_ref);
  c.impulse = first_pass ? Vec3(h * (t.frame.transpose() * t.warm)) : t.impulse;
  step_.problem.contacts.push_back(c);
}

void RowAssembly::begin(bool surfaces_stand) {
  surfaces_stand_ = surfaces_stand;
  if (in_.island->structures.empty()) {
    std::vector<double> jacobians = std::move(step_.problem.jacobians);
    step_.problem.clear();
    step_.problem.jacobians = std::move(jacobians);
  } else {
    step_.problem.clear();
  }
  jacobians_ = 0;
  step_.nodes.clear();
  node_places_.clear();
  step_.held.clear();
}

void RowAssembly::place_row(Touch& t) {
  t.row = static_cast<int>(step_.problem.contacts.size());
  contact::ProblemContact& c = step_.problem.contacts.emplace_back();
  c.first_term = static_cast<int>(step_.problem.terms.size());
  if (in_.moving_surface(t.a)) return;
  for (const int block : {t.a.kind == Partner::Kind::block ? t.a.index : -1, t.b}) {
    const int body = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)];
    if (body < 0) continue;
    step_.problem.terms.push_back({body, static_cast<int>(jacobians_)});
    jacobians_ += 3 * static_cast<std::size_t>(step_.bodies[static_cast<std::size_t>(body)].ndof);
  }
  c.terms = static_cast<int>(step_.problem.terms.size()) - c.first_term;
}

void RowAssembly::add_row(Touch& t, double h, bool first_pass) {
  if (t.b < 0) return add_surface_row(t, h, first_pass);
  jacobians_ = step_.problem.jacobians.size();
  place_row(t);
  step_.problem.jacobians.resize(jacobians_);
  fill_row(t, h, first_pass);
}

void RowAssembly::take(Touch& t, double h, bool first_pass) {
  if (in_.island->structures.empty())
    place_row(t);
  else
    add_row(t, h, first_pass);
}

void RowAssembly::fill_rows(double h, bool first_pass) {
  if (!in_.island->structures.empty()) return;
  step_.problem.jacobians.resize(jacobians_);
  step_.each_touch([&](Touch& t) {
    if (t.row >= 0) fill_row(t, h, first_pass);
  });
}

/// Jacobian of both sides at the place where the impulse acts, with the velocities that it makes of theirs.
RowMotion RowAssembly::add_terms(Touch& t, contact::ProblemContact& c, const ContactPath& path, double h) {
  RowMotion m;
  m.a_end = path.a_end;
  m.stretches = t.shear_stiffness > 0 && t.mode == Mode::spring_mean && !path.structure;
  m.by_mean = in_.condensed && t.stiffness == 0;
  // Both sides act at one point, so that friction over a gap makes no moment.
  Vec3 p_mid_a = path.p_mid, p_mid_b = path.p_mid;
  // Structure: both sides at the same point of its face, so that traction times gap makes no moment.
  SurfaceWeights face;
  if (path.structure) {
    const TriangleSurface& skin = in_.env.structures[static_cast<std::size_t>(t.a.index)].index->surface();
    face = skin_weights(t, skin, in_.condensed ? p_mid_b : t.at.point_a);
    t.acts_at = t.at.point_a;
    if (in_.condensed || t.normal_law.bed)
      t.acts_at = on_nodes(*in_.env.structures[static_cast<std::size_t>(t.a.index)].structure, face);
    p_mid_a = p_mid_b = t.acts_at;
  }
  int next = c.first_term;
  const auto add_body = [&](const Body& b, const Vec3& p, double sign) {
    double* j =
        step_.problem.jacobians.data() + step_.problem.terms[static_cast<std::size_t>(next++)].jacobian;
    // Positions at the end by theta: about the point that keeps the angular momentum, c_n + (1 - theta)
    // (c_np - c_n).
    write_jacobian(j, t.frame, p - (in_.leapfrog() ? b.start.c : b.about),
                   b.start.F.inverse() * b.half_turn.transpose(), b.half_turn * b.rotation0, b.ndof, sign);
    const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>> rows(j, 3, b.ndof);
    m.u_ref += rows * b.v_ref.head(b.ndof);
    if (!m.stretches && !m.by_mean) return;
    Vec12 before = b.v0;
    before.segment<3>(3) = b.free.spin;
    m.u_before += rows * before.head(b.ndof);
  };
  if (path.a != nullptr) add_body(*path.a, p_mid_a, -1);
  if (path.structure) {
    const Vec3 before = m.u_ref, mean = add_structure_terms(t.row, t.a.index, face, t.frame, -1, m.u_ref);
    m.a_end += h * mean;
    m.u_skin = m.u_ref - before;
    if (in_.condensed) m.u_before -= 2 * (t.frame.transpose() * mean) + m.u_skin;
    next = static_cast<int>(step_.problem.terms.size());
    step_.problem.terms.push_back(
        {static_cast<int>(path.b - step_.bodies.data()), static_cast<int>(step_.problem.jacobians.size())});
    step_.problem.jacobians.resize(step_.problem.jacobians.size() +
                                   3 * static_cast<std::size_t>(path.b->ndof));
    c.terms = next + 1 - c.first_term;
  }
  add_body(*path.b, p_mid_b, 1);

  // The spring of a block that strains goes by the way of the point that its impulse acts at, as the
  // impulse's work does: one as deep aside as the spring is strained otherwise.
  Vec3 aside = Vec3::Zero();
  if (goes_by_its_row(in_, t)) {
    const auto beyond = [](const Body& b, const Vec3& acts, const Vec3& x) {
      return Vec3((b.at_end(acts) - acts) - (b.at_end(x) - x));
    };
    if (path.b->strains()) aside += beyond(*path.b, p_mid_b, t.at.point_b);
    if (path.a != nullptr && path.a->strains()) aside -= beyond(*path.a, p_mid_a, t.at.point_a);
  }
  t.gap_ref = path.n_end.dot(path.b_end - m.a_end + aside) + t.offset;
  t.u_ref = m.u_ref[0];
  return m;
}

void RowAssembly::fill_row(Touch& t, double h, bool first_pass) {
  const ContactPath path = path_of(in_, step_, t);
  t.normal = path.n_mid;
  t.frame = contact_frame(path.n_mid);
  contact::ProblemContact c = step_.problem.contacts[static_cast<std::size_t>(t.row)];
  const RowMotion m = add_terms(t, c, path, h);
  // Velocity at the end of the linearisation, at the true end configuration and in the carried frame.
  Vec3 u_end = m.u_ref;
  const bool by_trapezoid =
      t.mode == Mode::end && (in_.condensed || onsets_by_trapezoid(step_, path.a, *path.b));
  if (t.mode == Mode::closed || by_trapezoid) {
    Vec3 relative = path.b->velocity_at_end(path.p_end);
    if (path.a != nullptr) relative -= path.a->velocity_at_end(path.p_end);
    u_end = (path.turned_on * t.frame).transpose() * relative + m.u_skin;
  }
  // So that (u + slip)/2, u by the row, is the velocity whose product with the impulse is its work.
  if (m.by_mean) t.slip = t.frame * (m.u_before - (u_end - m.u_ref));
  set_strength(in_, t, c, h, m.u_ref, path.structure);
  switch (t.mode) {
    case Mode::closed:
      t.theta = in_.leapfrog() ? 1 : 0.5;
      c.bias = u_end - m.u_ref;
      // An opening left by the drift may close; a crossing is projected, never pushed.
      if (in_.scale.left_open(t) && !t.holds())
        c.bias[0] += std::min(0.5 * t.at.gap / h, in_.scale.closing_speed());
      break;
    case Mode::end: {
      t.theta = 1;
      if (by_trapezoid) {
        t.theta = 0.5;
        c.bias = u_end - m.u_ref;
        if (!t.glued) c.bias[0] += approach_left(in_, step_, t, h);
        break;
      }
      onset_row(in_, t, c, path, h, first_pass, m.u_ref);
      break;
    }
    case Mode::spring_mean:
    case Mode::spring_end: spring_row(in_, t, c, path, h, first_pass, m.u_ref); break;
    case Mode::spring_secant: secant_row(in_, step_, t, c, h, first_pass); break;
    case Mode::idle: break;
  }
  add_shear(in_, step_, t, c, path, m, h);
  t.slip_row = t.frame.rightCols<2>().transpose() * (m.by_mean ? t.slip : Vec3(path.turned * t.slip));
  if (t.swings) c.bias.tail<2>() += t.slip_row;
  if (!t.rolls) c.impulse = first_pass ? Vec3(h * (t.frame.transpose() * t.warm)) : t.impulse;
  step_.problem.contacts[static_cast<std::size_t>(t.row)] = c;
}

void RowAssembly::assemble(double h, bool time_stepped, bool first_pass) {
  begin();
  std::size_t pair = 0;  // touches follow the order of the pairs
  for (Touch& t : step_.touches) {
    t.row = -1;
    if (first_pass) {
      while (pair < step_.ahead.size() &&
             !(in_.island->pairs[pair].a == t.a && in_.island->pairs[pair].b == t.b))
        ++pair;
      t.mode = Mode::idle;
      const bool at_structure = in_.deformable_structure(t);
      if (t.stiffness > 0) {
        t.mode = t.spring;
      } else if (at_structure) {
        if (t.at.gap + h * t.approach < contact::tolerances().structure_near * in_.scale.length)
          t.mode = Mode::end;
      } else if (t.holds() && (time_stepped || t.persistent || t.approach <= slow_speed(in_, t))) {
        t.mode = Mode::closed;  // its points stay together: they part by the error of the last step
      } else if (t.at.gap <= in_.scale.touch_gap() ||
                 (t.at.gap <= in_.scale.near_gap() &&
                  std::abs(t.approach) <= (time_stepped ? slow_speed(in_, t) : impact_speed(in_, t)))) {
        const double resting =
            time_stepped && t.at.gap <= in_.scale.touch_gap()
                ? 1e-3 * in_.model.gravity.norm() * h + contact::tolerances().still * in_.scale.speed
                : std::max(slow_speed(in_, t), (t.persistent ? contact::tolerances().pressed_still
                                                             : contact::tolerances().still) *
                                                   in_.scale.speed);
        if (t.approach > resting)
          t.mode = time_stepped ? Mode::end : Mode::idle;
        else if ((t.approach < -resting && time_stepped) || (step_.settling && t.approach > 0))
          t.mode = Mode::end;
        else
          t.mode = Mode::closed;
      } else if (pair < step_.meets_to_rebound.size() && step_.meets_to_rebound[pair] != 0) {
        continue;  // the step ends before it closes
      } else if (time_stepped &&
                 (t.met || (pair < step_.ahead.size() && step_.ahead[pair] > 0) ||
                  t.at.gap + h * t.approach - h * h * in_.model.gravity.norm() < in_.scale.row_reach())) {
        t.mode = Mode::end;  // others cannot close within the step, are met by its solution, or are caught by
                             // the projection
      }
    }
    if (t.mode != Mode::idle) take(t, h, first_pass);
  }
  // Steps with an onset go by x + h v^+ (apply), and their moments about where they start.
  const bool sprung =
      std::ranges::any_of(step_.touches, [](const Touch& t) { return t.row >= 0 && t.stiffness > 0; });
  if (!sprung && in_.island->structures.empty())
    mark_reached(
        in_, step_, [](const Touch&) { return true; },
        [&](const Touch& t) { return t.mode == Mode::end && t.at.gap + h * t.approach < 0; },
        [](Body& b) { b.about = b.start.c; });
  fill_rows(h, first_pass);
  add_rolling_rows(in_, step_);
  limit_rolling(step_,
                [&](const Touch& t) { return first_pass ? h * t.frame.col(0).dot(t.warm) : t.impulse[0]; });
  double mass = 0;
  for (const Body& b : step_.bodies) mass += in_.model.blocks[static_cast<std::size_t>(b.block)].mass;
  add_held_rows(step_.problem, in_.model, step_.bodies, h,
                1e6 * mass * (in_.scale.speed + h * in_.model.gravity.norm()));
  add_rocking_rows(in_, step_, h, first_pass);
  finish_bodies();
}

void RowAssembly::finish_bodies() {
  // Blocks first, then structure nodes.
  pool_.clear();
  pool_offset_.clear();
  step_.problem.bodies.clear();
  step_.problem.v_hat.clear();
  int offset = 0;
  std::size_t entries = 0;
  for (const Body& b : step_.bodies) {
    contact::ProblemBody p;
    p.ndof = b.ndof;
    p.offset = offset;
    offset += b.ndof;
    pool_offset_.push_back(entries);
    entries += 2 * static_cast<std::size_t>(b.ndof) * static_cast<std::size_t>(b.ndof);
    step_.problem.bodies.push_back(p);
  }
  pool_.resize(entries);
  step_.problem.v_hat.resize(static_cast<std::size_t>(offset));
  contact::in_ranges(static_cast<int>(step_.bodies.size()), bodies_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Body& b = step_.bodies[static_cast<std::size_t>(i)];
      const int n = b.ndof;
      double* const m = pool_.data() + pool_offset_[static_cast<std::size_t>(i)];
      Eigen::Map<MatX>(m, n, n) = b.free.mass.topLeftCorner(n, n);
      Eigen::Map<MatX>(m + n * n, n, n) = b.free.inverse.topLeftCorner(n, n);
      Eigen::Map<VecX> v_hat(
          step_.problem.v_hat.data() + step_.problem.bodies[static_cast<std::size_t>(i)].offset, n);
      v_hat = b.free.velocity.head(n);
      if (b.follows && n == 12) v_hat += b.free.inverse.rightCols<6>() * b.strain_lag;
    }
  });
  for (const NodeBody& n : step_.nodes) {
    contact::ProblemBody p;
    p.ndof = 3;
    p.offset = offset;
    offset += 3;
    pool_offset_.push_back(pool_.size());
    const std::array<bool, 3> held =
        in_.env.structures[static_cast<std::size_t>(n.structure)].structure->skin().node_held(n.node);
    for (int pass = 0; pass < 2; ++pass)
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) {
          // A held direction moves as if its mass were beyond all others.
          const double m = held[static_cast<std::size_t>(c)] ? 1e12 * n.mass : n.mass;
          pool_.push_back(r != c ? 0 : pass == 0 ? m : 1 / m);
        }
    for (int i = 0; i < 3; ++i) step_.problem.v_hat.push_back(n.v_hat[i]);
    step_.problem.bodies.push_back(p);
  }
  for (const CondensedSurface& s : step_.condensed_surfaces) {
    contact::ProblemBody p;
    p.ndof = static_cast<int>(s.inverse.rows());
    p.offset = offset;
    offset += p.ndof;
    pool_offset_.push_back(pool_.size());
    pool_.insert(pool_.end(), s.inverse.data(), s.inverse.data() + s.inverse.size());
    step_.problem.v_hat.insert(step_.problem.v_hat.end(), s.v_hat.data(), s.v_hat.data() + s.v_hat.size());
    step_.problem.bodies.push_back(p);
  }
  for (std::size_t i = 0; i < step_.problem.bodies.size(); ++i) {
    const int n = step_.problem.bodies[i].ndof;
    const bool skin = i >= step_.bodies.size() + step_.nodes.size();
    step_.problem.bodies[i].mass = skin ? nullptr : pool_.data() + pool_offset_[i];
    step_.problem.bodies[i].mass_inverse = pool_.data() + pool_offset_[i] + (skin ? 0 : n * n);
  }
}

Vec3 RowAssembly::add_condensed_terms(int row, int structure, const SurfaceWeights& w, const Mat3& frame,
                                      double sign, Vec3& u_ref) {
  const auto skin = std::find_if(step_.condensed_surfaces.begin(), step_.condensed_surfaces.end(),
                                 [&](const CondensedSurface& s) { return s.structure == structure; });
  Vec3 mean = Vec3::Zero(), end = Vec3::Zero();
  std::size_t at = 0;
  const int offset = static_cast<int>(step_.problem.jacobians.size());
  if (skin != step_.condensed_surfaces.end()) {
    at = step_.problem.jacobians.size();
    step_.problem.jacobians.resize(at + 9 * skin->node.size(), 0.0);
    step_.problem.terms.push_back(
        {static_cast<int>(step_.bodies.size() +
                          static_cast<std::size_t>(skin - step_.condensed_surfaces.begin())),
         offset});
  }
  for (int i = 0; i < w.count; ++i) {
    const int node = w.node[static_cast<std::size_t>(i)];
    const double weight = w.weight[static_cast<std::size_t>(i)];
    if (weight == 0) continue;
    const auto found = skin == step_.condensed_surfaces.end()
                           ? std::vector<int>::const_iterator{}
                           : std::lower_bound(skin->node.cbegin(), skin->node.cend(), node);
    if (skin == step_.condensed_surfaces.end() || found == skin->node.cend() || *found != node) {
      step_.held.push_back({structure, node, row, sign * weight});
      continue;
    }
    const auto k = static_cast<Eigen::Index>(found - skin->node.cbegin());
    Eigen::Map<Mat3>(step_.problem.jacobians.data() + at + 9 * static_cast<std::size_t>(k)) +=
        sign * weight * frame.transpose();
    end += weight * skin->v_hat.segment<3>(3 * k);
    mean += 0.5 * weight * (skin->v_hat.segment<3>(3 * k) + skin->v_before.segment<3>(3 * k));
  }
  u_ref += sign * (frame.transpose() * end);
  return mean;
}

}  // namespace talus::coupling
