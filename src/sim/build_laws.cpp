#include "sim/builder.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace talus::sim {

void Builder::refuse_what_is_missing() {
  const scene::Scene& s = world_->scene;
  const auto missing = [&](const std::string& key, const std::string& value, const std::string& remedy) {
    problem(key, value, "is not there yet in this version", remedy);
  };
  if (s.simulation.method == scene::Simulation::Method::dda1988) {   // its plan says what else it leaves out
    if (!env_.joint_laws.empty()) missing("rock_mass.joint_set.friction", "", "method dda-1988 has one law for a pair of materials: leave it out, with cohesion and tension, or use method talus");
    if (!env_.bonds.empty()) missing("rock_mass.joint_set.persistence", "", "method dda-1988 has no rock bridges: let joints go through, or use method talus");
    return;
  }
  const int n = s.laws.materials;
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const ContactLaw& law = s.laws(i, j);
      const std::string key = fmt::format("interface.{}/{}.", s.materials[static_cast<std::size_t>(i)].name, s.materials[static_cast<std::size_t>(j)].name);
      const bool deforms = s.coupling.scheme == scene::Coupling::Scheme::two_way &&
                           std::any_of(s.structures.begin(), s.structures.end(), [&](const StructureSpec& q) { return q.material == i || q.material == j; });
      if (law.rolling_resistance > 0 && deforms)
        missing(key + "rolling_resistance", fmt::format("{:g}", law.rolling_resistance), "leave it out where a block meets a deformable structure");
    }
}

void Builder::complete_laws() {
  const scene::Scene& s = world_->scene;
  const int n = env_.laws.materials;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      ContactLaw& law = env_.laws.law[static_cast<std::size_t>(i * n + j)];
      const scene::Material &a = s.materials[static_cast<std::size_t>(i)], &b = s.materials[static_cast<std::size_t>(j)];
      const std::string key = fmt::format("interface.{}/{}.contact_law", a.name, b.name);
      if (law.kind == ContactLaw::Kind::hertz) {
        const double soft = (a.young > 0 ? (1 - a.poisson * a.poisson) / a.young : 0) + (b.young > 0 ? (1 - b.poisson * b.poisson) / b.young : 0);
        if (!(soft > 0) && i <= j) problem(key, "hertz", "needs Young's modulus of at least one of the two materials", "give material.young (a material without it counts as rigid)");
        if (soft > 0) law.normal_stiffness = 4.0 / 3.0 / soft * std::sqrt(law.hertz_radius);
      }
      if (law.kind == ContactLaw::Kind::hertz || law.kind == ContactLaw::Kind::table) {
        if (law.chosen) law.shear_stiffness = 0;   // Coulomb friction without a shear spring, unless one is given
        law.stiffness = ContactLaw::Stiffness::per_contact;
        law.chosen = false;
      }
      if (law.kind == ContactLaw::Kind::crushing && law.stiffness == ContactLaw::Stiffness::hard && i <= j)
        problem(key, "crushing", "a contact that crushes must be elastic before it does", "give the interface a normal_stiffness, or the materials Young's moduli");
    }
}

}  // namespace talus::sim
