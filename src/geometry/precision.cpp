#include "geometry/precision.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <tuple>

namespace talus::geometry {
namespace {

/// More than a twentieth of the vertices share their place in plan with another of another height.
bool some_above_others(const std::vector<Vec3>& vertices) {
  std::vector<Vec3> sorted = vertices;
  std::sort(sorted.begin(), sorted.end(), [](const Vec3& a, const Vec3& b) {
    return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
  });
  std::size_t above = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i)
    above += sorted[i].head<2>() == sorted[i - 1].head<2>() && sorted[i].z() != sorted[i - 1].z();
  return 20 * above > vertices.size();
}

/// Largest power of ten, from 100 down to 0.01, that all values are multiples of; 0: none. Rounding leaves
/// any last digit: what are multiples of twice or five times that, as halves or cells of 5 m, were round
/// before.
double decimal_step(const std::vector<double>& values) {
  const auto multiples_of = [&](double step) {
    constexpr double slack = 1e-7;  // of the step, and the rounding of the values themselves
    return std::all_of(values.begin(), values.end(), [&](double x) {
      return std::abs(x / step - std::round(x / step)) <=
             slack + 4 * std::numeric_limits<double>::epsilon() * std::abs(x / step);
    });
  };
  for (const double step : {100.0, 10.0, 1.0, 0.1, 0.01})
    if (multiples_of(step)) return multiples_of(2 * step) || multiples_of(5 * step) ? 0 : step;
  return 0;
}

/// Numbers that single precision holds, and its step at the largest of them.
struct Floats {
  const std::vector<double>* values = nullptr;
  double step = 0;
};

/// Whether single precision has rounded them: then their last binary digits are any. Numbers of the finest
/// step that are all multiples of twice it, or of the coarsest as well, as halves of a metre are, were round
/// before.
bool rounded_by(const std::vector<Floats>& axes) {
  if (axes.empty()) return false;
  const auto [finest, coarsest] =
      std::ranges::minmax_element(axes, {}, [](const Floats& axis) { return axis.step; });
  const double even = std::max(2 * finest->step, coarsest->step);
  return std::ranges::any_of(*finest->values, [&](double x) { return std::fmod(x, even) != 0; });
}

std::size_t distinct(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return static_cast<std::size_t>(std::unique(values.begin(), values.end()) - values.begin());
}

bool is_stl_file(const std::string& path) {
  std::string end = path.substr(path.size() < 4 ? 0 : path.size() - 4);
  std::transform(end.begin(), end.end(), end.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return end == ".stl";
}

}  // namespace

double single_precision_step(double x) {
  const auto f = static_cast<float>(std::abs(x));
  return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity())) -
         static_cast<double>(f);
}

bool holds_single_precision(const std::string& path) {
  if (is_stl_file(path)) return true;
  std::ifstream in(path, std::ios::binary);
  std::string word, before;
  for (int n = 0; n < 200 && in >> word && word != "end_header"; ++n, before = word)
    if (n == 0 && word != "ply")
      return false;
    else if (word == "x")
      return before == "float" || before == "float32";
  return false;
}

std::vector<Problem> rounding_warning(const std::vector<Vec3>& vertices,
                                      const std::vector<std::array<int, 3>>& triangles,
                                      const std::string& path, bool digits) {
  constexpr double far = 1e4, felt = 5e-3, least = 0.01;  // coordinates of a map [m]; of the mean side; [m]
  if (triangles.empty() || (!digits && !holds_single_precision(path))) return {};
  double sum = 0;
  for (const auto& t : triangles)
    for (std::size_t k = 0; k < 3; ++k)
      sum += (vertices[static_cast<std::size_t>(t[k])] - vertices[static_cast<std::size_t>(t[(k + 1) % 3])])
                 .head<2>()
                 .norm();
  const double side = sum / (3 * static_cast<double>(triangles.size()));
  std::array<std::vector<double>, 2> at;
  for (const Vec3& v : vertices)
    for (int k = 0; k < 2; ++k) at[static_cast<std::size_t>(k)].push_back(v[k]);
  double step = 0;
  bool single = false;
  std::vector<Floats> of_floats;
  for (const std::vector<double>& x : at) {
    double most = 0;
    for (const double value : x) most = std::max(most, std::abs(value));
    if (most < far) continue;
    const bool floats = std::all_of(x.begin(), x.end(), [](double value) {
      return static_cast<double>(static_cast<float>(value)) == value;
    });
    const double ulp = floats ? single_precision_step(most) : 0;
    if (floats) of_floats.push_back({&x, ulp});
    if (ulp > step) step = ulp, single = true;
    if (const double s = digits ? decimal_step(x) : 0; s > step) step = s, single = false;
  }
  if (step < least || step < felt * side) return {};
  if (single && !holds_single_precision(path) && !rounded_by(of_floats)) return {};
  // Of files that hold more digits, nodes of an even grid are where they were meant to be, unless one lies
  // above another: then rounding has put them there.
  if (!(single && holds_single_precision(path)) && distinct(at[0]) * distinct(at[1]) <= 4 * vertices.size() &&
      !some_above_others(vertices))
    return {};
  return {{.severity = Problem::Severity::warning,
           .file = path,
           .key = "site.terrain",
           .value = fmt::format("steps of {:.2g} m, faces of {:.3g} m", step, side),
           .rule = single ? std::string("its coordinates are those of a map in single precision") +
                                (holds_single_precision(path) ? ", as this file holds them," : ",") +
                                " which rounds them"
                          : "its coordinates are written with too few digits, which rounds them",
           .remedy = "export it about a local origin (and give site.origin to match), or as OBJ or PLY with "
                     "all digits, or as a GeoTIFF"}};
}

}  // namespace talus::geometry
