#include "fem/members/running_mean.hpp"

#include <algorithm>
#include <cmath>

#include "core/error.hpp"

namespace talus::fem {

void RunningMean::begin(std::span<const double> values) {
  clear();
  Bin before{window_, {}};
  for (const double v : values) before.integral.push_back(v * window_);
  mean_.assign(values.begin(), values.end());
  open_ = {0, std::vector<double>(values.size(), 0.0)};
  bins_.push_back(std::move(before));
}

void RunningMean::clear() {
  bins_.clear();
  open_ = {};
  mean_.clear();
}

std::size_t RunningMean::most_bins() const {
  return static_cast<std::size_t>(std::ceil(window_ / bin_ * (1 - 1e-9))) + 1;
}

bool RunningMean::add(double duration, std::span<const double> values) {
  for (std::size_t k = 0; k < values.size(); ++k) open_.integral[k] += duration * values[k];
  open_.duration += duration;
  if (open_.duration < bin_ * (1 - 1e-9)) return false;
  bins_.push_back(open_);
  open_ = {0, std::vector<double>(values.size(), 0.0)};
  double reach = 0;
  for (const Bin& bin : bins_) reach += bin.duration;
  for (; bins_.size() > 1 && reach - bins_.front().duration >= window_; bins_.pop_front())
    reach -= bins_.front().duration;
  set_mean();
  return true;
}

void RunningMean::set_mean() {
  std::fill(mean_.begin(), mean_.end(), 0.0);
  double left = window_;
  for (auto b = bins_.rbegin(); b != bins_.rend() && left > 0; ++b) {
    const double part = std::min(b->duration, left);  // of the oldest bin only its end counts
    for (std::size_t k = 0; k < mean_.size(); ++k) mean_[k] += b->integral[k] * (part / b->duration);
    left -= part;
  }
  for (double& m : mean_) m /= window_;
}

void RunningMean::save(std::vector<double>& state) const {
  state.push_back(static_cast<double>(bins_.size()));
  state.push_back(static_cast<double>(mean_.size()));
  if (bins_.empty()) return;
  const auto put = [&](const Bin& bin) {
    state.push_back(bin.duration);
    state.insert(state.end(), bin.integral.begin(), bin.integral.end());
  };
  for (const Bin& bin : bins_) put(bin);
  for (std::size_t k = bins_.size(); k < most_bins(); ++k) put({0, std::vector<double>(mean_.size(), 0.0)});
  put(open_);
  state.insert(state.end(), mean_.begin(), mean_.end());
}

std::size_t RunningMean::restore(std::span<const double> state) {
  std::size_t at = 0;
  const auto next = [&] {
    if (at >= state.size()) throw NumericalFailure("a saved state ends within its means over a window");
    return state[at++];
  };
  clear();
  const double bins = next(), channels = next();
  const auto most = static_cast<double>(state.size());
  if (!(bins >= 0 && bins <= most && channels >= 0 && channels <= most))
    throw NumericalFailure("a saved state has counts that it cannot hold");
  if (bins == 0) return at;
  const auto take = [&] {
    Bin bin;
    bin.duration = next();
    for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k) bin.integral.push_back(next());
    return bin;
  };
  for (std::size_t k = 0; k < most_bins(); ++k) {
    Bin bin = take();
    if (k < static_cast<std::size_t>(bins)) bins_.push_back(std::move(bin));
  }
  open_ = take();
  for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k) mean_.push_back(next());
  return at;
}

}  // namespace talus::fem
