#include "dda/shi1988_substep.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "dda/shi1988_matrices.hpp"

namespace talus::dda::shi1988 {
namespace {

using Contact = Shi1988Contact;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

SubStep::SubStep(const Surroundings& s, const Shi1988Settings& settings, State& state, Shi1988State& history,
                 Shi1988Report& report)
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

double SubStep::margin(double h) const {
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

double SubStep::drawn() const {
  double widest = 0;
  for (const Contact& c : history_.contacts)
    if (c.bonded != 0) widest = std::max(widest, c.gap);
  return widest;
}

void SubStep::find_contacts(double margin) {
  contacts_.build(s_, state_, history_, settings_, margin);
  system_.set_pattern(n_, contacts_.number_pairs(), settings_.direct_limit);
  island_contacts_.assign(at(system_.islands()), {});
  for (std::size_t k = 0; k < contacts_.list.size(); ++k) {
    const auto& c = contacts_.list[k];
    island_contacts_[at(system_.island_of(c.dof_b >= 0 ? c.dof_b : c.dof_a))].push_back(k);
  }
}

bool SubStep::iterate(double h) {
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

double SubStep::largest_displacement() const {
  double d = 0;
  for (int i = 0; i < n_; ++i) {
    const Model::Block& b = s_.model.blocks[at(i)];
    if (b.fixed) continue;
    const Vec12& D = D_[at(i)];
    if (!D.allFinite())
      throw NumericalFailure(
          fmt::format("dda-1988: block {}: the solution of Eq. (9) is not finite", b.name));
    d = std::max(d, D.head<3>().norm() + b.shape->radius * (D.segment<3>(3).norm() + D.tail<6>().norm()));
  }
  return d;
}

int SubStep::inverted() const {
  for (int i = 0; i < n_; ++i) {
    const Vec12& D = D_[at(i)];
    if (s_.model.blocks[at(i)].fixed) continue;
    if (!(step_map(D.segment<3>(3), D.tail<6>(), settings_.post_correction).determinant() > 0)) return i;
  }
  return -1;
}

void SubStep::commit(double h) {
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

double SubStep::fixed_point_stiffness(const Model::Block& b) const {
  if (settings_.fixed_point_penalty > 0) return settings_.fixed_point_penalty;
  return default_penalty(settings_, elasticity(settings_, b).first, elasticity(settings_, b).first);
}

void SubStep::prepare(double h) {
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
      f.noalias() -= k * T.transpose() * (state_.c[at(i)] + x - b.fixed_points_world[p]);
    }
  }
}

void SubStep::solve(int island, double h) {
  for (const int i : system_.island_blocks(island)) {
    system_.diagonal[at(i)] = base_[at(i)];
    system_.rhs[at(i)] = base_force_[at(i)];
  }
  for (const int p : system_.island_pairs(island)) system_.coupling[at(p)].setZero();
  for (const std::size_t c : island_contacts_[at(island)]) assemble(contacts_.list[c], h, system_);
  system_.solve(island);
  for (const int i : system_.island_blocks(island)) D_[at(i)] = system_.solution[at(i)];
}

void SubStep::book_contacts(double h) {
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
      if (c.used.status == Contact::sliding)
        (ft.dot(c.step_shear) > 0 ? report_.friction_drove : report_.friction_work) -= ft.dot(c.step_shear);
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
    if (r.partner == Contact::surface && !f.isZero(0))
      report_.loads.push_back({.surface = r.a,
                               .block = r.b,
                               .time = 0,
                               .dt = h,
                               .point = r.point,
                               .force = -f,
                               .normal = n,
                               .area = r.area});
    history_.contacts.push_back(r);
  }
  report_.geometry += history_.contact_energy - start;
  history_.contact_energy = end;
  report_.contacts = static_cast<int>(contacts_.list.size());
  report_.closed = closed;
}

double SubStep::fixed_energy_at_start(int i) const {
  const Model::Block& b = s_.model.blocks[at(i)];
  if (b.fixed) return 0;
  double e = 0;
  for (std::size_t p = 0; p < b.fixed_points.size(); ++p)
    e += 0.5 * fixed_point_stiffness(b) *
         (state_.c[at(i)] + history_.map[at(i)] * b.fixed_points[p] - b.fixed_points_world[p]).squaredNorm();
  return e;
}

double SubStep::book_fixed_points(int i) {
  const Model::Block& b = s_.model.blocks[at(i)];
  double end = 0;
  const double k = b.fixed_points.empty() ? 0 : fixed_point_stiffness(b);
  for (std::size_t p = 0; p < b.fixed_points.size(); ++p) {
    const Vec3 x = history_.map[at(i)] * b.fixed_points[p];
    const Vec3 u = transformation(x) * D_[at(i)];
    end += 0.5 * k * (state_.c[at(i)] + x + u - b.fixed_points_world[p]).squaredNorm();
    report_.newmark_contact += 0.5 * k * u.squaredNorm();
  }
  return end;
}

}  // namespace talus::dda::shi1988
