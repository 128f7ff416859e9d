#include "contact/linear/solver_hessian.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

namespace talus::contact::detail {

namespace {

/// H += Ja^T T, column by column.
inline void add_block(const double* Ja, int na, const double* T, int nb, double* H) {
  for (int c = 0; c < nb; ++c) add_transposed(Ja, na, Vec3(T[c], T[nb + c], T[2 * nb + c]), H + c * na);
}

inline void add_block_six(const double* Ja, const double* T, double* H) {
  const Four a0 = load<Four>(Ja), a1 = load<Four>(Ja + 6), a2 = load<Four>(Ja + 12);
  const Two b0 = load<Two>(Ja + 4), b1 = load<Two>(Ja + 10), b2 = load<Two>(Ja + 16);
  for (int c = 0; c < 6; ++c, H += 6) {
    const double t0 = T[c], t1 = T[6 + c], t2 = T[12 + c];
    store<Four>(load<Four>(H) + a0 * t0 + a1 * t1 + a2 * t2, H);
    store<Two>(load<Two>(H + 4) + b0 * t0 + b1 * t1 + b2 * t2, H + 4);
  }
}

/// The contacts of a body of many degrees of freedom, the touched skin of a structure, one below the other:
/// their block is one product.
class Stack {
 public:
  void begin(int columns) {
    columns_ = columns;
    J_.clear();
    T_.clear();
  }
  void add(const double* J, const double* T) {
    J_.insert(J_.end(), J, J + 3 * static_cast<std::size_t>(columns_));
    T_.insert(T_.end(), T, T + 3 * static_cast<std::size_t>(columns_));
  }
  /// H += J^T T.
  void add_product(double* H) const {
    using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
    const Eigen::Index n = columns_, rows = static_cast<Eigen::Index>(J_.size()) / n;
    if (rows > 0)
      Eigen::Map<Eigen::MatrixXd>(H, n, n).noalias() +=
          Rows(J_.data(), rows, n).transpose() * Rows(T_.data(), rows, n);
  }

 private:
  int columns_ = 0;
  std::vector<double, Eigen::aligned_allocator<double>> J_,
      T_;  // aligned, so that sums never depend on where they lie
};

constexpr int many = 48;  // degrees of freedom from which the stack pays

}  // namespace

void Hessian::prepare(const System& system) {
  sizes_ = system.ndof;
  keys_.clear();
  pair_of_.clear();
  first_pair_.clear();
  const std::uint64_t bodies = system.body.size();
  for (const Touch& t : system.touch) {
    first_pair_.push_back(static_cast<int>(pair_of_.size()));
    for (int a = 0; a < t.count; ++a)
      for (int b = a + 1; b < t.count; ++b) {
        const std::uint64_t i = system.terms[t.first + a].body, j = system.terms[t.first + b].body,
                            key = std::min(i, j) * bodies + std::max(i, j);
        if (keys_.empty() || keys_.back().first != key)
          keys_.emplace_back(key, static_cast<int>(keys_.size()));  // contacts of a pair follow each other
        pair_of_.push_back(static_cast<int>(keys_.size()) - 1);
      }
  }
  place_.resize(keys_.size());
  std::sort(keys_.begin(), keys_.end());
  pairs_.clear();
  for (std::size_t k = 0; k < keys_.size(); ++k) {
    if (k == 0 || keys_[k].first != keys_[k - 1].first)
      pairs_.emplace_back(static_cast<int>(keys_[k].first / bodies),
                          static_cast<int>(keys_[k].first % bodies));
    place_[keys_[k].second] = static_cast<int>(pairs_.size()) - 1;
  }
  for (int& pair : pair_of_) pair = place_[pair];
  listed_.clear();
  in_list_.assign(pairs_.size(), -1);
  analysed_ = false;
}

/// The pattern, if it does not do: all pairs, in large problems those of closed contacts.
void Hessian::list(const System& system, const unsigned char* state) {
  constexpr std::size_t few = 400;  // pairs, from which on it pays
  constexpr double too_many = 1.3,
                   kept = 1.1;  // of the closed ones: listed, and still listed after one more has closed
  const bool all = state == nullptr || pairs_.size() < few;
  closed_.assign(pairs_.size(), all ? 1 : 0);
  for (int i = 0; !all && i < system.contacts(); ++i)
    if (state[i] != open)
      for (int k = first_pair_[i], end = k + system.touch[i].count * (system.touch[i].count - 1) / 2; k < end;
           ++k)
        closed_[pair_of_[k]] = 1;
  const auto closed = static_cast<double>(std::count(closed_.begin(), closed_.end(), 1)),
             listed = static_cast<double>(listed_.size());
  bool holds = listed <= too_many * closed;
  for (std::size_t k = 0; holds && k < pairs_.size(); ++k) holds = closed_[k] == 0 || in_list_[k] >= 0;
  if (holds && analysed_) return;
  analysed_ = true;
  const bool keep = listed <= kept * closed;
  listed_.clear();
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const bool listed_now = closed_[k] != 0 || (keep && in_list_[k] >= 0);
    in_list_[k] = listed_now ? static_cast<int>(listed_.size()) : -1;
    if (listed_now) listed_.push_back(pairs_[k]);
  }
  lu.analyse(sizes_, listed_);
}

/// Column by column of bodies, each written by one thread; every block adds its contacts in ascending order.
void Hessian::assemble(const System& system, const Mat3* derivative, const unsigned char* state) {
  list(system, state);
  lu.set_zero();
  in_ranges(static_cast<int>(system.body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) assemble_column(system, derivative, state, b);
  });
}

void Hessian::assemble_column(const System& system, const Mat3* derivative, const unsigned char* state,
                              int body) {
  const int n = system.ndof[body];
  for (int i = 0; i < n; ++i) lu.diagonal(body)[i * (n + 1)] = 1;
  static thread_local std::vector<double> T;  // D J
  T.resize(3 * static_cast<std::size_t>(n));
  static thread_local Stack stack;  // keeps its room
  stack.begin(n);
  for (int e = system.first_of_body[body]; e < system.first_of_body[body + 1]; ++e) {
    const auto [i, at] = system.of_body[e];
    if (state && state[i] == open) continue;
    const Touch& t = system.touch[i];
    const Mat3& D = derivative[i];
    const double* J = system.J.data() + at;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < n; ++c) T[r * n + c] = D(r, 0) * J[c] + D(r, 1) * J[n + c] + D(r, 2) * J[2 * n + c];
    int b = 0;  // the body's place in the contact
    while (system.terms[t.first + b].body != body) ++b;
    for (int a = 0; a < t.count; ++a) {
      const TouchTerm& ta = system.terms[t.first + a];
      double* H;
      if (a == b && n >= many) {
        stack.add(J, T.data());
        continue;
      }
      if (a == b) {
        H = lu.diagonal(body);
      } else {
        // Pairs of terms are numbered (0,1), (0,2), ..., (1,2), ...
        const int lo = std::min(a, b), hi = std::max(a, b);
        const int index = in_list_[pair_of_[first_pair_[i] + lo * t.count - lo * (lo + 1) / 2 + hi - lo - 1]];
        H = ta.body < body ? lu.upper(index) : lu.lower(index);
      }
      if (n == 6 && ta.n == 6)
        add_block_six(system.J.data() + ta.at, T.data(), H);
      else
        add_block(system.J.data() + ta.at, ta.n, T.data(), n, H);
    }
  }
  stack.add_product(lu.diagonal(body));
}

}  // namespace talus::contact::detail
