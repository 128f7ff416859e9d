#include "dda/shi1988.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "dda/shi1988_contacts.hpp"
#include "dda/shi1988_matrices.hpp"
#include "dda/shi1988_system.hpp"

namespace talus::dda {
namespace {

using namespace shi1988;
using Contact = Shi1988Contact;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// One sub-step: everything that is derived at its start and used by the tries at it.
class SubStep {
 public:
  SubStep(const Surroundings& s, const Shi1988Settings& settings, State& state, Shi1988State& history, Shi1988Report& report)
      : s_(s), settings_(settings), state_(state), history_(history), report_(report), n_(state.size()) {
    M_.resize(at(n_));
    v0_.resize(at(n_));
    base_.resize(at(n_));
    D_.assign(at(n_), Vec12::Zero());
    for (int i = 0; i < n_; ++i) {
      const Model::Block& b = s.model.blocks[at(i)];
      const Mat3& A = history.map[at(i)];
      v0_[at(i)].setZero();
      if (b.fixed) continue;
      M_[at(i)] = mass_matrix(b.mass, A * b.second_moment * A.transpose());
      v0_[at(i)] << state.v[at(i)], state.w[at(i)], rotate_strain(state.eps_rate[at(i)], state.rotation(i));
    }
  }

  /// Margin of the contact search: twice the largest displacement that the velocities foretell, from where bonds have been drawn to.
  double margin(double h) const {
    double largest = 0, size = 0;
    for (int i = 0; i < n_; ++i) {
      const Model::Block& b = s_.model.blocks[at(i)];
      size = std::max(size, b.shape->radius);
      if (b.fixed) continue;
      const double reach = b.shape->radius * (v0_[at(i)].segment<3>(3).norm() + v0_[at(i)].tail<6>().norm());
      largest = std::max(largest, h * (state_.v[at(i)].norm() + reach) + 0.5 * h * h * s_.model.gravity.norm());
    }
    double skin = 0;
    for (const auto* surface : s_.surfaces)
      for (const Vec3& v : surface->surface().velocities) skin = std::max(skin, v.norm());
    return 2 * std::max(largest, h * skin) + 1e-6 * size + drawn();
  }

  /// Widest gap that a bond holds [m].
  double drawn() const {
    double widest = 0;
    for (const Contact& c : history_.contacts)
      if (c.bonded != 0) widest = std::max(widest, c.gap);
    return widest;
  }

  void find_contacts(double margin) {
    contacts_.build(s_, state_, history_, settings_, margin);
    system_.set_pattern(n_, contacts_.number_pairs(), settings_.direct_limit);
    island_contacts_.assign(at(system_.islands()), {});
    for (std::size_t k = 0; k < contacts_.list.size(); ++k) {
      const auto& c = contacts_.list[k];
      island_contacts_[at(system_.island_of(c.dof_b >= 0 ? c.dof_b : c.dof_a))].push_back(k);
    }
  }

  /// The open-close iteration. True if it settled within the cap.
  bool iterate(double h) {
    contacts_.reset();
    prepare(h);
    std::vector<char> stale(at(system_.islands()), 1);
    const double tolerance = 1e-7 * history_.half_height;  // of the slip, as in Shi's program
    for (int k = 0; k < settings_.iteration_cap; ++k) {
      ++report_.iterations;
      bool settled = true;
      for (int island = 0; island < system_.islands(); ++island) {
        if (!stale[at(island)]) continue;
        solve(island, h);
        bool sliding = false, changed = false;
        for (const std::size_t c : island_contacts_[at(island)]) {
          WorkingContact& w = contacts_.list[c];
          const StatusChange change = update_status(w, D_, h, tolerance, settings_.relock_loaded);
          if (change.opened_or_closed || (settings_.settle_shear && change.locked_or_slid)) settled = false;
          changed = changed || change.opened_or_closed || change.locked_or_slid;
          sliding = sliding || w.status == Contact::sliding;
        }
        stale[at(island)] = changed || sliding;  // a solve with the same springs and forces would give the same
      }
      const bool more = std::any_of(stale.begin(), stale.end(), [](char c) { return c != 0; });
      if (settled && (k + 1 >= settings_.least_iterations || !more)) return true;
    }
    return false;
  }

  /// Largest displacement of any vertex, bounded by the block's radius.
  double largest_displacement() const {
    double d = 0;
    for (int i = 0; i < n_; ++i) {
      const Model::Block& b = s_.model.blocks[at(i)];
      if (b.fixed) continue;
      const Vec12& D = D_[at(i)];
      if (!D.allFinite()) throw NumericalFailure(fmt::format("dda-1988: block {}: the solution of Eq. (9) is not finite", b.name));
      d = std::max(d, D.head<3>().norm() + b.shape->radius * (D.segment<3>(3).norm() + D.tail<6>().norm()));
    }
    return d;
  }

  /// A block that the step would turn inside out, -1 if none.
  int inverted() const {
    for (int i = 0; i < n_; ++i) {
      const Vec12& D = D_[at(i)];
      if (s_.model.blocks[at(i)].fixed) continue;
      if (!(step_map(D.segment<3>(3), D.tail<6>(), settings_.post_correction).determinant() > 0)) return i;
    }
    return -1;
  }

  void commit(double h) {
    book_contacts(h);
    double fixed_energy = 0;
    for (int i = 0; i < n_; ++i) {
      const Model::Block& b = s_.model.blocks[at(i)];
      if (b.fixed) continue;
      Mat3& A = history_.map[at(i)];
      const Vec12& D = D_[at(i)];
      const auto [young, poisson] = elasticity(settings_, b);
      const Mat6 C = elastic_matrix(young, poisson);
      const double volume = b.volume * A.determinant();
      fixed_energy += book_fixed_points(i);

      const Vec6 stress = history_.stress[at(i)] + C * D.tail<6>();
      report_.newmark_strain += 0.5 * volume * D.tail<6>().dot(C * D.tail<6>());
      const Vec12 v1 = 2 / h * D - v0_[at(i)];
      const double kinetic = 0.5 * v1.dot(M_[at(i)] * v1);
      const double strain = volume * energy_density(stress, young, poisson);

      A = step_map(D.segment<3>(3), D.tail<6>(), settings_.post_correction) * A;
      history_.stress[at(i)] = stress;
      state_.c[at(i)] += D.head<3>();
      const Mat3 R = polar_rotation(A);
      const Mat3 U = R.transpose() * A - Mat3::Identity();
      state_.q[at(i)] = Quat(R).normalized();
      state_.eps[at(i)] << U(0, 0), U(1, 1), U(2, 2), 2 * U(1, 2), 2 * U(2, 0), 2 * U(0, 1);
      state_.v[at(i)] = v1.head<3>();
      state_.w[at(i)] = v1.segment<3>(3);
      state_.eps_rate[at(i)] = rotate_strain(v1.tail<6>(), state_.rotation(i).transpose());

      // The next step takes M and the volume from the new shape.
      const Mat12 M = mass_matrix(b.mass, A * b.second_moment * A.transpose());
      report_.shape += kinetic - 0.5 * v1.dot(M * v1) + strain * (1 - b.volume * A.determinant() / volume);
    }
    history_.contact_energy += fixed_energy;
    history_.steps += 1;
  }

 private:
  double fixed_point_stiffness(const Model::Block& b) const {
    if (settings_.fixed_point_penalty > 0) return settings_.fixed_point_penalty;
    return default_penalty(settings_, elasticity(settings_, b).first, elasticity(settings_, b).first);
  }
  static const Vec3& fixed_target(const Model::Block& b, std::size_t k) { return b.fixed_points_world[k]; }

  /// Matrices without contact, Eqs. (5) to (8).
  void prepare(double h) {
    base_force_.resize(at(n_));
    for (int i = 0; i < n_; ++i) {
      const Model::Block& b = s_.model.blocks[at(i)];
      if (b.fixed) {
        base_[at(i)].setIdentity();
        base_force_[at(i)].setZero();
        continue;
      }
      const Mat3& A = history_.map[at(i)];
      const auto [young, poisson] = elasticity(settings_, b);
      const double volume = b.volume * A.determinant();
      base_[at(i)] = 2 / (h * h) * M_[at(i)];
      base_[at(i)].bottomRightCorner<6, 6>() += volume * elastic_matrix(young, poisson);
      Vec12& f = base_force_[at(i)];
      f.noalias() = 2 / h * (M_[at(i)] * v0_[at(i)]);
      f.head<3>() += b.mass * s_.model.gravity;
      f.tail<6>() -= volume * history_.stress[at(i)];  // initial stress
      const double k = fixed_point_stiffness(b);
      for (std::size_t p = 0; p < b.fixed_points.size(); ++p) {
        const Vec3 x = A * b.fixed_points[p];
        const Mat3x12 T = transformation(x);
        base_[at(i)].noalias() += k * T.transpose() * T;
        f.noalias() -= k * T.transpose() * (state_.c[at(i)] + x - fixed_target(b, p));
      }
    }
  }

  void solve(int island, double h) {
    for (const int i : system_.island_blocks(island)) {
      system_.diagonal[at(i)] = base_[at(i)];
      system_.rhs[at(i)] = base_force_[at(i)];
    }
    for (const int p : system_.island_pairs(island)) system_.coupling[at(p)].setZero();
    for (const std::size_t c : island_contacts_[at(island)]) assemble(contacts_.list[c], h, system_);
    system_.solve(island);
    for (const int i : system_.island_blocks(island)) D_[at(i)] = system_.solution[at(i)];
  }

  /// Energies of the contact springs and the work they did, each from force and displacement.
  void book_contacts(double h) {
    double start = 0, end = 0;
    for (int i = 0; i < n_; ++i) start += fixed_energy_at_start(i);
    history_.contacts.clear();
    int closed = 0;
    for (WorkingContact& c : contacts_.list) {
      start += c.energy0;
      const Vec3& n = c.record.normal;
      const Vec3 f = c.force();
      const double fn = n.dot(f), dn = c.gap - c.gap0;
      const Vec3 ft = f - fn * n;
      const bool pressed = c.used.status != Contact::open;
      const double gap = pressed ? c.gap : std::min(0.0, c.gap);
      const double end_normal = 0.5 * c.kn * gap * gap;
      const double start_normal = c.energy0 - c.energy0_shear;
      report_.newmark_contact += start_normal - end_normal - fn * dn;
      double end_shear = 0;
      if (c.used.status == Contact::locked) {
        end_shear = 0.5 * c.ks * (c.used.reference + c.step_shear).squaredNorm();
        report_.newmark_contact += c.energy0_shear - end_shear - ft.dot(c.step_shear);
      } else {
        report_.newmark_contact += c.energy0_shear;  // the shear spring was taken away
        if (c.used.status == Contact::sliding) report_.friction_work -= ft.dot(c.step_shear);
      }
      report_.partner_work += h * f.dot(c.partner_velocity);
      end += end_normal + end_shear;
      if (c.gap < 0) report_.max_penetration = std::max(report_.max_penetration, -c.gap);
      if (pressed) ++closed;

      Contact& r = c.record;
      r.status = c.status;
      r.gap = c.gap;
      r.shear = c.status == Contact::locked ? Vec3(c.reference + c.step_shear) : Vec3(Vec3::Zero());
      r.slip = c.status == Contact::open ? Vec3(Vec3::Zero()) : c.slip;
      r.force = f;
      if (c.status != Contact::locked) r.bonded = 0;
      history_.contacts.push_back(r);
    }
    report_.geometry += history_.contact_energy - start;
    history_.contact_energy = end;
    report_.contacts = static_cast<int>(contacts_.list.size());
    report_.closed = closed;
  }

  double fixed_energy_at_start(int i) const {
    const Model::Block& b = s_.model.blocks[at(i)];
    if (b.fixed) return 0;
    double e = 0;
    for (std::size_t p = 0; p < b.fixed_points.size(); ++p)
      e += 0.5 * fixed_point_stiffness(b) *
           (state_.c[at(i)] + history_.map[at(i)] * b.fixed_points[p] - fixed_target(b, p)).squaredNorm();
    return e;
  }

  /// Books what the springs of the fixed points lost; returns their energy at the end of the step.
  double book_fixed_points(int i) {
    const Model::Block& b = s_.model.blocks[at(i)];
    double end = 0;
    const double k = b.fixed_points.empty() ? 0 : fixed_point_stiffness(b);
    for (std::size_t p = 0; p < b.fixed_points.size(); ++p) {
      const Vec3 x = history_.map[at(i)] * b.fixed_points[p];
      const Vec3 u = transformation(x) * D_[at(i)];
      end += 0.5 * k * (state_.c[at(i)] + x + u - fixed_target(b, p)).squaredNorm();
      report_.newmark_contact += 0.5 * k * u.squaredNorm();
    }
    return end;
  }

  Surroundings s_;
  const Shi1988Settings& settings_;
  State& state_;
  Shi1988State& history_;
  Shi1988Report& report_;
  int n_;
  std::vector<Mat12> M_, base_;
  std::vector<Vec12> v0_, base_force_, D_;
  ContactList contacts_;
  BlockSystem system_;
  std::vector<std::vector<std::size_t>> island_contacts_;
};

void take_over(const Shi1988Settings& settings, const Surroundings& s, const State& state, Shi1988State& history) {
  for (int i = static_cast<int>(history.map.size()); i < state.size(); ++i) {
    history.map.push_back(pose(state, i).F);
    const auto [young, poisson] = elasticity(settings, s.model.blocks[at(i)]);
    history.stress.push_back(elastic_matrix(young, poisson) * rotate_strain(state.eps[at(i)], state.rotation(i)));
  }
  if (history.half_height > 0) return;
  history.half_height = settings.half_height;
  if (history.half_height > 0) return;
  Box3 box;
  double radius = 0;
  for (int i = 0; i < state.size(); ++i) {
    const auto& shape = *s.model.blocks[at(i)].shape;
    box.extend(contact::bounds(shape, Shi1988::pose(state, history, i)));
    radius = std::max(radius, shape.radius);
  }
  for (const auto* surface : s.surfaces) box.extend(surface->bounds());
  history.half_height = box.isEmpty() ? 1.0 : std::max(0.5 * box.sizes().maxCoeff(), radius);
}

}  // namespace

Pose Shi1988::pose(const State& state, const Shi1988State& history, int i) {
  if (at(i) >= history.map.size()) return dda::pose(state, i);
  return {state.c[at(i)], history.map[at(i)]};
}

Shi1988Report Shi1988::step(const Model& model, State& state, Shi1988State& history, const std::vector<Plane>& planes,
                            const std::vector<const contact::SurfaceIndex*>& surfaces, const ContactLaws& laws, double dt) const {
  const Surroundings surroundings{model, planes, surfaces, laws};
  take_over(settings_, surroundings, state, history);
  Shi1988Report report;
  report.smallest_substep = dt;

  double remaining = dt;
  double h = history.next_step > 0 ? std::min(dt, history.next_step) : dt;
  const double smallest = settings_.smallest_step * dt;
  while (remaining > 0) {
    // No splinter of a step at the end.
    if (h >= remaining * (1 - 1e-9)) h = remaining;
    else if (2 * h > remaining) h = 0.5 * remaining;

    SubStep sub(surroundings, settings_, state, history, report);
    double margin = sub.margin(h);
    sub.find_contacts(margin);
    const double allowed = settings_.displacement_ratio > 0 ? settings_.displacement_ratio * history.half_height
                                                            : std::numeric_limits<double>::infinity();
    bool settled = false;
    for (;;) {
      settled = sub.iterate(h);
      const int inverted = sub.inverted();
      const bool may_cut = h > smallest * (1 + 1e-9);
      const double displacement = sub.largest_displacement();
      if ((!settled || inverted >= 0) && may_cut) {
        h = std::max(smallest, h * settings_.step_cut);
      } else if (inverted >= 0) {
        throw NumericalFailure(fmt::format("dda-1988: block {} would turn inside out in a step of {:.3g} s",
                                           model.blocks[at(inverted)].name, h));
      } else if (displacement > 3 * allowed && may_cut) {
        h = std::max(smallest, h / std::sqrt(displacement / allowed));
      } else if (2 * displacement > margin * (1 + 1e-9)) {
        margin = 2.5 * displacement;  // went further than foretold: the list may lack contacts
        sub.find_contacts(margin);
        continue;
      } else {
        break;
      }
      ++report.step_cuts;
    }
    report.max_displacement = std::max(report.max_displacement, sub.largest_displacement());
    sub.commit(h);
    ++report.substeps;
    if (!settled) ++report.unsettled;
    report.smallest_substep = std::min(report.smallest_substep, h);
    remaining = h >= remaining ? 0 : remaining - h;
    const double grown = h * settings_.step_growth;
    history.next_step = grown < dt ? grown : 0;
    h = std::min(grown, dt);
  }

  for (int i = 0; i < state.size(); ++i) {
    const Model::Block& b = model.blocks[at(i)];
    report.potential -= b.mass * model.gravity.dot(state.c[at(i)]);
    if (b.fixed) continue;
    const Mat3& A = history.map[at(i)];
    Vec12 v;
    v << state.v[at(i)], state.w[at(i)], rotate_strain(state.eps_rate[at(i)], state.rotation(i));
    report.kinetic += 0.5 * v.dot(mass_matrix(b.mass, A * b.second_moment * A.transpose()) * v);
    const auto [young, poisson] = elasticity(settings_, b);
    report.strain += b.volume * A.determinant() * energy_density(history.stress[at(i)], young, poisson);
  }
  report.contact = history.contact_energy;
  return report;
}

std::vector<std::string> Shi1988::plan(const Model& model, const ContactLaws& laws) const {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("dda-1988: 12 degrees of freedom per block, open-close iteration at most {} times, Eq. (4) {}",
                              settings_.iteration_cap, settings_.post_correction ? "on" : "off"));
  int rigid = 0;
  for (const auto& b : model.blocks) rigid += !b.fixed && !(b.young > 0);
  if (rigid > 0)
    lines.push_back(fmt::format("dda-1988: {} blocks without Young's modulus are given {:.3g} Pa: the scheme knows no rigid block",
                                rigid, settings_.rigid_young));
  bool hard = false, restitution = false, other = false;
  for (const auto& law : laws.law) {
    hard = hard || law.stiffness == ContactLaw::Stiffness::hard;
    restitution = restitution || law.restitution || law.restitution_tangential;
    other = other || law.kind != ContactLaw::Kind::linear || law.damping_ratio > 0 || law.rolling_resistance > 0;
  }
  if (hard)
    lines.push_back(settings_.penalty > 0
                        ? fmt::format("dda-1988: hard contact becomes springs of {:.3g} N/m", settings_.penalty)
                        : std::string("dda-1988: hard contact becomes springs of ten times the number of the softer Young's modulus"));
  if (restitution) lines.push_back("dda-1988: restitution is not used; the rebound is what the time step makes of the springs");
  if (other) lines.push_back("dda-1988: contact damping, rolling resistance and laws other than linear are not used");
  return lines;
}

void Shi1988State::save(std::vector<double>& out) const {
  out.insert(out.end(), {static_cast<double>(map.size()), static_cast<double>(contacts.size()), contact_energy, next_step,
                         half_height, static_cast<double>(steps)});
  for (const Mat3& a : map) out.insert(out.end(), a.data(), a.data() + 9);
  for (const Vec6& s : stress) out.insert(out.end(), s.data(), s.data() + 6);
  for (const Contact& c : contacts) {
    for (const std::int32_t k : {c.partner, c.a, c.b, c.status, c.bonded, c.face_a}) out.push_back(k);
    out.push_back(static_cast<double>(c.key >> 32));  // halves: a double holds 53 bits
    out.push_back(static_cast<double>(c.key & 0xffffffffu));
    for (const Vec3& v : {c.point, c.normal, c.shear, c.slip, c.force}) out.insert(out.end(), v.data(), v.data() + 3);
    out.push_back(c.area);
    out.push_back(c.gap);
  }
}

std::size_t Shi1988State::restore(std::span<const double> in) {
  std::size_t k = 0;
  const auto next = [&] { return k < in.size() ? in[k++] : throw NumericalFailure("dda-1988: checkpoint too short"); };
  const auto blocks = static_cast<std::size_t>(next()), points = static_cast<std::size_t>(next());
  contact_energy = next();
  next_step = next();
  half_height = next();
  steps = static_cast<std::int64_t>(next());
  map.assign(blocks, Mat3::Zero());
  stress.assign(blocks, Vec6::Zero());
  contacts.assign(points, {});
  for (Mat3& a : map)
    for (int j = 0; j < 9; ++j) a.data()[j] = next();
  for (Vec6& s : stress)
    for (int j = 0; j < 6; ++j) s[j] = next();
  for (Contact& c : contacts) {
    for (std::int32_t* v : {&c.partner, &c.a, &c.b, &c.status, &c.bonded, &c.face_a}) *v = static_cast<std::int32_t>(next());
    const auto high = static_cast<std::uint64_t>(next());
    c.key = (high << 32) | static_cast<std::uint64_t>(next());
    for (Vec3* v : {&c.point, &c.normal, &c.shear, &c.slip, &c.force})
      for (int j = 0; j < 3; ++j) (*v)[j] = next();
    c.area = next();
    c.gap = next();
  }
  return k;
}

}  // namespace talus::dda
