#include "fem/rebar/rebar_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/reject.hpp"

namespace talus::rebar {
namespace {

void require_strengths(Requirements& needs, const Strengths& s) {
  needs.require(s.f_ck >= 8e6 && s.f_ck <= 130e6, "section.f_ck", s.f_ck, "must be between 8 and 130 MPa",
                "give it in Pa");
  needs.require(s.gamma_c >= 1 && s.gamma_s >= 1, "section.gamma", std::min(s.gamma_c, s.gamma_s),
                "partial factors must be at least 1", "1.5 and 1.15, or 1.2 and 1.0 for accidental actions");
}

/// Resistance of a section without stirrups per area, before the normal stress [Pa].
double concrete_shear(double d, double ratio, const Strengths& s) {
  const double f_ck = s.f_ck / 1e6, k = std::min(2.0, 1 + std::sqrt(0.2 / d));
  return 1e6 * std::max(0.18 / s.gamma_c * k * std::cbrt(100 * std::min(0.02, ratio) * f_ck),
                        0.035 * std::pow(k, 1.5) * std::sqrt(f_ck));
}

}  // namespace

ParabolaRectangle::ParabolaRectangle(double f_ck) : eps_c2(2e-3), eps_cu2(3.5e-3), n(2) {
  const double grade = std::min(f_ck / 1e6, 90.0);
  if (grade <= 50) return;
  const double below_90 = std::pow((90 - grade) / 100, 4);
  eps_c2 = 1e-3 * (2 + 0.085 * std::pow(grade - 50, 0.53));
  eps_cu2 = 1e-3 * (2.6 + 35 * below_90);
  n = 1.4 + 23.4 * below_90;
}

double ParabolaRectangle::stress(double eps) const {
  if (eps <= 0) return 0;
  return eps >= eps_c2 ? 1.0 : 1 - std::pow(1 - eps / eps_c2, n);
}

ShearResistance shear_resistance(const ShearInput& in, const Strengths& s) {
  Requirements needs;
  require_strengths(needs, s);
  needs.require(in.width > 0, "section.width", in.width, "must be positive", "the least width of the web");
  needs.require(in.effective_depth > 0, "section.effective_depth", in.effective_depth, "must be positive",
                "depth less cover less half a bar");
  needs.require(in.tension_area >= 0 && in.stirrup_area_per_length >= 0, "section.steel",
                std::min(in.tension_area, in.stirrup_area_per_length), "areas must not be negative",
                "0 for none");
  needs.done();
  const double b = in.width, d = in.effective_depth, f_ck = s.f_ck / 1e6, f_cd = s.f_cd();
  const double normal = in.gross_area > 0 ? std::min(in.axial / in.gross_area, 0.2 * f_cd) : 0;
  ShearResistance r;
  r.concrete = std::max(0.0, (concrete_shear(d, in.tension_area / (b * d), s) + 0.15 * normal) * b * d);
  const double z = 0.9 * d, nu = 0.6 * (1 - f_ck / 250);
  const double ratio = std::max(0.0, normal) / f_cd;
  const double a_cw = ratio <= 0.25 ? 1 + ratio : ratio <= 0.5 ? 1.25 : 2.5 * (1 - ratio);
  const double per_cot = in.stirrup_area_per_length * z * in.stirrup_yield / s.gamma_s,
               strut = a_cw * b * z * nu * f_cd;
  // Both are equal where per_cot cot = strut cot / (1 + cot^2).
  const double balanced = per_cot > 0 ? std::sqrt(std::max(0.0, strut / per_cot - 1)) : 2.5;
  r.cot_theta = std::clamp(balanced, 1.0, 2.5);
  r.stirrups = per_cot * r.cot_theta;
  r.strut = strut / (r.cot_theta + 1 / r.cot_theta);
  r.governing = std::max(r.concrete, std::min(r.stirrups, r.strut));
  return r;
}

Section::Section(Member::Section kind, double width, double depth, double wall, std::vector<SectionBar> bars,
                 const Strengths& s)
    : bars_(std::move(bars)), strengths_(s), concrete_(s.grade > 0 ? s.grade : s.f_ck) {
  const bool round = kind == Member::Section::round;
  if (round) depth = width;
  round_ = round, extents_ = {width, depth};
  Requirements needs;
  require_strengths(needs, s);
  needs.require(width > 0, "section.width", width, "must be positive", "give the section");
  needs.require(depth > 0, "section.depth", depth, "must be positive", "give the section");
  needs.require(wall >= 0 && 2 * wall < std::min(width, depth), "section.wall_thickness", wall,
                "must be below half the section, 0 for solid", "0.3 m");
  for (const SectionBar& b : bars_) {
    const bool inside = round ? std::hypot(b.x, b.y) <= 0.5 * width
                              : std::abs(b.x) <= 0.5 * width && std::abs(b.y) <= 0.5 * depth;
    needs.require(inside, "section.bar", std::hypot(b.x, b.y), "a bar lies outside the section",
                  "coordinates are relative to the centre of the section");
    needs.require(b.area > 0 && b.yield > 0 && b.young > 0, "section.bar", b.area,
                  "area, yield stress and modulus must be positive", "correct the bar");
  }
  needs.done();
  const auto add = [&](double x, double y, double area) {
    fibres_.push_back({x, y, area});
    area_ += area;
  };
  if (round) {
    const double outer = 0.5 * width, inner = wall > 0 ? outer - wall : 0;
    constexpr int rings = 40, sectors = 160;
    for (int i = 0; i < rings; ++i) {
      const double a = inner + (outer - inner) * i / rings, b = inner + (outer - inner) * (i + 1) / rings;
      const double r =
          2.0 / 3.0 * (b * b * b - a * a * a) / (b * b - a * a);  // centre of the ring, for thin sectors
      for (int j = 0; j < sectors; ++j) {
        const double t = 2 * M_PI * (j + 0.5) / sectors;
        add(r * std::cos(t), r * std::sin(t), M_PI * (b * b - a * a) / sectors);
      }
    }
  } else {
    const auto grid = [&](double w, double h, double x0, double y0) {
      constexpr int n = 80;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          add(x0 + w * ((i + 0.5) / n - 0.5), y0 + h * ((j + 0.5) / n - 0.5), w * h / (n * n));
    };
    if (wall > 0) {
      grid(width, wall, 0, 0.5 * (depth - wall));
      grid(width, wall, 0, -0.5 * (depth - wall));
      grid(wall, depth - 2 * wall, 0.5 * (width - wall), 0);
      grid(wall, depth - 2 * wall, -0.5 * (width - wall), 0);
    } else {
      grid(width, depth, 0, 0);
    }
  }
}

namespace {

std::vector<SectionBar> crossing(const Member& m, const std::vector<Bar>& bars, double position) {
  const Vec3 ex = m.axis_x.normalized(), ey = m.axis_y.normalized(), ez = ex.cross(ey);
  std::vector<SectionBar> found;
  for (const Bar& bar : bars)
    for (std::size_t i = 1; i < bar.points.size(); ++i) {
      const Vec3 p = bar.points[i - 1] - m.base, q = bar.points[i] - m.base;
      const double a = ez.dot(p) - position, b = ez.dot(q) - position;
      if (!((a <= 0 && b > 0) || (b <= 0 && a > 0))) continue;
      const Vec3 at = p + (q - p) * (a / (a - b));
      const double along = std::abs(b - a) / (q - p).norm();  // an inclined bar acts with its component
      found.push_back({ex.dot(at), ey.dot(at), bar.area() * along, bar.steel.yield, bar.steel.young,
                       bar.steel.prestress});
    }
  return found;
}

}  // namespace

Section::Section(const Member& m, double wall, const std::vector<Bar>& bars, double position,
                 const Strengths& s)
    : Section(m.section, m.width, m.section == Member::Section::round ? m.width : m.depth, wall,
              crossing(m, bars, position), s) {}

double Section::axial_compression() const {
  double n = area_ * strengths_.f_cd();
  for (const SectionBar& b : bars_) n += b.area * (bar_stress(b, concrete_.eps_c2) - strengths_.f_cd());
  return n;
}

double Section::axial_tension() const {
  double n = 0;
  for (const SectionBar& b : bars_) n += b.area * b.yield / strengths_.gamma_s;
  return n;
}

double Section::bar_stress(const SectionBar& bar, double eps) const {
  const double f_yd = bar.yield / strengths_.gamma_s;
  return std::clamp(bar.young * eps - bar.prestress, -f_yd, f_yd);
}

Section::Point Section::at_depth(double neutral, double angle) const {
  const double cx = std::cos(angle), cy = std::sin(angle);
  const double height =
      round_ ? extents_[0] : extents_[0] * std::abs(cx) + extents_[1] * std::abs(cy);  // of the edges
  const double top = 0.5 * height;
  const double eps_c2 = concrete_.eps_c2, eps_cu2 = concrete_.eps_cu2;
  const double curvature =
      neutral <= height ? eps_cu2 / neutral : eps_c2 / (neutral - (1 - eps_c2 / eps_cu2) * height);
  Point p{0, 0};
  const double f_cd = strengths_.f_cd();
  const auto strain = [&](double t) { return curvature * (neutral - (top - t)); };
  for (const Fibre& f : fibres_) {
    const double t = f.x * cx + f.y * cy, force = f_cd * concrete_.stress(strain(t)) * f.area;
    p.axial += force;
    p.moment += force * t;
  }
  for (const SectionBar& b : bars_) {
    const double t = b.x * cx + b.y * cy, eps = strain(t);
    const double force =
        (bar_stress(b, eps) - f_cd * concrete_.stress(eps)) * b.area;  // the bar displaces concrete
    p.axial += force;
    p.moment += force * t;
  }
  return p;
}

double Section::moment(double axial, double angle) const {
  if (axial <= -axial_tension() || axial >= axial_compression()) return 0;
  double low = 1e-6, high = 1e6;  // of the neutral axis depth; the axial force grows with it
  for (int i = 0; i < 120; ++i) {
    const double mid = std::sqrt(low * high);
    (at_depth(mid, angle).axial < axial ? low : high) = mid;
  }
  return std::max(0.0, at_depth(high, angle).moment);
}

std::vector<Section::Point> Section::interaction(double angle, int points) const {
  std::vector<Point> curve;
  const double from = -axial_tension(), to = axial_compression();
  for (int i = 0; i < points; ++i) {
    const double n = from + (to - from) * i / (points - 1);
    curve.push_back({n, moment(n, angle)});
  }
  return curve;
}

}  // namespace talus::rebar
