#include "sim/builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "contact/laws/impact_damping.hpp"

namespace talus::sim {

void Builder::refuse_what_is_missing() {
  const scene::Scene& s = world_->scene;
  const auto missing = [&](const std::string& key, const std::string& value, const std::string& remedy) {
    problem(key, value, "is not there yet in this version", remedy);
  };
  if (s.simulation.method == scene::Simulation::Method::dda1988) {  // its plan says what else it leaves out
    if (!env_.joint_laws.empty())
      missing("rock_mass.joint_set.friction", "",
              "method dda-1988 has one law for a pair of materials: leave it out, with cohesion and tension, "
              "or use method talus");
    if (!env_.bonds.empty())
      missing("rock_mass.joint_set.persistence", "",
              "method dda-1988 has no rock bridges: let joints go through, or use method talus");
    return;
  }
  const int n = s.laws.materials;
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const ContactLaw& law = s.laws(i, j);
      const std::string key = fmt::format("interface.{}/{}.", s.materials[static_cast<std::size_t>(i)].name,
                                          s.materials[static_cast<std::size_t>(j)].name);
      const bool at_structure =
          std::any_of(s.structures.begin(), s.structures.end(),
                      [&](const StructureSpec& q) { return q.material == i || q.material == j; });
      const bool deforms = s.coupling.scheme == scene::Coupling::Scheme::two_way && at_structure,
                 stepped = s.coupling.scheme != scene::Coupling::Scheme::rigid && at_structure;
      if (law.yield_gradient > 0 && deforms)
        missing(key + "contact_law.gradient", fmt::format("{:g} Pa/m", law.yield_gradient),
                "leave it out where a block meets a deformable structure; thickness holds there");
      if (law.restitution_half_speed > 0 && stepped && law.sprung() && law.damping_ratio == 0)
        missing(
            key + "restitution_half_speed", fmt::format("{:g} m/s", law.restitution_half_speed),
            "where springs press on a deformable structure a dashpot gives one restitution for all speeds: "
            "give this pair an [[interface]] of its own without it");
      if (law.restitution && *law.restitution < contact::least_restitution && stepped && law.sprung() &&
          law.damping_ratio == 0)
        add_warnings(
            {{.severity = Problem::Severity::warning,
              .file = s.file,
              .key = key + "restitution",
              .value = fmt::format("{:g}", *law.restitution),
              .rule = fmt::format("at a deformable structure is {:g}: a dashpot that gives less takes "
                                  "more than twice the force of the spring",
                                  contact::least_restitution),
              .remedy = "take it as that, or a contact that is hard"}});
      if (law.rolling_resistance > 0 && deforms)
        missing(key + "rolling_resistance", fmt::format("{:g}", law.rolling_resistance),
                "leave it out where a block meets a deformable structure");
      else if (law.drilling_resistance > 0 && deforms)
        missing(key + "drilling_resistance", fmt::format("{:g}", law.drilling_resistance),
                "leave it out where a block meets a deformable structure");
    }
}

void Builder::complete_laws() {
  const scene::Scene& s = world_->scene;
  const int n = env_.laws.materials;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      ContactLaw& law = env_.laws.law[static_cast<std::size_t>(i * n + j)];
      const scene::Material &a = s.materials[static_cast<std::size_t>(i)],
                            &b = s.materials[static_cast<std::size_t>(j)];
      const std::string key = fmt::format("interface.{}/{}.contact_law", a.name, b.name);
      if (law.kind == ContactLaw::Kind::hertz)
        law.normal_stiffness = 4.0 / 3.0 * scene::hertz_modulus(a, b) * std::sqrt(law.hertz_radius);
      if (law.curved()) {
        if (law.chosen)
          law.shear_stiffness = 0;  // Coulomb friction without a shear spring, unless one is given
        law.stiffness = ContactLaw::Stiffness::per_contact;
        law.chosen = false;
      }
      if (law.crushes() && law.stiffness == ContactLaw::Stiffness::hard && i <= j)
        problem(key, "crushing", "a contact that crushes must be elastic before it does",
                "give the interface a normal_stiffness, or the materials Young's moduli");
    }
  env_.one_way_laws = env_.laws;
  for (ContactLaw& law : env_.one_way_laws.law)
    if (law.sprung() && law.restitution) {
      if (law.damping_ratio == 0) law.damping_ratio = contact::damping_ratio_for(*law.restitution);
      law.restitution.reset();
    }
}

namespace {

double largest_face(const Polyhedron& shape) {
  double largest = 0;
  for (int f = 0; f < shape.faces(); ++f) {
    Vec3 twice = Vec3::Zero();
    const int first = shape.face_offset[static_cast<std::size_t>(f)],
              last = shape.face_offset[static_cast<std::size_t>(f) + 1];
    const auto corner = [&](int i) {
      return shape.vertices[static_cast<std::size_t>(shape.face_vertices[static_cast<std::size_t>(i)])];
    };
    for (int i = first; i < last; ++i) twice += corner(i).cross(corner(i + 1 < last ? i + 1 : first));
    largest = std::max(largest, 0.5 * twice.norm());
  }
  return largest;
}

/// Indentation at which a table, which goes on with its last slope, gives a force [m].
double depth_by_table(const std::vector<std::pair<double, double>>& table, double force) {
  std::size_t i = 1;
  while (i + 1 < table.size() && table[i].second < force) ++i;
  const auto& [x0, f0] = table[i - 1];
  const auto& [x1, f1] = table[i];
  return f1 > f0 ? x0 + (force - f0) / (f1 - f0) * (x1 - x0) : std::numeric_limits<double>::infinity();
}

/// Depth to which its weight presses a block that lies at its best: on three contact points, or on its
/// largest face (on no less than the cap of a ball of its inradius, a tenth of that deep) [m]. 0: not a
/// matter of a stiffness.
double settles(const ContactLaw& law, const dda::Model::Block& block, double gravity) {
  const double weight = block.mass * gravity;
  if (law.stiffness == ContactLaw::Stiffness::hard) return 0;
  if (law.kind == ContactLaw::Kind::table) return depth_by_table(law.table, weight / 3);
  if (law.stiffness == ContactLaw::Stiffness::per_contact)
    return std::pow(weight / (3 * law.normal_stiffness), 1 / law.exponent());
  const double r = block.shape->inradius;
  return weight / (law.normal_stiffness * std::max(largest_face(*block.shape), 0.6 * r * r));
}

}  // namespace

/// A stiffness on which the lightest block swings faster than any step can follow, w h > 1 with h the usual
/// `min_step` (coarser ones take oscillations together on purpose), finer where the scene asks for it, and
/// w = (a / depth under a)^(1/2) at a = 1 m/s^2: each bounce would be lost in one step.
void Builder::check_too_stiff(const ContactLaw& law, int i, int j) {
  const scene::Scene& s = world_->scene;
  if (s.simulation.method == scene::Simulation::Method::dda1988) return;  // its steps follow no swing
  const dda::Model::Block* worst = nullptr;
  const double shortest = std::min(s.simulation.min_step, scene::Simulation{}.min_step);
  double least = shortest * shortest;  // [m], depth under 1 m/s^2
  for (const dda::Model::Block& b : model_.blocks) {
    if (b.ndof() == 0 || (b.material != i && b.material != j) || law.stiffness == ContactLaw::Stiffness::hard)
      continue;
    if (const double depth = settles(law, b, 1); depth < least) worst = &b, least = depth;
  }
  if (!worst) return;
  Problem p = problem_of(law, i, j);
  p.rule = fmt::format("block {} swings on it at {:.2g} rad/s, faster than steps of {:.3g} s can follow",
                       worst->name, 1 / std::sqrt(least), shortest);
  p.remedy = "look at its unit; what is as stiff as that is \"hard\"";
  problems_.push_back(std::move(p));
}

/// About the stiffness of the contacts of materials i and j.
Problem Builder::problem_of(const ContactLaw& law, int i, int j) const {
  const scene::Scene& s = world_->scene;
  Problem p;
  p.file = s.file;
  p.key = fmt::format("interface.{}/{}.{}", s.materials[static_cast<std::size_t>(i)].name,
                      s.materials[static_cast<std::size_t>(j)].name,
                      law.curved() ? "contact_law" : "normal_stiffness");
  p.value = law.kind == ContactLaw::Kind::table ? "table" : fmt::format("{:.4g}", law.normal_stiffness);
  return p;
}

void Builder::check_stiffness() {
  constexpr double refused = 0.1, told = 0.01;  // of the inradius
  const double gravity = model_.gravity.norm();
  const int n = env_.laws.materials;
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const ContactLaw& law = env_.laws(i, j);
      check_too_stiff(law, i, j);
      const dda::Model::Block* worst = nullptr;
      double depth = 0;
      for (const dda::Model::Block& b : model_.blocks) {
        if (b.ndof() == 0 || (b.material != i && b.material != j)) continue;
        const double d = settles(law, b, gravity);
        if (d > told * b.shape->inradius &&
            (!worst || d / b.shape->inradius > depth / worst->shape->inradius))
          worst = &b, depth = d;
      }
      if (!worst) continue;
      const double r = worst->shape->inradius, part = depth / r;
      Problem p = problem_of(law, i, j);
      const bool table = law.kind == ContactLaw::Kind::table;
      p.rule = fmt::format("block {} sinks in by {:.3g} m under its own weight, {:.2g} % of its inradius{}",
                           worst->name, depth, 100 * part, part > refused ? "; 10 % at most" : "");
      p.remedy = table ? "look at the table's units: bare numbers are in m and N"
                       : fmt::format("take {:.2g} times the stiffness{}",
                                     std::pow(part / (part > refused ? refused : told), law.exponent()),
                                     part > refused ? " or more, or \"hard\""
                                                    : " for a hundredth of it, or accept it");
      if (part > refused) {
        problems_.push_back(std::move(p));
      } else {
        p.severity = Problem::Severity::warning;
        world_->scene.warnings.push_back(std::move(p));
      }
    }
}

}  // namespace talus::sim
