#include "coupling/springs/bond_swing.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "coupling/rows/contact_rows.hpp"
#include "dda/kinematics.hpp"

namespace talus::coupling {
namespace {

constexpr double far_away = 1;   // T [s]
constexpr double solved = 1e-3;  // of the loads that is left by (1): a part of what (2) tells
constexpr int most_iterations = 300;

/// A spring that presses or pulls: its three directions as rows of the bodies, -1: what stands fast.
struct Row {
  std::size_t touch;
  int a, b;
  std::array<Vec6, 3> of_a, of_b;
  std::array<double, 3> stiffness;  // along the normal, along both tangents [N/m]
  Eigen::Matrix<double, 3, 2> tangents;
};

class Hanging {
 public:
  Hanging(const IslandContext& in, const Step& step);
  std::vector<bool> give_way() const;

 private:
  int body_of(const Partner& a) const {
    return a.kind == Partner::Kind::block ? in_.local[static_cast<std::size_t>(a.index)] : -1;
  }
  void add(std::size_t touch);
  void load(const Touch& t);
  void find_parts();
  void take_means();
  double stretch(const Row& row, int k, const VecX& x) const {
    return (row.b < 0 ? 0.0 : row.of_b[static_cast<std::size_t>(k)].dot(x.segment<6>(6 * row.b))) -
           (row.a < 0 ? 0.0 : row.of_a[static_cast<std::size_t>(k)].dot(x.segment<6>(6 * row.a)));
  }
  VecX times_mass(const VecX& x) const;
  VecX times_stiffness(const VecX& x) const;
  VecX rest() const;  // x of (1), by conjugate gradients

  const IslandContext& in_;
  const Step& step_;
  std::vector<Row> rows_;
  std::vector<Eigen::Matrix<double, 6, 6>> mass_, alone_;  // A, K + A / T^2 of each body with the others held
  std::vector<int> part_;                                  // of the body
  std::vector<char> held_;                                 // of the part: by what stands fast
  VecX force_, velocity_;
};

Hanging::Hanging(const IslandContext& in, const Step& step) : in_(in), step_(step) {
  const auto n = static_cast<Eigen::Index>(step.bodies.size());
  force_ = velocity_ = VecX::Zero(6 * n);
  for (const Body& b : step.bodies) {
    const auto i = static_cast<Eigen::Index>(mass_.size());
    const auto k = static_cast<std::size_t>(b.block);
    Mat12 mass, inverse;
    dda::impulse_mass(in.model, in.state, b.block, true, mass, inverse);
    mass_.push_back(mass.topLeftCorner<6, 6>());
    force_.segment<3>(6 * i) = in.model.blocks[k].mass * in.model.gravity;
    velocity_.segment<6>(6 * i) << in.state.v[k], in.state.w[k];
    alone_.push_back(mass_.back() / (far_away * far_away));
  }
  for (std::size_t t = 0; t < step.touches.size(); ++t) {
    if (step.touches[t].b < 0) continue;  // between structures
    load(step.touches[t]);
    if (step.touches[t].stiffness > 0 &&
        (step.touches[t].at.gap <= in.scale.touch_gap() || step.touches[t].pulls()))
      add(t);
  }
  find_parts();
  take_means();
}

/// What presses and pulls at present; hard contacts and friction as in the last step.
void Hanging::load(const Touch& t) {
  Vec3 f = t.warm;
  if (t.stiffness > 0) {
    f = t.at.normal * t.normal_law.force(t.pulls() ? -t.at.gap : std::max(0.0, -t.at.gap));
    if (t.shear_stiffness > 0)
      f -= t.shear_stiffness * t.shear;
    else
      f += t.warm - t.at.normal * t.at.normal.dot(t.warm);
  }
  const auto on = [&](int body, const Vec3& x, const Vec3& force) {
    if (body < 0) return;
    const auto k = static_cast<std::size_t>(step_.bodies[static_cast<std::size_t>(body)].block);
    force_.segment<3>(6 * body) += force;
    force_.segment<3>(6 * body + 3) += (x - in_.state.c[k]).cross(force);
  };
  on(in_.local[static_cast<std::size_t>(t.b)], t.at.point_b, f);
  on(body_of(t.a), t.at.point_a, -f);
}

void Hanging::add(std::size_t touch) {
  const Touch& t = step_.touches[touch];
  const Mat3 frame = contact_frame(t.at.normal);
  Row row{touch, body_of(t.a), in_.local[static_cast<std::size_t>(t.b)], {}, {}, {}, frame.rightCols<2>()};
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    row.stiffness[i] = k == 0 ? t.stiffness : t.shear_stiffness;
    const auto of = [&](int body, const Vec3& x) -> Vec6 {
      Vec6 j = Vec6::Zero();
      if (body < 0) return j;
      const auto block = static_cast<std::size_t>(step_.bodies[static_cast<std::size_t>(body)].block);
      j << frame.col(k), (x - in_.state.c[block]).cross(Vec3(frame.col(k)));
      alone_[static_cast<std::size_t>(body)] += row.stiffness[i] * j * j.transpose();
      return j;
    };
    row.of_a[i] = of(row.a, t.at.point_a);
    row.of_b[i] = of(row.b, t.at.point_b);
  }
  rows_.push_back(row);
}

void Hanging::find_parts() {
  part_.resize(step_.bodies.size());
  std::iota(part_.begin(), part_.end(), 0);
  const auto root = [&](int i) {
    while (part_[static_cast<std::size_t>(i)] != i) i = part_[static_cast<std::size_t>(i)];
    return i;
  };
  for (const Row& row : rows_)
    if (row.a >= 0 && row.b >= 0) part_[static_cast<std::size_t>(root(row.a))] = root(row.b);
  for (std::size_t i = 0; i < part_.size(); ++i) part_[i] = root(static_cast<int>(i));
  held_.assign(part_.size(), 0);
  for (const Row& row : rows_)
    for (const int body : {row.a, row.b})
      if (body >= 0 && (row.a < 0 || row.b < 0))
        held_[static_cast<std::size_t>(part_[static_cast<std::size_t>(body)])] = 1;
}

/// What flies on as one does not swing.
void Hanging::take_means() {
  std::vector<double> mass(part_.size(), 0.0);
  std::vector<Vec3> momentum(part_.size(), Vec3::Zero());
  for (std::size_t i = 0; i < part_.size(); ++i) {
    const auto p = static_cast<std::size_t>(part_[i]);
    const double m = mass_[i](0, 0);
    mass[p] += m, momentum[p] += m * velocity_.segment<3>(6 * static_cast<Eigen::Index>(i));
  }
  for (std::size_t i = 0; i < part_.size(); ++i)
    if (const auto p = static_cast<std::size_t>(part_[i]); held_[p] == 0)
      velocity_.segment<3>(6 * static_cast<Eigen::Index>(i)) -= momentum[p] / mass[p];
}

VecX Hanging::times_mass(const VecX& x) const {
  VecX y(x.size());
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    y.segment<6>(at) = mass_[i] * x.segment<6>(at);
  }
  return y;
}

VecX Hanging::times_stiffness(const VecX& x) const {
  VecX y = VecX::Zero(x.size());
  for (const Row& row : rows_)
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double f = row.stiffness[i] * stretch(row, k, x);
      if (row.b >= 0) y.segment<6>(6 * row.b) += f * row.of_b[i];
      if (row.a >= 0) y.segment<6>(6 * row.a) -= f * row.of_a[i];
    }
  return y;
}

VecX Hanging::rest() const {
  std::vector<Eigen::LLT<Eigen::Matrix<double, 6, 6>>> factors;
  for (const auto& m : alone_) factors.emplace_back(m);
  const auto precondition = [&](const VecX& r) {
    VecX z(r.size());
    for (std::size_t i = 0; i < factors.size(); ++i) {
      const auto at = 6 * static_cast<Eigen::Index>(i);
      z.segment<6>(at) = factors[i].solve(r.segment<6>(at));
    }
    return z;
  };
  VecX x = VecX::Zero(force_.size()), r = force_, z = precondition(r), p = z;
  const double first = r.dot(z);
  double rz = first;
  for (int i = 0; i < most_iterations && rz > solved * solved * first; ++i) {
    const VecX q = times_stiffness(p) + times_mass(p) / (far_away * far_away);
    const double alpha = rz / p.dot(q);
    x += alpha * p, r -= alpha * q;
    z = precondition(r);
    const double next = r.dot(z);
    p = z + next / rz * p;
    rz = next;
  }
  return x;
}

std::vector<bool> Hanging::give_way() const {
  const VecX x = rest(), mx = times_mass(x), kx = times_stiffness(x), mv = times_mass(velocity_),
             kv = times_stiffness(velocity_);
  struct Swing {
    double xkx = 0, xmx = 0, vkv = 0, vmv = 0;
    double rate_sq() const { return xkx >= vmv ? xkx / xmx : vkv / vmv; }
  };
  std::vector<Swing> swings(part_.size());
  for (std::size_t i = 0; i < part_.size(); ++i) {
    Swing& s = swings[static_cast<std::size_t>(part_[i])];
    const auto at = 6 * static_cast<Eigen::Index>(i);
    s.xkx += x.segment<6>(at).dot(kx.segment<6>(at)), s.xmx += x.segment<6>(at).dot(mx.segment<6>(at));
    s.vkv += velocity_.segment<6>(at).dot(kv.segment<6>(at));
    s.vmv += velocity_.segment<6>(at).dot(mv.segment<6>(at));
  }
  std::vector<bool> give_way(step_.touches.size(), false);
  for (const Row& row : rows_) {
    const Touch& t = step_.touches[row.touch];
    const int body = row.b >= 0 ? row.b : row.a;
    if (!loses_strength(in_, t) || body < 0) continue;
    const double rate_sq = swings[static_cast<std::size_t>(part_[static_cast<std::size_t>(body)])].rate_sq(),
                 quarter = rate_sq > 0 ? 0.5 * std::numbers::pi / std::sqrt(rate_sq) : 0.0;
    std::array<double, 3> middle{}, amplitude{};  // of the stretch [m]
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double to_rest = stretch(row, k, x);
      middle[i] = to_rest + (k == 0 ? t.at.gap : row.tangents.col(k - 1).dot(t.shear));
      amplitude[i] = std::hypot(to_rest, quarter * stretch(row, k, velocity_));
    }
    const double bond = t.bond(), pull = t.normal_law.stiffness * (middle[0] + amplitude[0]),
                 least = t.pulls() ? -pull : t.normal_law.force(std::max(0.0, -middle[0] - amplitude[0])),
                 shear = t.shear_stiffness *
                         std::hypot(std::abs(middle[1]) + amplitude[1], std::abs(middle[2]) + amplitude[2]);
    give_way[row.touch] =
        (bond > 0 && pull > bond) || (t.cohesion() > 0 && shear > t.law->friction * least + t.cohesion());
  }
  return give_way;
}

}  // namespace

bool loses_strength(const IslandContext& in, const Touch& t) {
  return t.pulls() || (t.stiffness > 0 && t.shear_stiffness > 0 && t.cohesion() > 0 &&
                       t.at.gap <= in.scale.touch_gap() && !in.deformable_structure(t));
}

std::vector<bool> may_give_way(const IslandContext& in, const Step& step) {
  return Hanging(in, step).give_way();
}

}  // namespace talus::coupling
