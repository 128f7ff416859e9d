#include "contact/narrow/narrow_near.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::narrow {

int inside(const Patch::Triangle& t, const Vec3& x, double touch) {
  const Vec3* p[3] = {&t.a, &t.b, &t.c};
  int result = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k];
    const double h = e.cross(t.n).dot(x - *p[k]), l = touch * e.norm();
    if (h > l) return -1;
    if (h >= -l && t.sharp[k]) result = 1;
    if (t.tip[k] && (x - *p[k]).squaredNorm() <= 2 * touch * touch) result = 1;
  }
  return result;
}

Vec3 closest_on_triangle(const Patch::Triangle& t, const Vec3& x, bool& interior) {
  interior = inside(t, x, 0) >= 0;
  if (interior) return x - (t.n.dot(x) - t.level) * t.n;
  const Vec3* p[3] = {&t.a, &t.b, &t.c};
  Vec3 best = t.a;
  double d = infinity;
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k];
    const double s = std::clamp(e.dot(x - *p[k]) / e.squaredNorm(), 0.0, 1.0);
    const Vec3 y = *p[k] + s * e;
    if ((x - y).squaredNorm() < d) d = (x - y).squaredNorm(), best = y;
  }
  return best;
}

void Nearest::visit(const Patch::Triangle& t, const Vec3& x, double touch) {
  bool interior;
  const Vec3 y = closest_on_triangle(t, x, interior);
  const double d = (x - y).norm();
  if (d < distance - touch) {
    distance = d, foot = y, pseudo = t.n;
  } else if (d < distance + touch) {
    pseudo += t.n;
  }
}

void NearTriangles::set(const Patch& patch) {
  constexpr std::size_t together = 8;
  patch_ = &patch;
  balls_.clear();
  bunches_.clear();
  for (const auto& t : patch.triangles) {
    const Vec3 c = (t.a + t.b + t.c) / 3;
    balls_.push_back({c, std::sqrt(std::max(
                             {(t.a - c).squaredNorm(), (t.b - c).squaredNorm(), (t.c - c).squaredNorm()}))});
  }
  for (std::size_t first = 0; first < balls_.size(); first += together) {
    Bunch b{{Vec3::Zero(), 0}, first, std::min(first + together, balls_.size())};
    for (std::size_t k = first; k < b.last; ++k)
      b.ball.centre += balls_[k].centre / static_cast<double>(b.last - first);
    for (std::size_t k = first; k < b.last; ++k)
      b.ball.radius = std::max(b.ball.radius, (balls_[k].centre - b.ball.centre).norm() + balls_[k].radius);
    bunches_.push_back(b);
  }
}

double NearTriangles::ahead(const Vec3& x, double touch) const {
  Nearest nearest{.foot = x};
  const auto search = [&](const Bunch& bunch) {
    for (std::size_t k = bunch.first; k < bunch.last; ++k) {
      const auto& t = patch_->triangles[k];
      const double reach = nearest.distance + touch;
      if (std::abs(t.n.dot(x) - t.level) <= reach &&
          (x - balls_[k].centre).norm() - balls_[k].radius <= reach)
        nearest.visit(t, x, touch);
    }
  };
  const Bunch* likely = &bunches_.front();
  double least = infinity;
  for (const Bunch& b : bunches_)
    if (const double d = (x - b.ball.centre).squaredNorm(); d < least) least = d, likely = &b;
  search(*likely);
  for (const Bunch& b : bunches_)
    if (const double reach = nearest.distance + touch + b.ball.radius;
        &b != likely && (x - b.ball.centre).squaredNorm() <= reach * reach)
      search(b);
  return nearest.pseudo.dot(x - nearest.foot) > 0 ? nearest.distance : 0;
}

}  // namespace talus::contact::narrow
