#include "contact/laws/corner_area.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {
namespace {

constexpr int most_steps = 60;  // of Newton's method

double mean_of(const CornerArea::Triangle& t) { return (t.height[0] + t.height[1] + t.height[2]) / 3; }

}  // namespace

CornerArea::CornerArea(const std::vector<Triangle>& cell) : cell_(cell) {
  double all = 0;
  for (const Triangle& t : cell_) all += t.area;
  for (Triangle& t : cell_) {
    t.area /= all;
    std::sort(t.height.begin(), t.height.end());
    mean_ += t.area * mean_of(t);
  }
}

double CornerArea::part(double x) const {
  if (!(x > 0)) return 0;
  double sum = 0;
  for (const auto& [area, z] : cell_) {
    if (x >= z[2])
      sum += area;
    else if (x >= z[1])
      sum += area * (1 - (z[2] - x) * (z[2] - x) / ((z[2] - z[1]) * (z[2] - z[0])));
    else if (x > z[0])
      sum += area * (x - z[0]) * (x - z[0]) / ((z[1] - z[0]) * (z[2] - z[0]));
  }
  return sum;
}

double CornerArea::volume(double x) const {
  if (!(x > 0)) return 0;
  double sum = 0;
  for (const Triangle& t : cell_) {
    const auto& z = t.height;
    if (x >= z[1]) {
      const double left = std::max(0.0, z[2] - x);
      sum += t.area *
             (x - mean_of(t) + (left > 0 ? left * left * left / (3 * (z[2] - z[1]) * (z[2] - z[0])) : 0.0));
    } else if (x > z[0]) {
      const double d = x - z[0];
      sum += t.area * d * d * d / (3 * (z[1] - z[0]) * (z[2] - z[0]));
    }
  }
  return sum;
}

double CornerArea::square(double x) const {
  if (!(x > 0)) return 0;
  double sum = 0;
  for (const Triangle& t : cell_) {
    const auto& z = t.height;
    if (x >= z[1]) {
      const double m = mean_of(t), left = std::max(0.0, z[2] - x);
      double variance = 0;
      for (const double h : z) variance += (h - m) * (h - m) / 12;
      sum += t.area * (0.5 * ((x - m) * (x - m) + variance) -
                       (left > 0 ? left * left * left * left / (12 * (z[2] - z[1]) * (z[2] - z[0])) : 0.0));
    } else if (x > z[0]) {
      const double d = x - z[0];
      sum += t.area * d * d * d * d / (12 * (z[1] - z[0]) * (z[2] - z[0]));
    }
  }
  return sum;
}

// V(x) >= x - mean and S(x) >= (x - mean)^2 / 2, both convex: Newton's steps come down from above.

double CornerArea::depth_of(double sought) const {
  if (!(sought > 0)) return 0;
  double x = mean_ + sought;
  for (int i = 0; i < most_steps; ++i) {
    const double step = (volume(x) - sought) / part(x);
    if (!(step > 0) || !(x - step < x)) break;
    x -= step;
  }
  return x;
}

double CornerArea::depth_of_square(double sought) const {
  if (!(sought > 0)) return 0;
  double x = mean_ + std::sqrt(2 * sought);
  for (int i = 0; i < most_steps; ++i) {
    const double step = (square(x) - sought) / volume(x);
    if (!(step > 0) || !(x - step < x)) break;
    x -= step;
  }
  return x;
}

}  // namespace talus::contact
