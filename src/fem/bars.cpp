#include "fem/bars.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace talus::fem {

Bars::Bars(const StructureSpec& spec, const HexMesh& mesh, const std::vector<rebar::Member>& members) {
  std::vector<rebar::Bar> all;
  const std::string key = "structure." + spec.name + ".rebar";
  if (!spec.rebar_file.empty()) all = rebar::read_bars(spec.rebar_file);
  double stirrup_diameter = 0;
  for (const auto& rule : spec.rebar_rules)
    if (rule.kind == "stirrups") stirrup_diameter = std::max(stirrup_diameter, rule.diameter);
  for (const auto& rule : spec.rebar_rules) {
    if (members.empty()) {
      Problem p;
      p.key = key;
      p.value = rule.kind;
      p.rule = "bars by rule need a box, a column or a viaduct";
      p.remedy = "give the bars of a mesh as polylines: rebar = \"bars.csv\"";
      throw InputError(p);
    }
    material::Steel::Parameters steel;
    steel.yield = rule.yield;
    steel.ultimate = 1.08 * rule.yield;
    steel.fracture_strain = rule.ultimate_strain;
    steel.rate_effect = spec.rate_effect;
    for (const rebar::Member& member : members) {
      std::vector<rebar::Bar> made;
      if (rule.kind == "longitudinal") made = rebar::longitudinal_bars(member, {rule.bars, rule.diameter, rule.cover, stirrup_diameter, steel}, key);
      else if (rule.kind == "stirrups") made = rebar::stirrups(member, {rule.diameter, rule.cover, rule.spacing, steel}, key);
      else {
        Problem p;
        p.key = key;
        p.value = rule.kind;
        p.rule = "one of longitudinal, stirrups";
        p.remedy = "choose one";
        throw InputError(p);
      }
      all.insert(all.end(), made.begin(), made.end());
    }
  }
  const std::vector<rebar::Segment> segments = rebar::embed(all, rebar::host_search(mesh.nodes, mesh.hexes), key);
  // Only the nodes of hosts take part: their own numbering.
  std::vector<int> number(mesh.nodes.size(), -1);
  for (const rebar::Segment& s : segments)
    for (int n : mesh.hexes[s.cell]) number[n] = 0;
  for (std::size_t n = 0; n < number.size(); ++n)
    if (number[n] == 0) number[n] = static_cast<int>(node_.size()), node_.push_back(static_cast<int>(n)), reference_.push_back(mesh.nodes[n]);
  std::vector<std::array<int, 8>> hexes = mesh.hexes;
  for (auto& hex : hexes)
    for (int& n : hex) n = std::max(number[n], 0);
  bars_ = rebar::EmbeddedBars(all, segments, reference_, hexes);
  current_ = reference_;
  force_.assign(3 * node_.size(), 0.0);
  old_ = next_ = bars_.initial_states();
  old_strain_.assign(segments.size(), 0.0);
  next_strain_ = old_strain_;
}

void Bars::add_forces(const double* u, double h, const std::vector<char>& live, double* f) {
  for (std::size_t i = 0; i < node_.size(); ++i) current_[i] = reference_[i] + Vec3(u[4 * node_[i]], u[4 * node_[i] + 1], u[4 * node_[i] + 2]);
  std::fill(force_.begin(), force_.end(), 0.0);
  sums_ = bars_.forces(current_, h, old_, old_strain_, next_, next_strain_, force_.data(), live.data());
  for (std::size_t i = 0; i < node_.size(); ++i)
    for (int c = 0; c < 3; ++c) f[4 * node_[i] + c] += force_[3 * i + c];
}

void Bars::accept() {
  old_ = next_;
  old_strain_ = next_strain_;
}

void Bars::add_mass(double density, std::vector<double>& mass) const {
  std::vector<double> own(node_.size(), 0.0);
  bars_.add_mass(density, own);
  for (std::size_t i = 0; i < node_.size(); ++i) mass[node_[i]] += own[i];
}

double Bars::steel_volume() const {
  double volume = 0;
  for (const auto& s : bars_.segments()) volume += s.area * s.length;
  return volume;
}

void Bars::ties(const std::function<void(int, int)>& visit) const {
  const auto& s = bars_.segments();
  for (std::size_t k = 1; k < s.size(); ++k)
    if (s[k].bar == s[k - 1].bar && !(old_[k].broken > 0) && !(old_[k - 1].broken > 0)) visit(s[k - 1].cell, s[k].cell);
}

void Bars::snapshot(const HexMesh& mesh, const double* u, Structure::Snapshot& out) const {
  const auto& segments = bars_.segments();
  for (std::size_t k = 0; k < segments.size(); ++k) {
    Vec3 a = Vec3::Zero(), b = Vec3::Zero();
    const auto& hex = mesh.hexes[segments[k].cell];
    for (int i = 0; i < 8; ++i) {
      const Vec3 x = mesh.nodes[hex[i]] + Vec3(u[4 * hex[i]], u[4 * hex[i] + 1], u[4 * hex[i] + 2]);
      a += segments[k].start[i] * x;
      b += segments[k].end[i] * x;
    }
    const int first = static_cast<int>(out.bar_points.size());
    out.bar_points.push_back(a);
    out.bar_points.push_back(b);
    out.bars.push_back({first, first + 1});
    out.bar_strain.push_back(old_strain_[k]);
  }
}

void Bars::save(std::vector<double>& state) const {
  for (std::size_t k = 0; k < old_.size(); ++k) {
    const auto& s = old_[k];
    state.insert(state.end(), {s.plastic, s.accumulated, s.back_stress, s.yield, s.broken, old_strain_[k]});
  }
}

std::size_t Bars::restore(std::span<const double> state) {
  if (state.size() < 6 * old_.size()) throw NumericalFailure("the saved bars belong to another structure");
  for (std::size_t k = 0; k < old_.size(); ++k) {
    auto& s = old_[k];
    s.plastic = state[6 * k], s.accumulated = state[6 * k + 1], s.back_stress = state[6 * k + 2], s.yield = state[6 * k + 3], s.broken = state[6 * k + 4];
    old_strain_[k] = state[6 * k + 5];
  }
  next_ = old_;
  next_strain_ = old_strain_;
  return 6 * old_.size();
}

}  // namespace talus::fem
