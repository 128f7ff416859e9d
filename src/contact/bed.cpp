#include "contact/bed.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {

Bed::Bed(const std::vector<Column>& columns, double start, double stiffness, double limit, double deepest, double crushed)
    : start_(start), limit_(limit), beyond_(deepest - start), crushed_(crushed) {
  springs_.reserve(columns.size());
  for (const Column& c : columns) springs_.push_back({stiffness * c.area, std::min({c.depth, deepest - crushed, limit})});
}

double Bed::force(double x) const {
  double f = 0;
  for (const Spring& s : springs_) f += s.stiffness * std::clamp(s.compression + x - start_, 0.0, limit_);
  return f;
}

double Bed::slope(double x) const {
  double k = 0;
  for (const Spring& s : springs_) {
    const double compression = s.compression + x - start_;
    if (compression >= 0 && compression < limit_) k += s.stiffness;
  }
  return k;
}

double Bed::work(double x) const {
  double w = 0;
  for (const Spring& s : springs_) {
    const double compression = s.compression + x - start_, elastic = std::clamp(compression, 0.0, limit_);
    w += s.stiffness * elastic * (0.5 * elastic + std::max(0.0, compression - elastic));
  }
  return w;
}

double Bed::stored(double x) const {
  double w = 0;
  for (const Spring& s : springs_) {
    const double elastic = std::clamp(s.compression + x - start_, 0.0, limit_);
    w += 0.5 * s.stiffness * elastic * elastic;
  }
  return w;
}

double Bed::before(double x) const {
  double w = crushing_before(x);
  for (const Spring& s : springs_) {
    const double elastic = yields(s) && x < start_ ? limit_ : std::clamp(s.compression + x - start_, 0.0, limit_);
    w += 0.5 * s.stiffness * elastic * elastic;
  }
  return w;
}

double Bed::crushing_before(double x) const {
  double w = 0;
  for (const Spring& s : springs_)
    if (yields(s) && x < start_) w += s.stiffness * limit_ * (x - start_);
  return w;
}

double Bed::crushed_after(double x) const {
  // What an elastic bed lets lie unloaded comes back as the block leaves it.
  return std::isinf(limit_) ? std::min(crushed_, std::max(x + beyond_, 0.0)) : std::max(crushed_, x + beyond_ - limit_);
}

}  // namespace talus::contact
