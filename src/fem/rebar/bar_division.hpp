/// Segments of the reinforcement among the ranks, and the cells that unbroken bars hold together.
#pragma once
#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "fem/discretisation/partition.hpp"
#include "fem/rebar/rebar_embed.hpp"

namespace talus::fem {

/// Which segments of the whole are here: all of them, or of several ranks those with these numbers.
class BarDivision {
 public:
  /// All: in the order of the whole, in which the segments of a bar follow each other.
  void hold(const std::vector<rebar::Segment>& whole);
  /// `numbers`: those held from now on, ascending.
  void divide(std::vector<int> numbers, Partition& partition);

  Partition* partition() const { return partition_; }  // null: all segments here
  std::size_t in_all() const { return in_all_; }
  int number(std::size_t segment) const {
    return partition_ == nullptr ? static_cast<int>(segment) : number_[segment];
  }
  /// The segment of this number, -1: not here.
  int segment(int number) const;
  /// Whether a segment in this cell, -1: not here, counts for this rank.
  bool own(int host) const { return partition_ == nullptr || (host >= 0 && partition_->owns_cell(host)); }
  /// Whether it is the first segment of its bar.
  bool starts(int number) const { return std::binary_search(first_.begin(), first_.end(), number); }
  std::size_t memory_consumption() const { return (number_.capacity() + first_.capacity()) * sizeof(int); }

 private:
  Partition* partition_ = nullptr;
  std::size_t in_all_ = 0;
  std::vector<int> number_;  // of each segment here, in the whole; ascending
  std::vector<int> first_;   // of the whole, the first segment of each bar; ascending
};

/// The pairs of neighbouring segments, in two cells, that no break parts.
class BarTies {
 public:
  BarTies(const rebar::EmbeddedBars& bars, const BarDivision& division) : bars_(bars), division_(division) {}
  /// Asks the others which segments are broken.
  void find_broken(const std::vector<material::Steel::State>& states);
  /// Calls with the number of every pair of cells that an unbroken bar holds together, the same on all ranks,
  /// and those of the two that are in this rank's part; -1: it is not.
  void visit(const std::function<void(int, int, int)>& use) const;
  /// Of each of so many cells, whether an unbroken bar holds it to another.
  const std::vector<char>& tied(std::size_t cells) const;
  std::size_t memory_consumption() const { return ties_.capacity() * sizeof(ties_[0]) + tied_.capacity(); }

 private:
  const rebar::EmbeddedBars& bars_;
  const BarDivision& division_;
  std::vector<int> broken_;  // segments, of all ranks by their numbers in the whole, ascending
  mutable std::vector<std::array<int, 3>> ties_;
  mutable std::vector<char> tied_;  // empty: to be found
  mutable bool stale_ = true;
};

}  // namespace talus::fem
