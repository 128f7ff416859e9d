/// Scenes as text, as a user would write them.
#pragma once
#include <string>
#include <vector>

#include "core/types.hpp"
#include "verify/suite.hpp"

namespace talus::verify {

std::string number(double x);
std::string vector(const Vec3& v);
/// Rotation vector that turns the world's axes into the columns of r.
Vec3 rotation_vector(const Mat3& r);

class SceneText {
 public:
  SceneText(const Method& method, double duration, const Vec3& gravity = {0, 0, -9.81},
            const std::string& more = {});
  /// History interval [s]; left out: start and end only.
  SceneText& history(double dt);
  SceneText& material(const std::string& name, double density, const std::string& more = {});
  /// `contact` is the stiffness line for method talus; the 1988 scheme takes `penalty` [N/m].
  SceneText& interface(const std::string& a, const std::string& b, double friction,
                       const std::string& more = "normal_stiffness = \"hard\"", double penalty = 1e9);
  SceneText& plane(const Vec3& normal, const Vec3& point = Vec3::Zero(),
                   const std::string& material = "ground");
  SceneText& box(const std::string& name, const Vec3& size, const Vec3& position,
                 const std::string& more = {}, const std::string& material = "rock");
  /// Hull of world points; the centroid is found here.
  SceneText& hull(const std::string& name, const std::vector<Vec3>& world, const Vec3& centroid,
                  const std::string& more = {}, const std::string& material = "rock");
  SceneText& raw(const std::string& text) {
    tail_ += text;
    return *this;
  }
  std::string str() const;

 private:
  Method method_;
  double duration_, history_;
  Vec3 gravity_;
  std::string simulation_, materials_, tail_;
};

inline std::string velocity(const Vec3& v) { return "velocity = " + vector(v) + "\n"; }
inline std::string spin(const Vec3& w) { return "spin = " + vector(w) + "\n"; }
inline std::string turned(const Vec3& r) { return "orientation = { rotation_vector = " + vector(r) + " }\n"; }

/// Columns (down the slope, across, normal) of a slope of angle a towards +x.
Mat3 slope_axes(double a);

}  // namespace talus::verify
