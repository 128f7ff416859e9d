#include "fem/members/running_mean.hpp"

#include <algorithm>
#include <cmath>

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

void RunningMean::restore(StateReader& state) {
  clear();
  const std::size_t bins = state.count(), channels = state.count();
  if (bins == 0) return;
  const auto take = [&] {
    Bin bin;
    bin.duration = state.next();
    const double* const integral = state.take(channels);
    bin.integral.assign(integral, integral + channels);
    return bin;
  };
  for (std::size_t k = 0; k < most_bins(); ++k) {
    Bin bin = take();
    if (k < bins) bins_.push_back(std::move(bin));
  }
  open_ = take();
  const double* const mean = state.take(channels);
  mean_.assign(mean, mean + channels);
}

}  // namespace talus::fem
