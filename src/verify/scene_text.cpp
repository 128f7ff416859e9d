#include "verify/scene_text.hpp"

#include <cmath>

#include <fmt/format.h>

namespace talus::verify {

std::string number(double x) {
  std::string s = fmt::format("{:.17g}", x);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

std::string vector(const Vec3& v) {
  return "[" + number(v[0]) + ", " + number(v[1]) + ", " + number(v[2]) + "]";
}

Vec3 rotation_vector(const Mat3& r) {
  const Eigen::AngleAxisd a(r);
  return a.angle() * a.axis();
}

Mat3 slope_axes(double a) {
  Mat3 r;
  r.col(0) = Vec3(std::cos(a), 0, -std::sin(a));
  r.col(1) = Vec3::UnitY();
  r.col(2) = Vec3(std::sin(a), 0, std::cos(a));
  return r;
}

SceneText::SceneText(const Method& method, double duration, const Vec3& gravity, const std::string& more)
    : method_(method), duration_(duration), history_(duration), gravity_(gravity), simulation_(more) {}

SceneText& SceneText::history(double dt) {
  history_ = dt;
  return *this;
}

SceneText& SceneText::material(const std::string& name, double density, const std::string& more) {
  materials_ += fmt::format("[[material]]\nname = \"{}\"\ndensity = {}\n{}\n", name, number(density), more);
  return *this;
}

SceneText& SceneText::interface(const std::string& a, const std::string& b, double friction,
                                const std::string& more, double penalty) {
  std::string law = more;
  if (method_.kind == Method::Kind::paper) {
    // The 1988 scheme knows springs only: restitution is what they give.
    law = "normal_stiffness = \"" + number(penalty) + " N/m\"\n";
    for (const char* bond : {"cohesion", "tension"})
      if (const auto at = more.find(bond); at != std::string::npos)
        law += more.substr(at, more.find('\n', at) - at) + "\n";
  }
  materials_ += fmt::format("[[interface]]\nbetween = [\"{}\", \"{}\"]\nfriction = {}\n{}\n", a, b,
                            number(friction), law);
  return *this;
}

SceneText& SceneText::plane(const Vec3& normal, const Vec3& point, const std::string& material) {
  tail_ += fmt::format("[[plane]]\npoint = {}\nnormal = {}\nmaterial = \"{}\"\n", vector(point),
                       vector(normal), material);
  return *this;
}

SceneText& SceneText::box(const std::string& name, const Vec3& size, const Vec3& position,
                          const std::string& more, const std::string& material) {
  tail_ += fmt::format(
      "[[block]]\nname = \"{}\"\nmaterial = \"{}\"\nshape = \"box\"\nsize = {}\nposition = {}\n{}", name,
      material, vector(size), vector(position), more);
  if (method_.kind != Method::Kind::paper && more.find("deformable") == std::string::npos)
    tail_ += "deformable = false\n";
  return *this;
}

SceneText& SceneText::hull(const std::string& name, const std::vector<Vec3>& world, const Vec3& centroid,
                           const std::string& more, const std::string& material) {
  std::string list;
  for (const Vec3& x : world) list += (list.empty() ? "" : ", ") + vector(x - centroid);
  tail_ += fmt::format(
      "[[block]]\nname = \"{}\"\nmaterial = \"{}\"\nshape = \"convex\"\nvertices = [{}]\nposition = {}\n{}",
      name, material, list, vector(centroid), more);
  if (method_.kind != Method::Kind::paper && more.find("deformable") == std::string::npos)
    tail_ += "deformable = false\n";
  return *this;
}

std::string SceneText::str() const {
  return fmt::format(
      "schema = 1\n[simulation]\nduration = {}\ngravity = {}\nthreads = 1\n{}{}\n[output]\ninterval = "
      "{}\nhistory_interval = {}\n{}{}",
      number(duration_), vector(gravity_), method_.keys(), simulation_, number(duration_), number(history_),
      materials_, tail_);
}

}  // namespace talus::verify
