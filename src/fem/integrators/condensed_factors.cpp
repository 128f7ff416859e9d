#include "fem/integrators/condensed_factors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace talus::fem {

namespace {
constexpr std::size_t least_levels = 2, most_levels = 6;
constexpr double turned_most = 0.002;   // rotation of a cell that K does not follow [rad]: slender parts that
                                        // lean show their axial stiffness to what is soft in bending
constexpr double cracked_least = 0.02;  // damage that K takes for granted once a cell has any
constexpr double crushed_stiffest = 1.05;  // of crushed concrete
constexpr std::size_t room_of_levels =
    32'000'000;  // [bytes] that their factors may fill, if there are more than the least

/// Of the columns that are kept for later steps: as much as 128 whole ones of three directions take, or 32 MB
/// [bytes].
std::size_t room_of_columns(int dofs) {
  return std::min<std::size_t>(128 * 3 * sizeof(double) * static_cast<std::size_t>(dofs), 32'000'000);
}

/// How many lengths of step keep their factor, of so many bytes each.
std::size_t levels_kept(std::size_t factor) {
  return std::clamp(room_of_levels / std::max<std::size_t>(factor, 1), least_levels, most_levels);
}
}  // namespace

bool CondensedFactors::possible() const {
  return body_.spec.integrator != "explicit" && !body_.partition && !body_.supports.none &&
         body_.dofs.size > 0 && body_.dofs.size <= largest_factored_system && lowest_frequency() > 0;
}

double CondensedFactors::lowest_frequency() const {
  if (lowest_frequency_ != 0) return lowest_frequency_;
  lowest_frequency_ = -1;
  try {
    const double omega = body_.omega_1 > 0 ? body_.omega_1 : body_.elastic->first_frequency(body_.built_mass);
    if (omega * body_.critical_step > 1e-6) lowest_frequency_ = omega;
  } catch (const std::exception& e) {
    // Supports that leave it free to move, or no room for the factor: explicit steps need none.
    body_.report(fmt::format("structure {}: explicit steps alone: {}", body_.spec.name, e.what()));
  }
  return lowest_frequency_;
}

/// Most that the law of a damaged cell may come to, over sound concrete. A crack takes Poisson's effect away,
/// which leaves pressed concrete E/2 in shear for E / (2 (1 + nu)), and its faces interlock with up to that
/// of sound concrete again. By steps, so that growing cracks seldom ask for new factors.
double CondensedFactors::stiffest(int cell) const {
  if (!body_.damage || body_.damage->cells().empty()) return 1;
  const double tension = body_.damage->tension(cell), nu = body_.spec.poisson;
  const double d = tension > cracked_least ? std::min(1.0, std::ceil(4 * tension) / 4) : cracked_least;
  const bool interlocks = body_.spec.damage == "concrete" && body_.concrete && body_.concrete->aggregate > 0;
  const double cracked = (1 + nu) / (1 + nu * (1 - d)) + (interlocks ? d : 0.0);
  return std::max(cracked, body_.damage->compression(cell) > cracked_least ? crushed_stiffest : 1.0);
}

Mat3 CondensedFactors::frame_of(int cell) const {
  Mat3 t = Mat3::Identity();
  const Mat3 h = stresses_.gradient(cell), f = t + h;
  if (h.norm() > turned_most && f.determinant() > 0) t = nearest_rotation(f);
  return std::sqrt(stiffest(cell)) * t;
}

void CondensedFactors::follow_frames() {
  if (!body_.finite) return;
  const auto cells = static_cast<int>(body_.mesh.hexes.size());
  std::vector<Mat3> now(body_.mesh.hexes.size(), Mat3::Identity());
  bool stale = false;
  for (int cell = 0; cell < cells; ++cell) {
    const auto c = static_cast<std::size_t>(cell);
    if (body_.live[c] == 0) continue;
    now[c] = frame_of(cell);
    stale = stale || (now[c] - (frames_.empty() ? Mat3(Mat3::Identity()) : frames_[c])).norm() >
                         std::sqrt(2.0) * turned_most;
  }
  if (stale) set_frames(std::move(now));
}

void CondensedFactors::set_frames(std::vector<Mat3> frames) {
  frames_ = std::move(frames);
  mass_.clear();  // made again
}

void CondensedFactors::assemble() {
  body_revision_ = body_.revision;
  if (!levels_.empty()) spent_ = std::move(levels_.back());
  levels_.clear();
  stiffness_ = {};
  mass_.assign(body_.dofs.size, 1.0);
  moves_.assign(body_.dofs.size, 0);
  for (int d = 0; d < body_.dofs.size; ++d)
    if (const double mass = body_.mass[body_.dofs.node(d)]; mass > 0) mass_[d] = mass, moves_[d] = 1;
  const bool whole =
      frames_.empty() && std::all_of(body_.live.begin(), body_.live.end(), [](char on) { return on != 0; });
  const std::vector<Mat3>* frames = frames_.empty() ? nullptr : &frames_;
  if (!whole)
    stiffness_ =
        assemble_stiffness(body_.mesh, body_.dofs, body_.shear, body_.bulk, body_.elastic->springs(frames),
                           &body_.live, frames, &body_.elastic->stiffness());
}

const SymmetricMatrix& CondensedFactors::stiffness() const {
  return stiffness_.n > 0 ? stiffness_ : body_.elastic->stiffness();
}

void CondensedFactors::use(double h, bool euler) {
  body_.elastic->stiffness();
  if (mass_.empty() || body_revision_ != body_.revision) assemble();
  // Twelve digits: intervals that differ by rounding share one factor, and a restart finds the same step.
  const double key = std::strtod(fmt::format("{:.11e}", h).c_str(), nullptr);
  const double phase = lowest_frequency() * key;
  const bool damped = body_.spec.damping_ratio > 0;
  const double delta = euler    ? 0.5
                       : damped ? std::min(0.1 * phase * phase, 0.5)
                                : 0.0;  // damping of the first mode 0.1 phase^3
  const double theta = 0.5 + delta, scale = key * key * theta * theta,
               shift = (1 + 0.5 * body_.alpha * key) / scale;
  const auto found = std::find_if(levels_.begin(), levels_.end(), [&](const auto& level) {
    return level->h == key && level->theta == theta;
  });
  if (found != levels_.end()) {
    std::rotate(found, found + 1, levels_.end());
    return;
  }
  if (!levels_.empty() && levels_.size() >= levels_kept(levels_.back()->factor.bytes())) {
    spent_ = std::move(levels_.front());
    levels_.erase(levels_.begin());
  }
  body_.elastic->forget_factor();  // that of the structure at rest is made again where it is asked for
  std::unique_ptr<Level> level = std::move(spent_);
  if (level)
    level->factor.again(stiffness(), shift, mass_, &ordering_);
  else
    level.reset(new Level{0, {stiffness(), shift, mass_, &ordering_}, 0, 0, {}});
  level->h = key, level->theta = theta, level->scale = scale;
  level->column.clear();
  levels_.push_back(std::move(level));
}

std::size_t CondensedFactors::Column::bytes() const {
  std::size_t n = with.size() * (sizeof(Mat3) + 4 * sizeof(void*));
  for (const HalfColumn& y : half) n += y.value.size() * sizeof(double);
  return n;
}

/// Lets go of the columns that the step at hand has not asked for, once all together take too much.
void CondensedFactors::drop_idle_columns() {
  std::size_t bytes = 0;
  for (const auto& level : levels_)
    for (const auto& [node, column] : level->column) bytes += column.bytes();
  if (bytes <= room_of_columns(body_.dofs.size)) return;
  for (const auto& level : levels_)
    std::erase_if(level->column, [this](const auto& entry) { return entry.second.used < step_; });
}

/// The columns of these nodes at the step at hand, marked as asked for.
void CondensedFactors::find_columns(std::span<const int> nodes) {
  Level& level = *levels_.back();
  bool all = true;
  for (const int node : nodes) {
    const auto found = level.column.find(node);
    if (found != level.column.end())
      found->second.used = step_;
    else
      all = false;
  }
  if (all) return;
  drop_idle_columns();
  for (const int node : nodes) {
    const auto [at, fresh] = level.column.try_emplace(node);
    if (!fresh) continue;
    at->second.used = step_;
    for (std::size_t k = 0; k < 3; ++k)
      if (const int d = body_.dofs.number[static_cast<std::size_t>(node)][k];
          d >= 0 && moves_[static_cast<std::size_t>(d)])
        at->second.half[k] = level.factor.half_column(d);
  }
}

MatX CondensedFactors::compliance(std::span<const int> nodes) {
  find_columns(nodes);
  Level& level = *levels_.back();
  std::vector<Column*> column;
  for (const int node : nodes) column.push_back(&level.column.find(node)->second);
  const auto m = static_cast<Eigen::Index>(nodes.size());
  MatX w(3 * m, 3 * m);
  for (Eigen::Index i = 0; i < m; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const bool ordered = nodes[static_cast<std::size_t>(i)] <= nodes[static_cast<std::size_t>(j)];
      const Eigen::Index
          low = ordered ? i : j,
          high = ordered ? j : i;  // by the nodes' numbers: the digits do not depend on the order asked for
      Column &of = *column[static_cast<std::size_t>(low)], &other = *column[static_cast<std::size_t>(high)];
      const auto [at, fresh] = of.with.try_emplace(nodes[static_cast<std::size_t>(high)]);
      if (fresh)
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b)
            at->second(a, b) = level.factor.product(of.half[static_cast<std::size_t>(a)],
                                                    other.half[static_cast<std::size_t>(b)]) /
                               level.scale;
      w.block<3, 3>(3 * low, 3 * high) = at->second;
      w.block<3, 3>(3 * high, 3 * low) = at->second.transpose();
    }
  return w;
}

/// One half more, P^T L^-T sum p_i y_i.
void CondensedFactors::push(std::span<const NodeImpulse> impulses, VecX& v) {
  Level& level = *levels_.back();
  std::vector<int> nodes;
  for (const NodeImpulse& p : impulses)
    if (!p.impulse.isZero(0)) nodes.push_back(p.node);
  if (nodes.empty()) return;
  find_columns(nodes);
  VecX z = VecX::Zero(body_.dofs.size), moved(body_.dofs.size);
  for (const NodeImpulse& p : impulses)
    for (std::size_t k = 0; k < 3; ++k)
      if (p.impulse[static_cast<Eigen::Index>(k)] != 0)
        level.factor.add(level.column.find(p.node)->second.half[k],
                         p.impulse[static_cast<Eigen::Index>(k)] / level.scale, z.data());
  level.factor.back(z.data(), moved.data());
  for (int d = 0; d < body_.dofs.size; ++d)
    if (moves_[static_cast<std::size_t>(d)]) v[d] += moved[d];
}

void CondensedFactors::drop() {
  levels_.clear();
  spent_.reset();
}

double CondensedFactors::memory() const {
  if (!possible()) return 0;
  const std::size_t factor_bytes =
      body_.elastic->factor().bytes();  // stands now, and makes way for the first of them
  const std::size_t followed = body_.finite
                                   ? body_.elastic->stiffness().value.size() * (sizeof(double) + sizeof(int))
                                   : 0;  // K that has turned or cracked, beside that as built
  return static_cast<double>((levels_kept(factor_bytes) - 1) * factor_bytes +
                             room_of_columns(body_.dofs.size) + followed);
}

void CondensedFactors::save(std::vector<double>& state) const {
  state.push_back(frames_.empty() ? 0 : 1);
  for (const Mat3& t : frames_) state.insert(state.end(), t.data(), t.data() + 9);
}

void CondensedFactors::restore(StateReader& state) {
  std::vector<Mat3> frames(state.next() != 0 ? body_.mesh.hexes.size() : 0);
  for (Mat3& t : frames) std::copy_n(state.take(9), 9, t.data());
  if (frames != frames_) set_frames(std::move(frames));
}

}  // namespace talus::fem
