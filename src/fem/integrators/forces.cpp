#include "fem/integrators/forces.hpp"

#include "fem/materials/material_simd.hpp"

namespace talus::fem {

namespace {
// Nodal vectors hold three components and a zero: one node is one vector of the processor.
using material::V4, material::load4;

/// Of these nodes those that a cell holds or that have mass.
std::vector<NodeRange> living(const std::vector<NodeRange>& nodes, const StructureBody& body) {
  std::vector<char> lives(body.mass.size(), 0);
  for (const auto& [first, last] : nodes)
    for (int n = first; n < last; ++n) lives[n] = body.cells_at_node[n] > 0 || body.mass[n] > 0;
  return ranges_of(lives);
}
}  // namespace

void Forces::moved() {
  body_.discretisation.distribute(fields_.u);
  body_.discretisation.distribute(fields_.v);
  valid_ = false;
  ++fields_.revision;
}

/// Weight and prescribed loads. The weight is written anew where it may differ: at all nodes once masses have
/// changed, else at the loads'.
void Forces::load(double t) {
  factors_.clear();
  for (const PatchLoad& load : body_.loads) factors_.push_back(load.factor(t));
  load(factors_);
}

void Forces::load(std::span<const double> factors) {
  const auto weigh = [&](int i) {
    for (int c = 0; c < 3; ++c) fields_.f_ext[4 * i + c] = body_.mass[i] * body_.gravity[c];
  };
  if (!weights_valid_)
    for (int i = 0; i < static_cast<int>(body_.mass.size()); ++i) weigh(i);
  weights_valid_ = true;
  for (const PatchLoad& load : body_.loads)
    for (int i : load.node) weigh(i);
  for (std::size_t l = 0; l < body_.loads.size(); ++l) {
    const PatchLoad& load = body_.loads[l];
    if (factors[l] == 0) continue;
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) fields_.f_ext[4 * load.node[k] + c] += factors[l] * load.force[k][c];
  }
}

void Forces::evaluate(double t) {
  if (!valid_) {
    accepted_ = false;
    const bool measures = body_.finite || body_.damage;
    const auto clear = [&](AlignedVector& f) {
      for (const auto& [first, last] : body_.touched)
        std::fill(f.begin() + 4L * first, f.begin() + 4L * last, 0.0);
    };
    clear(fields_.f_int);
    if (body_.damage)
      for (int cell : body_.damage->drop_unaccepted()) body_.elements->set_on(cell, body_.live[cell]);
    const ElasticLimits limits = body_.damage ? body_.damage->elastic_limits() : ElasticLimits{};
    body_.elements->add_internal_force(fields_.u.data(), fields_.f_int.data(), body_.finite, measures,
                                       body_.damage ? &limits : nullptr);
    if (body_.damage) {
      const Motion motion{fields_.u.data(), fields_.v.data(), fields_.h_last, body_.spec.rate_effect};
      body_.damage->add_forces(motion, fields_.f_int.data());
      // An element below the bound cannot have reached a threshold anywhere; the others are asked.
      body_.elements->cells_above(limits.energy, candidates_);
      for (int cell : candidates_) {
        if (!body_.damage->try_cell(cell, motion, fields_.f_int.data())) continue;
        body_.elements->add_internal_force_of({cell}, fields_.u.data(), fields_.f_int.data(), body_.finite,
                                              -1);
        body_.elements->set_on(cell, false);
      }
      clear(fields_.f_visc);
      body_.elements->add_bulk_viscosity(fields_.u.data(), fields_.v.data(), fields_.f_visc.data(),
                                         body_.spec.density, body_.wave_speed);
    }
    if (measures) {
      stored_ = body_.elements->total_energy() + (body_.damage ? body_.damage->stored() : 0);
    } else {
      V4 twice{};
      for (const auto& [first, last] : body_.own)
        for (int i = 4 * first; i < 4 * last; i += 4)
          twice += load4(&fields_.u[i]) * load4(&fields_.f_int[i]);
      stored_ = 0.5 * material::sum_of(twice);
    }
    if (body_.bars) {
      body_.bars->add_forces(fields_.u.data(), fields_.h_last, body_.live, fields_.f_int.data());
      stored_ += body_.bars->stored();
    }
    if (body_.bearings) {
      body_.bearings->add_forces(fields_.u.data(), body_.live, fields_.f_int.data());
      if (body_.first_rank()) stored_ += body_.bearings->stored();
    }
    body_.discretisation.condense(fields_.f_int);
    if (!fields_.f_visc.empty()) body_.discretisation.condense(fields_.f_visc);
  }
  if (!valid_ || t != time_) load(t);
  valid_ = true;
  time_ = t;
}

double Forces::dissipation() const {
  return (body_.damage ? body_.damage->dissipation() : 0.0) + (body_.bars ? body_.bars->dissipation() : 0.0) +
         (body_.bearings ? body_.bearings->dissipation() : 0.0);
}

void Forces::accept() {
  if (body_.bars) body_.bars->accept();
  if (body_.bearings) body_.bearings->accept();
  if (body_.damage) body_.damage->accept();
  if (body_.damage && body_.bars) body_.bars->see_cracks(*body_.damage, fields_.u.data(), body_.live);
  accepted_ = true;
}

void Forces::pass_over_the_gone() {
  const auto all = static_cast<int>(body_.mass.size());
  body_.own =
      living(body_.partition ? body_.partition->own_nodes() : std::vector<NodeRange>{{0, all}}, body_);
  std::vector<char> touched(body_.mesh.nodes.size(), body_.partition ? 0 : 1);
  if (body_.partition) body_.mark_nodes(touched);
  body_.touched = living(ranges_of(touched), body_);
  if (body_.bars) body_.bars->cells_changed();
  for (AlignedVector* f : {&fields_.f_int, &fields_.f_visc})
    std::fill(f->begin(), f->end(), 0.0);  // nobody clears them there from now on
}

}  // namespace talus::fem
