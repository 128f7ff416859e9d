#include "verify/beam.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/bisect.hpp"
#include "core/types.hpp"

namespace talus::verify {
namespace {

using Mat4 = Eigen::Matrix4d;
constexpr int slices = 400;

/// d/ds of (w / L, psi, M L / EI, Q L^2 / EI) at s = x / L.
Mat4 transfer_rate(const Beam& b, double omega) {
  const double l = b.length, bending = b.young * b.inertia(), shear = b.kappa * b.shear_modulus() * b.area();
  Mat4 a = Mat4::Zero();
  a(0, 1) = 1;
  a(0, 3) = bending / (shear * l * l);
  a(1, 2) = 1;
  a(2, 1) = -b.density * b.inertia() * omega * omega * l * l / bending;
  a(2, 3) = -1;
  a(3, 0) = -b.density * b.area() * omega * omega * l * l * l * l / bending;
  return a;
}

/// Transfer over one slice; its norm is small, so the series is short.
Mat4 slice(const Beam& b, double omega) {
  const Mat4 a = transfer_rate(b, omega) / slices;
  Mat4 sum = Mat4::Identity(), term = Mat4::Identity();
  for (int k = 1; k < 30; ++k) sum += term = term * a / k;
  return sum;
}

Mat4 transfer(const Beam& b, double omega) {
  const Mat4 s = slice(b, omega);
  Mat4 t = Mat4::Identity();
  for (int i = 0; i < slices; ++i) t = s * t;
  return t;
}

double determinant(const Beam& b, double omega) {
  const Mat4 t = transfer(b, omega);
  return t(2, 2) * t(3, 3) - t(2, 3) * t(3, 2);
}

/// q'' + omega^2 q = p + s t over h, exact.
void advance(double omega, double p, double s, double h, double& q, double& rate) {
  const double w2 = omega * omega, x = q - p / w2, v = rate - s / w2;
  const double c = std::cos(omega * h), n = std::sin(omega * h);
  q = x * c + v / omega * n + (p + s * h) / w2;
  rate = -x * omega * n + v * c + s / w2;
}

}  // namespace

double Beam::tip_deflection(double force) const {
  return force * length * length * length / (3 * young * inertia()) +
         force * length / (kappa * shear_modulus() * area());
}

double Beam::uniform_deflection(double load) const {
  return load * std::pow(length, 4) / (8 * young * inertia()) +
         load * length * length / (2 * kappa * shear_modulus() * area());
}

std::vector<BeamMode> cantilever_modes(const Beam& b, int count) {
  std::vector<BeamMode> modes;
  // Roots lie at least a tenth of the first Euler-Bernoulli frequency apart.
  const double step =
      0.1 * 3.516 * std::sqrt(b.young * b.inertia() / (b.density * b.area())) / (b.length * b.length);
  double low = step, f_low = determinant(b, low);
  while (static_cast<int>(modes.size()) < count) {
    const double high = low + step, f_high = determinant(b, high);
    if ((f_low < 0) != (f_high < 0)) {
      BeamMode mode;
      mode.omega =
          bisect(low, high, [&](double at) { return (determinant(b, at) < 0) == (f_low < 0); }).first;
      const Mat4 t = transfer(b, mode.omega), s = slice(b, mode.omega);
      Eigen::Vector4d y(0, 0, -t(2, 3), t(2, 2));  // free end: no moment; no shear follows at a root
      double mass = 0;
      for (int i = 0; i <= slices; ++i) {
        const double weight = (i == 0 || i == slices ? 1.0
                               : i % 2               ? 4.0
                                                     : 2.0) /
                              (3.0 * slices) * b.length;  // Simpson
        const double w = y[0] * b.length;
        mass += weight * b.density * (b.area() * w * w + b.inertia() * y[1] * y[1]);
        if (i < slices) y = s * y;
      }
      mode.tip = y[0] * b.length / std::sqrt(mass);
      modes.push_back(mode);
    }
    low = high;
    f_low = f_high;
  }
  return modes;
}

std::vector<double> tip_response(const std::vector<BeamMode>& modes,
                                 const std::vector<std::pair<double, double>>& history,
                                 const std::vector<double>& times) {
  const auto force = [&](double t) {
    for (std::size_t i = 1; i < history.size(); ++i)
      if (t <= history[i].first) {
        const double share = (t - history[i - 1].first) / (history[i].first - history[i - 1].first);
        return history[i - 1].second + share * (history[i].second - history[i - 1].second);
      }
    return history.back().second;
  };
  std::vector<double> stops = times;
  for (const auto& point : history)
    if (point.first > history.front().first && point.first < times.back()) stops.push_back(point.first);
  std::sort(stops.begin(), stops.end());
  stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
  std::vector<double> u(times.size(), 0.0);
  for (const BeamMode& mode : modes) {
    double t = history.front().first, q = 0, rate = 0;
    std::size_t next = 0;
    for (double stop : stops) {
      if (stop > t) {
        const double h = stop - t, p = force(t);
        advance(mode.omega, p, (force(stop) - p) / h, h, q, rate);
        t = stop;
      }
      while (next < times.size() && times[next] <= stop) u[next++] += mode.tip * mode.tip * q;
    }
  }
  return u;
}

std::vector<double> frequencies_of(const std::vector<double>& samples, double dt) {
  const int n = static_cast<int>(samples.size()), columns = n / 3, rows = n - columns;
  MatX hankel(rows, columns + 1);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j <= columns; ++j)
      hankel(i, j) = samples[static_cast<std::size_t>(std::min(i + j, n - 1))];
  // Any basis of the space of the rows gives the same poles.
  Eigen::ColPivHouseholderQR<MatX> qr(hankel.transpose());
  qr.setThreshold(1e-8);
  const MatX basis = MatX(qr.householderQ()).leftCols(qr.rank());
  const MatX shift = basis.topRows(columns).colPivHouseholderQr().solve(basis.bottomRows(columns));
  const Eigen::VectorXcd poles = Eigen::EigenSolver<MatX>(shift, false).eigenvalues();
  std::vector<double> f;
  for (int i = 0; i < poles.size(); ++i)
    if (const double turn = std::arg(poles[i]); turn > 0 && std::abs(std::abs(poles[i]) - 1) < 0.02)
      f.push_back(turn / (2 * std::numbers::pi * dt));
  std::sort(f.begin(), f.end());
  return f;
}

}  // namespace talus::verify
