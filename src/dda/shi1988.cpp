#include "dda/shi1988.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "dda/shi1988_contacts.hpp"
#include "dda/shi1988_matrices.hpp"
#include "dda/shi1988_substep.hpp"

namespace talus::dda {
namespace {

using namespace shi1988;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

void take_over(const Shi1988Settings& settings, const Surroundings& s, const State& state,
               Shi1988State& history) {
  for (int i = static_cast<int>(history.map.size()); i < state.size(); ++i) {
    history.map.push_back(pose(state, i).F);
    const auto [young, poisson] = elasticity(settings, s.model.blocks[at(i)]);
    history.stress.push_back(elastic_matrix(young, poisson) *
                             rotate_strain(state.eps[at(i)], state.rotation(i)));
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

Shi1988Report Shi1988::step(const Model& model, State& state, Shi1988State& history,
                            const std::vector<Plane>& planes,
                            const std::vector<const contact::SurfaceIndex*>& surfaces,
                            const ContactLaws& laws, double dt) const {
  const Surroundings surroundings{model, planes, surfaces, laws};
  take_over(settings_, surroundings, state, history);
  Shi1988Report report;
  report.smallest_substep = dt;

  double remaining = dt;
  double h = history.next_step > 0 ? std::min(dt, history.next_step) : dt;
  const double smallest = settings_.smallest_step * dt;
  while (remaining > 0) {
    // No splinter of a step at the end.
    if (h >= remaining * (1 - 1e-9))
      h = remaining;
    else if (2 * h > remaining)
      h = 0.5 * remaining;

    SubStep sub(surroundings, settings_, state, history, report);
    double margin = sub.margin(h);
    sub.find_contacts(margin);
    const double allowed = settings_.displacement_ratio > 0
                               ? settings_.displacement_ratio * history.half_height
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
    const std::size_t told = report.loads.size();
    sub.commit(h);
    for (std::size_t k = told; k < report.loads.size(); ++k)
      report.loads[k].time = h >= remaining ? dt : dt - (remaining - h);
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
  lines.push_back(fmt::format(
      "dda-1988: 12 degrees of freedom per block, open-close iteration at most {} times, Eq. (4) {}",
      settings_.iteration_cap, settings_.post_correction ? "on" : "off"));
  int rigid = 0;
  for (const auto& b : model.blocks) rigid += !b.fixed && !(b.young > 0);
  if (rigid > 0)
    lines.push_back(fmt::format(
        "dda-1988: {} blocks without Young's modulus are given {:.3g} Pa: the scheme knows no rigid block",
        rigid, settings_.rigid_young));
  bool hard = false, restitution = false, other = false;
  for (const auto& law : laws.law) {
    hard = hard || law.stiffness == ContactLaw::Stiffness::hard;
    restitution = restitution || law.restitution || law.restitution_tangential;
    other = other || law.kind != ContactLaw::Kind::linear || law.damping_ratio > 0 ||
            law.rolling_resistance > 0 || law.drilling_resistance > 0 || law.changes_with_way() ||
            law.vegetation_drag > 0;
  }
  if (hard)
    lines.push_back(
        settings_.penalty > 0
            ? fmt::format("dda-1988: hard contact becomes springs of {:.3g} N/m", settings_.penalty)
            : std::string("dda-1988: hard contact becomes springs of ten times the number of the softer "
                          "Young's modulus"));
  if (restitution)
    lines.push_back(
        "dda-1988: restitution is not used; the rebound is what the time step makes of the springs");
  if (other)
    lines.push_back(
        "dda-1988: contact damping, rolling and drilling resistance, slip_friction, vegetation and laws "
        "other than linear are not used");
  return lines;
}

void Shi1988State::save(std::vector<double>& out) const {
  out.insert(out.end(), {static_cast<double>(map.size()), static_cast<double>(contacts.size()),
                         contact_energy, next_step, half_height, static_cast<double>(steps)});
  for (const Mat3& a : map) out.insert(out.end(), a.data(), a.data() + 9);
  for (const Vec6& s : stress) out.insert(out.end(), s.data(), s.data() + 6);
  for (const Shi1988Contact& c : contacts) {
    for (const std::int32_t k : {c.partner, c.a, c.b, c.status, c.bonded, c.face_a}) out.push_back(k);
    out.push_back(static_cast<double>(c.key >> 32));  // halves: a double holds 53 bits
    out.push_back(static_cast<double>(c.key & 0xffffffffu));
    for (const Vec3& v : {c.point, c.normal, c.shear, c.slip, c.force})
      out.insert(out.end(), v.data(), v.data() + 3);
    out.push_back(c.area);
    out.push_back(c.gap);
  }
}

std::size_t Shi1988State::restore(std::span<const double> in) {
  std::size_t k = 0;
  const auto next = [&] {
    return k < in.size() ? in[k++] : throw NumericalFailure("dda-1988: checkpoint too short");
  };
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
  for (Shi1988Contact& c : contacts) {
    for (std::int32_t* v : {&c.partner, &c.a, &c.b, &c.status, &c.bonded, &c.face_a})
      *v = static_cast<std::int32_t>(next());
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
