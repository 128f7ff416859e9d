// Keys that are read and have no effect in the scene at hand. A key that contradicts its neighbour in the
// same table is an error where it is read; here is what depends on the rest of the scene, as warnings.
#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "scene/reading.hpp"

namespace talus::scene {
namespace {

/// What the materials of a scene are used for.
class Uses {
 public:
  explicit Uses(const Scene& scene) : ground_(scene.materials.size()), moves_(ground_), terrain_(ground_) {
    const auto mark = [](std::vector<char>& list, int material) {
      if (material >= 0 && material < static_cast<int>(list.size()))
        list[static_cast<std::size_t>(material)] = 1;
    };
    for (const Plane& p : scene.planes) mark(ground_, p.material);
    if (scene.site) {
      std::vector<int> of_site{scene.site->material};
      for (const Site::MaterialArea& area : scene.site->material_areas) of_site.push_back(area.material);
      for (const int m : of_site) mark(ground_, m), mark(terrain_, m);
    }
    for (const Block& b : scene.blocks)
      if (!b.fixed) mark(moves_, b.material);
    if (scene.rock_mass) mark(moves_, scene.rock_mass->material);
    if (scene.impact) mark(moves_, scene.impact->material);
    for (const StructureSpec& s : scene.structures) mark(moves_, s.material);  // its fragments
  }
  bool terrain(int m) const { return terrain_[static_cast<std::size_t>(m)] != 0; }
  /// A block of one moves over ground of the other.
  bool over_ground(int a, int b) const {
    const auto over = [&](int block, int ground) {
      return moves_[static_cast<std::size_t>(block)] != 0 && ground_[static_cast<std::size_t>(ground)] != 0;
    };
    return over(a, b) || over(b, a);
  }

 private:
  std::vector<char> ground_, moves_, terrain_;
};

/// One kind of idle key of an [[interface]]: given by the law, but with no effect at a pair.
struct IdleKey {
  const char* key;
  bool (*given)(const ContactLaw&);
  bool (*works)(const ContactLaw&, const Uses&, int a, int b);
  const char* rule;
  const char* remedy;
};

constexpr IdleKey of_interfaces[] = {
    {"damping_ratio", [](const ContactLaw& l) { return l.damping_ratio > 0; },
     [](const ContactLaw& l, const Uses&, int, int) { return l.sprung() || !l.chosen; },
     "has no effect: neither material has a Young's modulus, so that the contact is hard, without a spring "
     "to damp",
     "give normal_stiffness a value, or restitution in its place, or remove it"},
    {"normal_stiffness", [](const ContactLaw& l) { return l.curved() && !l.chosen; },
     [](const ContactLaw& l, const Uses&, int, int) { return l.stiffness != ContactLaw::Stiffness::hard; },
     "\"hard\" has no effect: contact_law gives the force of this contact", "remove it, or contact_law"},
    {"restitution_tangential", [](const ContactLaw& l) { return l.restitution_tangential.value_or(0) != 0; },
     [](const ContactLaw& l, const Uses&, int, int) {
       return (l.friction > 0 || l.friction_most > 0) && (!l.sprung() || l.restitution);
     },
     "has no effect: it is an impulse of friction in an impact, and this contact has no friction, or is a "
     "spring without restitution",
     "give friction, and restitution or normal_stiffness = \"hard\"; or remove it"},
    {"restitution_half_speed", [](const ContactLaw& l) { return l.restitution_half_speed > 0; },
     [](const ContactLaw& l, const Uses&, int, int) { return l.restitution.value_or(0) > 0; },
     "has no effect: the restitution is 0 at all speeds", "give a restitution above 0, or remove it"},
    {"vegetation", [](const ContactLaw& l) { return l.vegetation_drag > 0; },
     [](const ContactLaw&, const Uses& uses, int a, int b) { return uses.over_ground(a, b); },
     "has no effect: it grows on the ground (terrain, planes) that blocks move over, and neither material is "
     "one of such ground",
     "name the material of the ground in between, or remove it"},
};

void warn_of_idle_laws(const Reading& in, const Uses& uses) {
  std::vector<const Node*> told;
  for (const LawUse& first : in.law_uses) {
    const Node* const entry = &first.view.node();
    if (std::find(told.begin(), told.end(), entry) != told.end()) continue;
    told.push_back(entry);
    for (const IdleKey& k : of_interfaces) {
      if (!first.view.has(k.key)) continue;  // what a preset fills in is not the user's
      bool given = false, works = false;
      for (const LawUse& use : in.law_uses) {
        if (&use.view.node() != entry) continue;
        const ContactLaw& law = in.scene.laws(use.a, use.b);
        given = given || k.given(law);
        works = works || k.works(law, uses, use.a, use.b);
      }
      if (given && !works) first.view.problem(k.key, k.rule, k.remedy, Problem::Severity::warning);
    }
  }
}

void warn_of_idle_materials(const Reading& in, const View& root, const Uses& uses) {
  for (const View& view : root.tables("material")) {
    const auto known = in.material_index.find(view.text("name"));
    if (known == in.material_index.end()) continue;
    const Material& m = in.scene.materials[static_cast<std::size_t>(known->second)];
    const bool hollow = in.scene.rock_mass && in.scene.rock_mass->from_terrain &&
                        in.scene.rock_mass->bed_material == known->second;
    if (m.roughness && !uses.terrain(known->second) && hollow)
      view.problem(
          "roughness",
          "has no effect: the hollow that the rock mass lies in keeps the shape of the slip surface, and "
          "no other face of the terrain is of this material",
          "put the roughness into the slip surface, or remove it", Problem::Severity::warning);
    else if (m.roughness && !uses.terrain(known->second))
      view.problem(
          "roughness",
          "has no effect: only faces of a terrain get rougher, and none is of this material; planes, "
          "blocks and structures stay as they are",
          "give [site] a terrain of this material in place of the plane, or remove it",
          Problem::Severity::warning);
    if (view.has("poisson") && !(m.young > 0) && !(m.f_cm > 0) &&
        in.scene.simulation.method != Simulation::Method::dda1988)
      view.problem("poisson", "has no effect: a material without Young's modulus is rigid",
                   "give young, or remove it", Problem::Severity::warning);
  }
}

}  // namespace

void warn_of_idle_keys(const Reading& in, const View& root) {
  const Uses uses(in.scene);
  warn_of_idle_materials(in, root, uses);
  // The plan of method dda-1988 says what of a law it leaves out.
  if (in.scene.simulation.method != Simulation::Method::dda1988) warn_of_idle_laws(in, uses);
}

}  // namespace talus::scene
