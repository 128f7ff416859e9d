#include "coupling/ground_laws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/plumb.hpp"

namespace talus::coupling {
namespace {

constexpr double most_braked = 0.1;  // of the speed in a stretch: the splitting is off by the square of that

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

void share_width(std::span<Touch> touches, const Polyhedron& block) {
  const auto ploughs = [](const Touch& t) {
    return t.law->kind == ContactLaw::Kind::crushing &&
           (t.law->ploughing_pressure > 0 || t.law->ploughing_density > 0) && t.at.gap < 0;
  };
  const double tip = 0.1 * block.inradius;
  double all = 0;
  for (Touch& t : touches) {
    if (!ploughs(t)) continue;
    t.width = t.at.area > 0 ? t.at.area : tip * tip + t.at.gap * t.at.gap;  // as its spring has it
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

double brake_in_vegetation(const dda::Model& model, const Environment& env, dda::State& s, double time) {
  double taken = 0;
  const bool any = std::any_of(env.laws.law.begin(), env.laws.law.end(),
                               [](const ContactLaw& l) { return l.vegetation_drag > 0; });
  if (!any) return 0;
  for (std::size_t k = 0; k < model.blocks.size(); ++k) {
    const dda::Model::Block& b = model.blocks[k];
    if (b.ndof() == 0 || s.v[k].isZero(0)) continue;
    double drag = 0;
    const auto stands = [&](int ground, double above) {
      const ContactLaw& law = env.laws(ground, b.material);
      if (above < law.vegetation_height) drag = std::max(drag, law.vegetation_drag);
    };
    for (const Plane& p : env.planes) stands(p.material, p.normal.dot(s.c[k] - p.point));
    if (env.terrain)
      if (const contact::Plumb plumb = contact::plumb_at(*env.terrain, s.c[k]); plumb.triangle >= 0) {
        const TriangleSurface& ground = env.terrain->surface();
        stands(ground.material.empty() ? ground.default_material
                                       : ground.material[static_cast<std::size_t>(plumb.triangle)],
               s.c[k].z() - plumb.floor);
      }
    if (drag == 0) continue;
    const double before = 0.5 * b.mass * s.v[k].squaredNorm();
    s.v[k] *= std::exp(-drag * time / b.mass);
    taken += before - 0.5 * b.mass * s.v[k].squaredNorm();
  }
  return taken;
}

double longest_in_vegetation(const dda::Model& model, const ContactLaws& laws) {
  double longest = std::numeric_limits<double>::infinity();
  for (const dda::Model::Block& b : model.blocks)
    for (int m = 0; m < laws.materials && b.ndof() > 0; ++m)
      if (const double drag = laws(m, b.material).vegetation_drag; drag > 0)
        longest = std::min(longest, most_braked * b.mass / drag);
  return longest;
}

}  // namespace talus::coupling
