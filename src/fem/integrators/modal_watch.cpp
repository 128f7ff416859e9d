// What a structure carries between the ends of modal motion, however long that is.
#include <algorithm>
#include <cmath>

#include "fem/integrators/modal_motion.hpp"

namespace talus::fem {

namespace {
constexpr double resolved = 0.2;  // omega h of the fastest mode: of an amplitude at most (omega h)^2 / 8 is
                                  // missed between two samples
}

/// Forces are linear in displacements and moments quadratic, by their arms: central differences are exact.
const ModalMotion::Carried& ModalMotion::carried() {
  if (carried_.permanent.size() > 0) return carried_;
  const Basis& l = basis();
  const AlignedVector present = fields_.u;
  const long loads = static_cast<long>(body_.loads.size());
  const auto at = [&](const VecX& u, const VecX& factor) {
    scatter(body_.dofs, u, fields_.u);
    forces_.moved();
    forces_.evaluate(fields_.time);
    forces_.load({factor.data(), static_cast<std::size_t>(factor.size())});
    return loads_.carried();
  };
  const VecX none = VecX::Zero(loads);
  Carried found{at(l.gravity, none), {}, {}};
  found.modes.resize(found.permanent.size(), l.modes.omega.size());
  found.loads.resize(found.permanent.size(), loads);
  const double small =
      1e-3 * body_.critical_step * body_.wave_speed;  // a thousandth of the smallest cell [m]
  for (long i = 0; i < l.modes.omega.size(); ++i) {
    const VecX mode = l.modes.phi.col(i);
    const double scale = small / mode.cwiseAbs().maxCoeff();
    found.modes.col(i) =
        (at(l.gravity + scale * mode, none) - at(l.gravity - scale * mode, none)) / (2 * scale);
  }
  for (long k = 0; k < loads; ++k) {
    const VecX one = VecX::Unit(loads, k), u = l.correction.col(k);
    found.loads.col(k) = 0.5 * (at(l.gravity + u, one) - at(l.gravity - u, -one));
  }
  carried_ = std::move(found);
  fields_.u = present;
  forces_.moved();
  return carried_;
}

/// Whether what moves is no more than what counts as rest, and no load is about to change that.
bool ModalMotion::at_rest(const VecX& next) const {
  const Basis& l = basis_;
  const VecX about = q_ - l.modes.omega.cwiseAbs2().cwiseInverse().cwiseProduct(l.participation * factor_);
  const double moving = 0.5 * (rate_.squaredNorm() + l.modes.omega.cwiseProduct(about).squaredNorm());
  return next == factor_ && moving <= 1e-8 * fields_.reference_kinetic;
}

/// The motion from t to t + h, over which loads go linearly to the factors `next`: displacements as often as
/// the fastest mode asks for, forces as their exact means,
///
///   int q dt = -(x' + alpha x) / omega^2 |_0^h + int level dt,   x = q - level
void ModalMotion::watch(double t, double h, const VecX& next) {
  const Carried& f = carried();
  const Basis& l = basis_;
  const VecX& omega = l.modes.omega;
  const long modes = omega.size(), forces = loads_.forces_carried(), moves = f.permanent.size() - forces;
  const double spacing = std::max(body_.critical_step, std::min(load_window, resolved / omega[modes - 1]));
  const long steps = at_rest(next) ? 1 : std::max(1L, static_cast<long>(std::ceil(h / spacing)));
  const double d = h / static_cast<double>(steps);
  using Each = Eigen::ArrayXd;  // mode
  Each xx = Each::Ones(modes), xv = Each::Zero(modes), vx = xv, vv = xx;
  for (long i = 0; i < modes; ++i) {
    advance_mode(omega[i], body_.alpha, 0, 0, d, xx[i], vx[i]);
    advance_mode(omega[i], body_.alpha, 0, 0, d, xv[i], vv[i]);
  }
  const Each squares = omega.array().square(), p = l.participation * factor_, p1 = l.participation * next;
  const Each slope = (p1 - p) / h / squares, level = (p - body_.alpha * slope) / squares;
  Each x = q_.array() - level, v = rate_.array() - slope;
  const auto factor_at = [&](double time) -> VecX { return factor_ + time / h * (next - factor_); };
  Each area = Each::Zero(modes);
  double since = 0;
  for (long j = 1; j <= steps; ++j) {
    const double at = d * static_cast<double>(j);
    const Each x1 = xx * x + xv * v, v1 = vx * x + vv * v;
    area += d * (level + (at - 0.5 * d) * slope) - (v1 - v + body_.alpha * (x1 - x)) / squares;
    x = x1, v = v1, since += d;
    const VecX q = x + level + at * slope;
    loads_.displace(t + at, f.permanent.tail(moves) + f.modes.bottomRows(moves) * q +
                                f.loads.bottomRows(moves) * factor_at(at));
    if (since >= LoadTrack::reaction_bin * (1 - 1e-9) || j == steps) {
      const VecX mean = area / since;
      loads_.carry(t + at, since,
                   f.permanent.head(forces) + f.modes.topRows(forces) * mean +
                       f.loads.topRows(forces) * factor_at(at - 0.5 * since));
      area.setZero(), since = 0;
    }
    if (!LoadTrack::stress_due(t + at - d, t + at)) continue;
    scatter(body_.dofs, displacement(q, factor_at(at)), fields_.u);
    forces_.moved();
    loads_.watch_stress(t + at);
  }
}

}  // namespace talus::fem
