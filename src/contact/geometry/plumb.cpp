#include "contact/geometry/plumb.hpp"

#include <algorithm>
#include <limits>

#include "contact/geometry/surface_index.hpp"

namespace talus::contact {
namespace {

/// Calls use(z, faces_up, triangle) for each triangle over or under (x, y). Upright ones are not met; points
/// on a common side belong to both triangles.
template <class Use>
void along_plumb(const SurfaceIndex::Impl& s, double x, double y, const Use& use) {
  s.tree.traverse([&](const Vec3& lo,
                      const Vec3& hi) { return lo.x() <= x && x <= hi.x() && lo.y() <= y && y <= hi.y(); },
                  [&](int t) {
                    const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
                    const Vec3 &a = s.surface.vertices[static_cast<std::size_t>(v[0])],
                               &b = s.surface.vertices[static_cast<std::size_t>(v[1])],
                               &c = s.surface.vertices[static_cast<std::size_t>(v[2])];
                    const auto cross = [](double ux, double uy, double vx, double vy) {
                      return ux * vy - uy * vx;
                    };
                    const double all = cross(b.x() - a.x(), b.y() - a.y(), c.x() - a.x(), c.y() - a.y());
                    if (all == 0) return true;
                    const double wa = cross(b.x() - x, b.y() - y, c.x() - x, c.y() - y) / all;
                    const double wb = cross(c.x() - x, c.y() - y, a.x() - x, a.y() - y) / all;
                    const double wc = 1 - wa - wb;
                    constexpr double slack = -1e-12;
                    if (wa >= slack && wb >= slack && wc >= slack)
                      use(wa * a.z() + wb * b.z() + wc * c.z(), all > 0, t);
                    return true;
                  });
}

}  // namespace

double SurfaceIndex::height(double x, double y) const {
  double best = std::numeric_limits<double>::quiet_NaN();
  along_plumb(*impl_, x, y, [&](double z, bool, int) {
    if (!(best >= z)) best = z;
  });
  return best;
}

Plumb plumb_at(const SurfaceIndex& terrain, const Vec3& p) {
  const SurfaceIndex::Impl& s = terrain.impl();
  const bool two_sided = s.surface.two_sided;
  Plumb found;
  bool up = false;  // the first face above p
  double ceiling = std::numeric_limits<double>::infinity();
  along_plumb(s, p.x(), p.y(), [&](double z, bool faces_up, int) {
    if (z > p.z() && z < found.above) found.above = z, up = faces_up;
    if (z > p.z() && !faces_up && !two_sided) ceiling = std::min(ceiling, z);
  });
  found.solid = up && !two_sided;
  along_plumb(s, p.x(), p.y(), [&](double z, bool faces_up, int t) {
    if ((faces_up || two_sided) && z < ceiling && !(found.floor >= z)) found.floor = z, found.triangle = t;
  });
  return found;
}

}  // namespace talus::contact
