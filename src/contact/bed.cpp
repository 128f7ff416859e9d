#include "contact/bed.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {

Bed::Bed(const std::vector<Column>& columns, const Vec3& normal, double start, double stiffness, double limit, double deepest, double crushed)
    : start_(start), limit_(limit), beyond_(deepest - start), crushed_(crushed) {
  springs_.reserve(columns.size());
  double all = 0, gains = 0;
  for (const Column& c : columns) {
    springs_.push_back({stiffness * c.area, std::min({c.depth, c.most, deepest - crushed, limit}), c.lift.dot(normal)});
    all += c.area;
    gains += c.area * springs_.back().gain;
  }
  if (all > 0) gain_ = gains / all;
}

double Bed::force(double x) const {
  double f = 0;
  for (const Spring& s : springs_) f += s.stiffness * s.gain * std::clamp(compression(s, x), 0.0, limit_);
  return f;
}

double Bed::slope(double x) const {
  double k = 0;
  for (const Spring& s : springs_) {
    const double c = compression(s, x);
    if (c >= 0 && c < limit_) k += s.stiffness * s.gain * s.gain;
  }
  return k;
}

double Bed::work(double x) const {
  double w = 0;
  for (const Spring& s : springs_) {
    const double c = compression(s, x), elastic = std::clamp(c, 0.0, limit_);
    w += s.stiffness * elastic * (0.5 * elastic + std::max(0.0, c - elastic));
  }
  return w;
}

double Bed::stored(double x) const {
  double w = 0;
  for (const Spring& s : springs_) {
    const double elastic = std::clamp(compression(s, x), 0.0, limit_);
    w += 0.5 * s.stiffness * elastic * elastic;
  }
  return w;
}

double Bed::before(double x) const {
  if (std::isinf(limit_) && crushed_ > 0) x = std::min(x, start_);   // what lies unloaded came down with the block: it held nothing on the way
  double w = crushing_before(x);
  for (const Spring& s : springs_) {
    const double elastic = yields(s) && s.gain * (x - start_) < 0 ? limit_ : std::clamp(compression(s, x), 0.0, limit_);
    w += 0.5 * s.stiffness * elastic * elastic;
  }
  return w;
}

double Bed::crushing_before(double x) const {
  double w = 0;
  for (const Spring& s : springs_)
    if (yields(s) && s.gain * (x - start_) < 0) w += s.stiffness * limit_ * s.gain * (x - start_);
  return w;
}

double Bed::crushed_after(double x) const {
  // What an elastic bed lets lie unloaded comes back as the block has left it: by what was found, which the step's own motion along one normal is not.
  if (std::isinf(limit_)) return std::min(crushed_, std::max(start_ + beyond_, 0.0));
  return std::max(crushed_, start_ + beyond_ + gain_ * (x - start_) - limit_);
}

}  // namespace talus::contact
