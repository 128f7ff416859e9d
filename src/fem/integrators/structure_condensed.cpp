// Condensed steps: the midpoint rule with cached factors, an affine map of the contact impulses.
//
//   A dv = h (f_ext - f_int(u_n) - alpha M v_n) - h^2 theta K v_n + p,   u_np = u_n + h (v_n + theta dv)
//   A = (1 + alpha h/2) M + h^2 theta^2 K,   W = J A^-1 J^T,   theta = 1/2 + delta
//
// K is the stiffness of the cells that are left, turned with them, and of cracked ones the most that they may
// have (frame_of()): nothing is stiffer. Where the structure is linear this is the midpoint rule itself, and
// with delta = 0 keeps the energy to round-off. Damaged cells and bars are softer than K: f_int(u_n) is
// theirs, and K - K_now acts as a viscosity h/2 (K - K_now), which is stable and vanishes with h; were K the
// softer one, motion would grow from step to step. delta, only where there is damping, falls with h^2 and
// damps what the step does not resolve.
//
// W is made of halves of the solutions, W_ij = y_i . y_j with y_i = L^-1 P e_i, A = scale P^T L L^T P: of a
// node of the skin y is zero but for the way from its place in the elimination tree to the root, a small part
// of the whole. What the contacts do beside v_hat is then one half more, P^T L^-T sum p_i y_i.
//
// After explicit steps parts of a structure ring faster than the step resolves. Of a node that a contact
// holds the midpoint rule would move the skin by h v_n / 2, many times its amplitude, and friction would keep
// it there, strained. Where there is damping the first step is therefore that of backward Euler, theta = 1,
// from velocities that h resolves, without (1 - A^-1 M)^3 v_n [rannacher1984]: a node that is held stays
// where it is. What that would take of the motion is to be little (may_begin()).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <unordered_map>

#include "core/error.hpp"
#include "fem/integrators/structure_linear.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

struct Condensed {
  struct Column {
    std::array<HalfColumn, 3> half;  // of a node's three directions, none of one that is held or has no mass
    std::unordered_map<int, Mat3> with;  // their products with those of nodes of no lower number, of A^-1
    long used = 0;                       // number of the last step that asked for it
    std::size_t bytes() const {
      std::size_t n = with.size() * (sizeof(Mat3) + 4 * sizeof(void*));
      for (const HalfColumn& y : half) n += y.value.size() * sizeof(double);
      return n;
    }
  };
  /// One length of step. All of it follows from the structure and h: what is kept between steps changes no
  /// result.
  struct Level {
    double h = 0;
    CholeskyFactor factor;                   // of K + shift M
    double theta = 0.5, scale = 0;           // A = scale (K + shift M)
    std::unordered_map<int, Column> column;  // by node
  };
  /// Lets go of the columns that the step at hand has not asked for.
  void drop_idle_columns() {
    for (const auto& level : levels)
      std::erase_if(level->column, [this](const auto& entry) { return entry.second.used < step; });
  }
  std::size_t bytes_of_columns() const {
    std::size_t n = 0;
    for (const auto& level : levels)
      for (const auto& [node, column] : level->column) n += column.bytes();
    return n;
  }
  SymmetricMatrix stiffness;           // of the cells that live; empty: the structure's own
  std::vector<std::int64_t> ordering;  // of its factors
  std::vector<double>
      mass;  // per free degree of freedom; 1 where none is left. Empty: all of this is to be made
  std::vector<char> moves;                     // of each degree of freedom, whether it has mass
  std::vector<std::unique_ptr<Level>> levels;  // the one in use last
  std::unique_ptr<Level>
      spent;               // one that is no longer true, whose room and analysis the next one takes over
  long body_revision = 0;  // that it is made for
  long step = 0;
  // the step at hand
  VecX v_hat;
  std::vector<double> before;  // state at its start
  double stored = 0;           // elastic energy then [J]
};

void CondensedDeleter::operator()(Condensed* p) const { delete p; }

namespace {
constexpr std::size_t least_levels = 2, most_levels = 6;
constexpr double turned_most = 0.002;   // rotation of a cell that K does not follow [rad]: slender parts that
                                        // lean show their axial stiffness to what is soft in bending
constexpr double cracked_least = 0.02;  // damage that K takes for granted once a cell has any
constexpr double crushed_stiffest = 1.05;  // of crushed concrete
constexpr double start_share = 10,
                 most_start_share = 0.1;  // of the energy of its fastest motion, and what it has dissipated,
                                          // that may be taken in all: times the accuracy, and at most
constexpr double least_start_share = 1e-3;  // of that, which one may take whatever the others took
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

bool FemStructure::condensable() const {
  return body_.spec.integrator != "explicit" && !body_.partition && !body_.supports.none &&
         body_.dofs.size > 0 && body_.dofs.size <= largest_factored_system && lowest_frequency() > 0;
}

double FemStructure::lowest_frequency() const {
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

/// What takes less than the accuracy's part of the stored energy in a period of the first mode leaves the
/// motion what it was, to that accuracy. Of a structure that has broken little may be stored; what it has
/// taken so far is known to the accuracy, too: a hundred periods may add that part of it [J].
double FemStructure::taken_at_ease(double h) const {
  const double share = laws_share_ * h * lowest_frequency() / (2 * M_PI), stored = std::abs(forces_.stored());
  return std::max(1e-9 * stored,
                  share * (stored + 0.01 * (energy_.works.damage_work + energy_.works.plastic_work)));
}

bool FemStructure::at_ease(double h) const {
  return forces_.dissipation() <= taken_at_ease(h) && !(body_.damage && !spent_cells(body_).empty());
}

/// What condensed steps may take in all, beside what damping and laws do [J].
double FemStructure::condensed_budget(double accuracy) const {
  return std::min(start_share * accuracy, most_start_share) *
         (fields_.reference_kinetic + energy_.works.damage_work + energy_.works.plastic_work);
}

/// Over a way s the viscosity h/2 (K - K_now) takes 1/2 s . (K - K_now) s, most of it as cracks open and
/// close: as little as the laws may take, and a small part of what damping takes in the step or, without any,
/// of the motion; more only out of the budget, half of what is left of it.
bool FemStructure::viscosity_at_ease(double h, double taken, double damped, double kinetic) const {
  constexpr double of_damping = 0.05, of_motion = 1e-3;  // in a period of the first mode
  const double always =
      taken_at_ease(h) +
      (body_.alpha > 0 ? of_damping * damped : of_motion * h * lowest_frequency() / M_PI * kinetic);
  return std::abs(taken) <= always + 0.5 * std::max(0.0, condensed_budget(laws_share_) - taken_by_condensed_);
}

bool FemStructure::loads_hold(double from, double to) const {
  return std::all_of(body_.loads.begin(), body_.loads.end(), [&](const PatchLoad& load) {
    if (load.factor(from) != load.factor(to)) return false;
    return std::all_of(load.history.begin(), load.history.end(), [&](const auto& point) {
      return point.first <= from || point.first >= to || point.second == load.factor(from);
    });
  });
}

double FemStructure::condensed_step(double t, double accuracy) {
  return condensed_step(t, accuracy, accuracy);
}

double FemStructure::condensed_step(double t, double accuracy, double laws_share) {
  // Where neither weight nor damping asked for a factor, none is made before explicit steps have cost as
  // much: a short run needs none.
  if (!factored_ && !condensed_by_choice() && fields_.steps_taken < steps_worth_a_factor) return 0;
  if (!condensable()) return 0;
  // A period is off by (omega h)^2 / 12.
  double longest = std::sqrt(12 * accuracy) / lowest_frequency();
  const double quarter = 0.5 * M_PI / lowest_frequency();
  if (t < blow_time_ + quarter) return 0;
  if (condensed_by_choice()) {
    const double ringing = fields_.struck.empty() ? ringing_step(t) : longest;
    if (ringing < std::min(longest, body_.critical_step)) return 0;  // explicit steps cost less
    longest = std::min(longest, ringing);
  } else if (!loads_hold(t - quarter, t + quarter)) {  // what it gains is the island's to judge: contacts
                                                       // shorten explicit steps, rest lengthens this one
    return 0;
  }
  forces_.evaluate(t);
  laws_share_ = laws_share;
  return at_ease(fields_.contact_step > 0 ? fields_.contact_step : body_.critical_step) ? longest : 0;
}

/// Most that the law of a damaged cell may come to, over sound concrete. A crack takes Poisson's effect away,
/// which leaves pressed concrete E/2 in shear for E / (2 (1 + nu)), and its faces interlock with up to that
/// of sound concrete again. By steps, so that growing cracks seldom ask for new factors.
double FemStructure::stiffest(int cell) const {
  if (!body_.damage || body_.damage->cells().empty()) return 1;
  const double tension = body_.damage->tension(cell), nu = body_.spec.poisson;
  const double d = tension > cracked_least ? std::min(1.0, std::ceil(4 * tension) / 4) : cracked_least;
  const bool interlocks = body_.spec.damage == "concrete" && body_.concrete && body_.concrete->aggregate > 0;
  const double cracked = (1 + nu) / (1 + nu * (1 - d)) + (interlocks ? d : 0.0);
  return std::max(cracked, body_.damage->compression(cell) > cracked_least ? crushed_stiffest : 1.0);
}

/// T of a cell in K, T K_e T^T: its rotation, and the root of how much stiffer it may be than sound concrete.
Mat3 FemStructure::frame_of(int cell) const {
  Mat3 t = Mat3::Identity();
  const Mat3 h = loads_.stresses().gradient(cell), f = t + h;
  if (h.norm() > turned_most && f.determinant() > 0) t = nearest_rotation(f);
  return std::sqrt(stiffest(cell)) * t;
}

void FemStructure::follow_frames() {
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

void FemStructure::set_frames(std::vector<Mat3> frames) {
  frames_ = std::move(frames);
  if (condensed_) condensed_->mass.clear();  // made again
}

Condensed& FemStructure::condensed(double h) {
  if (!condensed_) condensed_.reset(new Condensed);
  Condensed& c = *condensed_;
  const int n = body_.dofs.size;
  body_.elastic->stiffness();
  if (c.mass.empty() || c.body_revision != body_.revision) {
    c.body_revision = body_.revision;
    if (!c.levels.empty()) c.spent = std::move(c.levels.back());
    c.levels.clear();
    c.stiffness = {};
    c.mass.assign(n, 1.0);
    c.moves.assign(n, 0);
    for (std::size_t i = 0; i < body_.mass.size(); ++i)
      for (int k = 0; k < 3; ++k)
        if (const int d = body_.dofs.number[i][k]; d >= 0 && body_.mass[i] > 0)
          c.mass[d] = body_.mass[i], c.moves[d] = 1;
    const bool whole =
        frames_.empty() && std::all_of(body_.live.begin(), body_.live.end(), [](char on) { return on != 0; });
    const std::vector<Mat3>* frames = frames_.empty() ? nullptr : &frames_;
    c.stiffness = whole ? SymmetricMatrix{}
                        : assemble_stiffness(body_.mesh, body_.dofs, body_.shear, body_.bulk,
                                             body_.elastic->springs(frames), &body_.live, frames,
                                             &body_.elastic->stiffness());
  }
  // Twelve digits: intervals that differ by rounding share one factor, and a restart finds the same step.
  const double key = std::strtod(fmt::format("{:.11e}", h).c_str(), nullptr);
  const double phase = lowest_frequency() * key;
  const bool damped = body_.spec.damping_ratio > 0;
  const double delta = starting_ ? 0.5
                       : damped  ? std::min(0.1 * phase * phase, 0.5)
                                 : 0.0;  // damping of the first mode 0.1 phase^3
  const double theta = 0.5 + delta, scale = key * key * theta * theta,
               shift = (1 + 0.5 * body_.alpha * key) / scale;
  const auto found = std::find_if(c.levels.begin(), c.levels.end(), [&](const auto& level) {
    return level->h == key && level->theta == theta;
  });
  if (found != c.levels.end()) {
    std::rotate(found, found + 1, c.levels.end());
    return c;
  }
  if (!c.levels.empty() && c.levels.size() >= levels_kept(c.levels.back()->factor.bytes())) {
    c.spent = std::move(c.levels.front());
    c.levels.erase(c.levels.begin());
  }
  body_.elastic->forget_factor();  // that of the structure at rest is made again where it is asked for
  const SymmetricMatrix& k = c.stiffness.n > 0 ? c.stiffness : body_.elastic->stiffness();
  std::unique_ptr<Condensed::Level> level = std::move(c.spent);
  if (level)
    level->factor.again(k, shift, c.mass, &c.ordering);
  else
    level.reset(new Condensed::Level{0, {k, shift, c.mass, &c.ordering}, 0, 0, {}});
  level->h = key, level->theta = theta, level->scale = scale;
  level->column.clear();
  c.levels.push_back(std::move(level));
  return c;
}

/// The columns of these nodes at the step at hand, in `used` marked as asked for.
void FemStructure::find_columns(std::span<const int> nodes) {
  Condensed& c = *condensed_;
  Condensed::Level& level = *c.levels.back();
  bool all = true;
  for (const int node : nodes) {
    const auto found = level.column.find(node);
    if (found != level.column.end())
      found->second.used = c.step;
    else
      all = false;
  }
  if (all) return;
  if (c.bytes_of_columns() > room_of_columns(body_.dofs.size)) c.drop_idle_columns();
  for (const int node : nodes) {
    const auto [at, fresh] = level.column.try_emplace(node);
    if (!fresh) continue;
    at->second.used = c.step;
    for (std::size_t k = 0; k < 3; ++k)
      if (const int d = body_.dofs.number[static_cast<std::size_t>(node)][k];
          d >= 0 && c.moves[static_cast<std::size_t>(d)])
        at->second.half[k] = level.factor.half_column(d);
  }
}

void FemStructure::drop_condensed_levels() {
  if (!condensed_) return;
  condensed_->levels.clear();
  condensed_->spent.reset();
}

double FemStructure::memory_of_condensed_steps() {
  if (!condensable()) return 0;
  const std::size_t factor_bytes =
      body_.elastic->factor().bytes();  // stands now, and makes way for the first of them
  const std::size_t followed = body_.finite
                                   ? body_.elastic->stiffness().value.size() * (sizeof(double) + sizeof(int))
                                   : 0;  // K that has turned or cracked, beside that as built
  return static_cast<double>((levels_kept(factor_bytes) - 1) * factor_bytes +
                             room_of_columns(body_.dofs.size) + followed);
}

/// What h does not resolve of the velocities, (1 - A^-1 M)^3 v: a mode keeps all but (x / (1 + x))^3 of its
/// own, x = (omega h)^2.
VecX FemStructure::unresolved_velocities(double h) {
  const Condensed& c = condensed(h);
  const Condensed::Level& level = *c.levels.back();
  VecX v(body_.dofs.size), rhs(body_.dofs.size), kept(body_.dofs.size);
  gather(body_.dofs, fields_.v, v);
  for (int pass = 0; pass < 3; ++pass) {
    for (int d = 0; d < body_.dofs.size; ++d)
      rhs[d] = c.mass[static_cast<std::size_t>(d)] * v[d] / level.scale;
    level.factor.solve(rhs.data(), kept.data());
    v -= kept;
  }
  return v;
}

void FemStructure::smooth_velocities(double h) {
  VecX v(body_.dofs.size);
  gather(body_.dofs, fields_.v, v);
  scatter(body_.dofs, v - unresolved_velocities(h), fields_.v);
  ++fields_.revision;
}

bool FemStructure::may_begin(double t, double h, double accuracy) {
  if (fields_.h_last == 0 || !(body_.spec.damping_ratio > 0) || condensed_by_choice())
    return true;  // under way, or with all of its motion
  follow_frames();
  starting_ = true;  // by the factor of the first step
  const VecX v = unresolved_velocities(h);
  starting_ = false;
  double lost = 0;  // its kinetic energy, and as much that it stores
  for (int d = 0; d < body_.dofs.size; ++d)
    if (condensed_->moves[static_cast<std::size_t>(d)])
      lost += condensed_->mass[static_cast<std::size_t>(d)] * v[d] * v[d];
  // Half of what earlier starts have left of it: together they never take more, and one more is never far
  // off.
  const double all = condensed_budget(accuracy);
  const double most = std::max(0.5 * (all - taken_by_condensed_), least_start_share * all);
  if (lost <= most) return true;
  // Damping alone takes so long; contacts and cracks may be quicker.
  const double quarter = 0.5 * M_PI / lowest_frequency();
  blow_time_ = t + std::max(0.0, 0.5 * std::log(lost / most) / body_.alpha - quarter);
  return false;
}

void FemStructure::predict_condensed(double t, double h) {
  begin_condensed(t, h, body_.spec.damping_ratio > 0);
}

void FemStructure::begin_condensed(double t, double h, bool smoothed) {
  leave_modal();
  follow_frames();
  if (fields_.h_last > 0) {
    const double before = energy_.mechanical();
    leapfrog_.synchronise(t);
    fields_.time = t;
    starting_ = smoothed;
    if (smoothed) smooth_velocities(h);
    const double taken =
        before - energy_.mechanical() -
        (forces_.accepted() ? 0.0 : forces_.dissipation());  // which energy_.accept_laws() books
    energy_.works.algorithmic += taken;
    taken_by_condensed_ += std::max(0.0, taken);
  }
  forces_.evaluate(t);
  if (!forces_.accepted()) energy_.accept_laws();
  Condensed& c = condensed(h);
  ++c.step;
  c.before.clear();
  save(c.before);
  c.stored = forces_.stored();
  const int n = body_.dofs.size;
  VecX v(n), stiff(n), rhs(n), push = VecX::Zero(n);
  gather(body_.dofs, fields_.v, v);
  (c.stiffness.n > 0 ? c.stiffness : body_.elastic->stiffness()).multiply(v.data(), stiff.data());
  AlignedVector mean(fields_.f_ext);
  if (!body_.loads.empty()) {
    forces_.load(t + h);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5 * (mean[i] + fields_.f_ext[i]);
    forces_.load(t);
  }
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    for (int k = 0; k < 3; ++k)
      if (const int d = body_.dofs.number[i][k]; d >= 0 && body_.mass[i] > 0)
        push[d] = h * (mean[4 * i + k] - fields_.f_int[4 * i + k] -
                       body_.alpha * body_.mass[i] * fields_.v[4 * i + k]);
  const Condensed::Level& level = *c.levels.back();
  rhs = push / level.scale - stiff / level.theta;
  c.v_hat.resize(n);
  level.factor.solve(rhs.data(), c.v_hat.data());
  c.v_hat += v;
  scatter(body_.dofs, c.v_hat, fields_.v_hat);
}

MatX FemStructure::compliance(std::span<const int> nodes) {
  find_columns(nodes);
  Condensed::Level& level = *condensed_->levels.back();
  std::vector<Condensed::Column*> column;
  for (const int node : nodes) column.push_back(&level.column.find(node)->second);
  const auto m = static_cast<Eigen::Index>(nodes.size());
  MatX w(3 * m, 3 * m);
  for (Eigen::Index i = 0; i < m; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const bool ordered = nodes[static_cast<std::size_t>(i)] <= nodes[static_cast<std::size_t>(j)];
      const Eigen::Index
          low = ordered ? i : j,
          high = ordered ? j : i;  // by the nodes' numbers: the digits do not depend on the order asked for
      Condensed::Column &of = *column[static_cast<std::size_t>(low)],
                        &other = *column[static_cast<std::size_t>(high)];
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

/// v_hat with what the impulses add to it.
void FemStructure::push_condensed(std::span<const NodeImpulse> impulses) {
  Condensed& c = *condensed_;
  Condensed::Level& level = *c.levels.back();
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
    if (c.moves[static_cast<std::size_t>(d)]) c.v_hat[d] += moved[d];
}

bool FemStructure::correct_condensed(double t, double h, std::span<const NodeImpulse> impulses) {
  Condensed& c = *condensed_;
  push_condensed(impulses);
  const double stored_before = forces_.stored();
  const AlignedVector external_before(fields_.f_ext), internal_before(fields_.f_int);
  for (int n : fields_.struck) std::fill_n(&fields_.contact_impulse[4 * static_cast<std::size_t>(n)], 3, 0.0);
  fields_.struck.clear();
  fields_.contact_step = h;
  for (const NodeImpulse& p : impulses) {
    fields_.struck.push_back(p.node);
    for (int k = 0; k < 3; ++k)
      fields_.contact_impulse[4 * static_cast<std::size_t>(p.node) + k] += p.impulse[k];
  }
  AlignedVector v_before(fields_.v);
  scatter(body_.dofs, c.v_hat, fields_.v);
  const double theta = c.levels.back()->theta;
  for (std::size_t i = 0; i < fields_.u.size(); ++i)
    fields_.u[i] += h * ((1 - theta) * v_before[i] + theta * fields_.v[i]);
  fields_.time = t + h;
  forces_.moved();
  forces_.evaluate(t + h);
  if (!at_ease(h)) return false;

  double gained = 0, kinetic = 0, damping = 0, external = 0, whole = 0, contact = 0;
  double sprung = 0, begun = 0;  // s . K s, s . f_int(u_n) of the way s
  for (std::size_t node = 0; node < body_.mass.size(); ++node) {
    const double m = body_.mass[node];
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = 4 * node + k;
      if (body_.inverse_mass[i] == 0) continue;
      const double mean = 0.5 * (v_before[i] + fields_.v[i]),
                   load = 0.5 * (external_before[i] + fields_.f_ext[i]);
      const double moved = h * ((1 - theta) * v_before[i] + theta * fields_.v[i]);
      gained += m * (fields_.v[i] - v_before[i]) * mean;
      kinetic += 0.5 * m * fields_.v[i] * fields_.v[i];
      damping += h * body_.alpha * m * mean * mean;
      whole += load * moved;
      external += (load - m * body_.gravity[k]) * moved;
      contact += fields_.contact_impulse[i] * mean;
      begun += internal_before[i] * moved;
      sprung += (load - internal_before[i] - body_.alpha * m * mean +
                 (fields_.contact_impulse[i] - m * (fields_.v[i] - v_before[i])) / h) /
                theta * moved;  // by (4)
    }
  }
  const double by_laws = forces_.stored() - stored_before + forces_.dissipation(),
               viscous = 0.5 * sprung + begun - by_laws;
  if (!viscosity_at_ease(h, viscous, damping, kinetic)) return false;
  taken_by_condensed_ += std::max(0.0, viscous);
  energy_.works.contact_work += contact;
  energy_.works.damping_work += damping;
  if (!body_.loads.empty()) energy_.works.external_work += external;
  energy_.works.algorithmic += whole + contact - damping - gained - by_laws;
  loads_.watch(t + h, h);
  starting_ = false;
  energy_.stored_half = forces_.stored();
  fields_.reference_kinetic = std::max(fields_.reference_kinetic, kinetic);
  if (kinetic > 1e-8 * fields_.reference_kinetic && kinetic > 1e-14 * forces_.stored())
    fields_.still = false;
  else if (!fields_.still)
    fields_.still = true, fields_.still_since = fields_.time;
  return true;
}

void FemStructure::undo_condensed() {
  restore(condensed_->before);
  forces_.evaluate(
      fields_.time);  // explicit steps go on from what the laws say here after a step of no length
  energy_.works.algorithmic += condensed_->stored - forces_.stored() - forces_.dissipation();
}

}  // namespace talus::fem
