/// How the area by which a corner presses grows as it sinks.
///
///   A(x)/A = part of the cell below a depth x,   V(x) = int_0^x A/A,   S(x) = int_0^x V
///
/// The cell comes as triangles over which the height above the corner is linear, z_0 <= z_1 <= z_2: of one of
/// them lies below x
///
///   (x - z_0)^2 / ((z_1 - z_0)(z_2 - z_0))          up to z_1
///   1 - (z_2 - x)^2 / ((z_2 - z_1)(z_2 - z_0))      up to z_2
///
/// symbol   meaning                                              unit
/// x        depth of the corner                                  m
/// A        area of the whole cell, across the ground's normal   m^2
/// V, S     its mean depth, and the integral of that             m, m^2
#pragma once
#include <array>
#include <vector>

namespace talus::contact {

class CornerArea {
 public:
  struct Triangle {
    double area = 0;                 // across the normal [m^2]
    std::array<double, 3> height{};  // of its corners, rising, at least 0 [m]
  };
  explicit CornerArea(const std::vector<Triangle>& cell);

  double part(double x) const;                  // A(x)/A [1]
  double volume(double x) const;                // V [m]
  double square(double x) const;                // S [m^2]
  double depth_of(double volume) const;         // x >= 0 of V [m]
  double depth_of_square(double square) const;  // x >= 0 of S [m]

 private:
  std::vector<Triangle> cell_;  // areas over the whole
  double mean_ = 0;             // height [m]
};

}  // namespace talus::contact
