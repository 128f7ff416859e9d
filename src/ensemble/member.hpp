/// One member: its run, and what is kept of it.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/types.hpp"

namespace talus::ensemble {

/// The path of a block's centroid cuts a segment of a line in plan.
struct Crossing {
  int line = 0, block = 0;
  double time = 0;                                                             // [s]
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero(), spin = Vec3::Zero();  // [m], [m/s], [rad/s]
  double translational = 0, rotational = 0;                                    // kinetic energies [J]
  double height = 0;  // of the centroid above the ground, NaN off it [m]
  double energy() const { return translational + rotational; }
};

/// A block comes upon a structure: the motion is that just before.
struct Hit {
  int structure = 0, block = 0;
  double time = 0, mass = 0;  // [s], [kg]
  Vec3 point = Vec3::Zero(), centre = Vec3::Zero(), velocity = Vec3::Zero(),
       spin = Vec3::Zero();                       // of the contact, of the centroid
  std::array<double, 4> orientation{1, 0, 0, 0};  // w, x, y, z
};

/// A cell of the maps that centroids went through.
struct Passage {
  std::int32_t i = 0, j = 0;     // east, north, in cells from map coordinate 0
  float energy = 0, height = 0;  // largest there [J], [m]
};

enum class Status : std::uint8_t { done, at_rest, left, failed, over_limit, suspect };
const char* status_text(Status status);
/// Whether the member has come to an end that counts in probabilities and percentiles.
inline bool finished(Status s) { return s != Status::failed && s != Status::over_limit; }

struct Member {
  std::int64_t index = 0, steps = 0;
  Status status = Status::failed;
  std::string message;                             // why it failed, went over the limit or is suspect
  double cpu = 0;                                  // [s]
  double energy_residual = 0, numerical_gain = 0;  // over the largest kinetic energy
  double reach_angle = 0;           // of the block that came farthest by it, NaN without a way [rad]
  std::vector<Vec3> start, end;     // centroids [m]
  bool moving = false;              // when its time was over; journals do not keep it
  std::vector<Crossing> crossings;  // in order of time
  std::vector<Hit> hits;
  std::vector<Passage> passages;  // in order of j, i

  std::string encode() const;
  /// Throws InputError for bytes that are none.
  static Member decode(std::string_view bytes);
  double runout(std::size_t block) const { return (end[block] - start[block]).head<2>().norm(); }
};

}  // namespace talus::ensemble
