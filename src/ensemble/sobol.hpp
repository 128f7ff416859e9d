/// Points of a Sobol' sequence [Joe & Kuo 2008], each replicate scrambled on its own [Owen 1995].
#pragma once
#include <cstdint>
#include <memory>

namespace talus::ensemble {

inline constexpr int replicates = 16;

class Sobol {
 public:
  /// Throws InputError for more dimensions than the table of direction numbers has.
  Sobol(int dimensions, std::uint32_t seed);
  ~Sobol();
  /// Coordinate `dimension` of point `index / 16` of replicate `index % 16`, in (0, 1).
  double coordinate(std::uint64_t index, int dimension) const;

 private:
  struct Directions;
  std::unique_ptr<Directions> directions_;
  std::uint32_t seed_;
};

}  // namespace talus::ensemble
