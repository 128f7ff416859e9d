#include "contact/laws/bed.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {

Bed::Above Bed::Spring::above(double shift) const {
  const double a = start[0] + shift, b = start[1] + shift, c = start[2] + shift;
  const double mean = (a + b + c) / 3, square = (a * a + b * b + c * c + a * b + b * c + c * a) / 6;
  if (a >= 0) return {1, mean, square};
  if (c <= 0) return {};
  if (b <= 0) {  // the corner c alone
    const double part = c / (c - a) * (c / (c - b));
    return {part, part * c / 3, part * c * c / 6};
  }
  const double part = a / (a - c) * (a / (a - b));  // all but the corner a
  return {1 - part, mean - part * a / 3, square - part * a * a / 6};
}

Bed::Above Bed::Spring::compressed(double shift, double limit) const {
  if (full) return above(std::min(shift, 0.0));
  const Above all = above(shift);
  if (start[2] + shift <= limit) return all;
  const Above beyond = above(shift - limit);
  return {all.part, all.first - beyond.first, all.second - beyond.second - 2 * limit * beyond.first};
}

Bed::Bed(const std::vector<Column>& columns, const Vec3& normal, double start, double stiffness, double limit,
         double deepest, double crushed, bool rested)
    : start_(start), limit_(limit), beyond_(deepest - start), crushed_(crushed), rested_(rested) {
  springs_.reserve(columns.size());
  double all = 0, gains = 0;
  for (const Column& c : columns) {
    Spring& s =
        springs_.emplace_back(Spring{stiffness * c.area, c.lift.dot(normal), c.spring, c.full(limit)});
    std::sort(s.start.begin(), s.start.end());
    all += c.area;
    gains += c.area * s.gain;
  }
  if (all > 0) gain_ = gains / all;
}

double Bed::force(double x) const {
  double f = 0;
  for (const Spring& s : springs_) f += s.stiffness * s.gain * s.compressed(shift(s, x), limit_).first;
  return f;
}

double Bed::slope(double x) const {
  double k = 0;
  for (const Spring& s : springs_) {
    const double by = shift(s, x);
    if (s.full && by >= 0) continue;
    const double yielding = s.full || !(s.start[2] + by > limit_) ? 0 : s.above(by - limit_).part;
    k += s.stiffness * s.gain * s.gain * (s.above(by).part - yielding);
  }
  return k;
}

double Bed::crushing(const Spring& s, double shift) const {
  if (std::isinf(limit_)) return 0;
  return s.stiffness * (s.full ? s.above(0).first * shift : limit_ * s.above(shift - limit_).first);
}

double Bed::work(double x) const {
  double w = 0;
  for (const Spring& s : springs_) {
    const double by = shift(s, x);
    w += held(s, by) + (by > 0 || !s.full ? crushing(s, by) : 0.0);
  }
  return w;
}

double Bed::stored(double x) const {
  double w = 0;
  for (const Spring& s : springs_) w += held(s, shift(s, x));
  return w;
}

double Bed::way_from(double x) const { return rested_ ? std::min(x, start_) : x; }

double Bed::before(double x) const {
  double w = crushing_before(x);
  for (const Spring& s : springs_)
    w += s.full ? 0.5 * s.stiffness * s.above(std::max(shift(s, x), 0.0)).second
                : held(s, shift(s, x));  // those that have risen, by less than what counts as full, held more
  return w;
}

double Bed::crushing_before(double x) const {
  double w = 0;
  for (const Spring& s : springs_)
    if (s.full && shift(s, x) < 0) w += crushing(s, shift(s, x));
  return w;
}

double Bed::crushed_after(double x) const {
  // What an elastic bed lets lie unloaded comes back as the block has left it: by what was found, which the
  // step's own motion along one normal is not.
  if (std::isinf(limit_)) return std::min(crushed_, std::max(start_ + beyond_, 0.0));
  return std::max(crushed_, start_ + beyond_ + gain_ * (x - start_) - limit_);
}

}  // namespace talus::contact
