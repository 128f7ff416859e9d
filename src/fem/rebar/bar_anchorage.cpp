#include "fem/rebar/bar_anchorage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace talus::fem {

namespace {

bool held(const Supports& supports, int node) {
  return supports.held[static_cast<std::size_t>(node)] == std::array<bool, 3>{true, true, true};
}

/// Whether all nodes of the mesh in the section at `height` along the member are held.
bool section_held(const rebar::Member& m, double height, const HexMesh& mesh, const Supports& supports) {
  const Vec3 x = m.axis_x.normalized(), y = m.axis_y.normalized(), z = x.cross(y);
  const double depth = m.section == rebar::Member::Section::round ? m.width : m.depth;
  // The corners of a round section's polygon lie outside its circle.
  const double half_x = 0.6 * m.width, half_y = 0.6 * depth, near = 1e-6 * m.length;
  int nodes = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3 d = mesh.nodes[n] - m.base;
    if (std::abs(d.dot(z) - height) > near || std::abs(d.dot(x)) > half_x || std::abs(d.dot(y)) > half_y)
      continue;
    if (!held(supports, static_cast<int>(n))) return false;
    ++nodes;
  }
  return nodes >= 4;
}

/// Distance along `outward` from the point to a held face of its cell that the bar runs towards; nothing if
/// there is none.
std::optional<double> to_held_face(const Vec3& point, const Vec3& outward, const rebar::HostSearch& host,
                                   const HexMesh& mesh, const Supports& supports) {
  const auto at = host(point);
  if (!at) return {};
  const auto& hex = mesh.hexes[static_cast<std::size_t>(at->cell)];
  std::array<Vec3, 8> x;
  for (int i = 0; i < 8; ++i) x[i] = mesh.nodes[static_cast<std::size_t>(hex[i])];
  std::optional<double> nearest;
  for (const auto& face : {std::array{0, 3, 2, 1}, std::array{4, 5, 6, 7}, std::array{0, 1, 5, 4},
                           std::array{1, 2, 6, 5}, std::array{2, 3, 7, 6}, std::array{3, 0, 4, 7}}) {
    if (!std::all_of(face.begin(), face.end(), [&](int i) { return held(supports, hex[i]); })) continue;
    const Vec3 normal = (x[face[2]] - x[face[0]]).cross(x[face[3]] - x[face[1]]).normalized();
    const double slope = outward.dot(normal);
    if (slope < 0.5) continue;  // runs along the face, or away from it
    const double distance =
        0.25 * (x[face[0]] + x[face[1]] + x[face[2]] + x[face[3]] - 4 * point).dot(normal) / slope;
    if (!nearest || distance < *nearest) nearest = distance;
  }
  return nearest;
}

}  // namespace

void mark_held_ends(rebar::Member& member, const HexMesh& mesh, const Supports& supports) {
  member.held_start = section_held(member, 0, mesh, supports);
  member.held_end = section_held(member, member.length, mesh, supports);
}

std::string anchor_bars(std::vector<rebar::Bar>& bars, const rebar::HostSearch& host, const HexMesh& mesh,
                        const Supports& supports) {
  int short_ends = 0;
  double widest = 0;
  std::string first;
  for (rebar::Bar& bar : bars) {
    const std::vector<Vec3>& p = bar.points;
    if ((p.back() - p.front()).norm() < 1e-6 * bar.length()) continue;  // closed: holds itself
    const auto check = [&](const Vec3& end, const Vec3& inner, bool& anchored) {
      const auto gap = to_held_face(end, (end - inner).normalized(), host, mesh, supports);
      if (!gap) return;
      if (*gap < 1e-6 * bar.length())
        anchored = true;
      else if (!bar.file.empty()) {
        if (short_ends++ == 0) first = bar.name;
        widest = std::max(widest, *gap);
      }
    };
    check(p.front(), p[1], bar.start_held);
    check(p.back(), p[p.size() - 2], bar.end_held);
  }
  if (short_ends == 0) return {};
  return fmt::format(
      "{} end{} of bars ({}{}) stop{} up to {:.3g} m before a held face: nothing anchors them there, and the "
      "section at the support is weaker than drawn; run them to the face, "
      "where they count as anchored, or accept it",
      short_ends, short_ends == 1 ? "" : "s", first, short_ends == 1 ? "" : ", ...",
      short_ends == 1 ? "s" : "", widest);
}

}  // namespace talus::fem
