#include "coupling/ground/ground_laws.hpp"

#include <algorithm>
#include <cmath>

#include "contact/geometry/plumb.hpp"

namespace talus::coupling {
namespace {

double way_of(const dda::State& s, int block) {
  const auto k = static_cast<std::size_t>(block);
  return block >= 0 && k < s.slid.size() ? s.slid[k] : 0.0;
}

}  // namespace

bool remembers_way(const ContactLaws& laws) {
  return std::any_of(laws.law.begin(), laws.law.end(),
                     [](const ContactLaw& l) { return l.changes_with_way(); });
}

double friction_now(const dda::State& s, const Touch& t, double ahead) {
  if (!t.law->changes_with_way()) return t.law->friction;
  const double other = t.a.kind == Partner::Kind::block ? way_of(s, t.a.index) : 0.0;
  return t.law->friction_after(std::max(way_of(s, t.b), other) + ahead);
}

void share_width(std::span<Touch> touches) {
  const auto ploughs = [](const Touch& t) {
    return (t.law->ploughing_pressure > 0 || t.law->ploughing_density > 0) && t.at.gap < 0;
  };
  double all = 0;
  for (Touch& t : touches) {
    if (!ploughs(t)) continue;
    t.width = t.normal_law.bed ? t.at.area : t.normal_law.pressed_area(-t.at.gap);
    all += t.width;
  }
  for (Touch& t : touches) t.width /= all > 0 ? std::sqrt(all) : 1.0;
}

double ploughing(const Touch& t, double slip) {
  return (t.law->ploughing_pressure + 0.5 * t.law->ploughing_density * slip * slip) *
         std::max(0.0, -t.at.gap) * t.width;
}

void go_on_sliding(dda::State& s, int block, double slip, double recovery, double h) {
  double& way = s.slid[static_cast<std::size_t>(block)];
  way = slip >= 0 ? way + h * slip : way * std::exp(-recovery * h);
}

bool any_vegetation(const ContactLaws& laws) {
  return std::any_of(laws.law.begin(), laws.law.end(),
                     [](const ContactLaw& l) { return l.vegetation_drag > 0; });
}

double vegetation_drag(const dda::Model::Block& b, const Environment& env, const Vec3& c) {
  if (b.ndof() == 0) return 0;
  double drag = 0;
  const auto stands = [&](int ground, double above) {
    const ContactLaw& law = env.laws(ground, b.material);
    if (above < law.vegetation_height) drag = std::max(drag, law.vegetation_drag);
  };
  for (const Plane& p : env.planes) stands(p.material, p.normal.dot(c - p.point));
  if (env.terrain)
    if (const contact::Plumb plumb = contact::plumb_at(*env.terrain, c); plumb.triangle >= 0) {
      const TriangleSurface& ground = env.terrain->surface();
      stands(ground.material.empty() ? ground.default_material
                                     : ground.material[static_cast<std::size_t>(plumb.triangle)],
             c.z() - plumb.floor);
    }
  return drag / b.mass;
}

std::vector<Vec3> normals_below(const Environment& env, const Vec3& c) {
  std::vector<Vec3> normals;
  for (const Plane& p : env.planes) normals.push_back(p.normal);
  if (!env.terrain) return normals;
  if (const contact::Plumb plumb = contact::plumb_at(*env.terrain, c); plumb.triangle >= 0) {
    const TriangleSurface& ground = env.terrain->surface();
    const auto corner = [&](std::size_t i) -> const Vec3& {
      return ground
          .vertices[static_cast<std::size_t>(ground.triangles[static_cast<std::size_t>(plumb.triangle)][i])];
    };
    normals.push_back((corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized());
  }
  return normals;
}

}  // namespace talus::coupling
