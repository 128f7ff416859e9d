#include "geometry/terrain_sheets.hpp"
#include "core/place.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace talus::geometry {
namespace {

constexpr double upright = 1e-6;  // plan area over area: below, single-precision coordinates decide nothing

using Triangles = std::vector<std::array<int, 3>>;

/// A face's side, its ends sorted, and whether the face runs from the lower to the higher one.
struct Side {
  int low, high, triangle;
  bool forward;
};

std::vector<Side> sorted_sides(const Triangles& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      if (a != b) sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), a < b});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.low, x.high, x.triangle) < std::tie(y.low, y.high, y.triangle);
  });
  return sides;
}

/// Removes triangles whose three vertices an earlier one has, in either order. Returns how many.
std::size_t drop_repeated(Triangles& triangles) {
  std::vector<std::pair<std::array<int, 3>, std::size_t>> sorted;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    sorted.emplace_back(triangles[t], t);
    std::sort(sorted.back().first.begin(), sorted.back().first.end());
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<char> repeated(triangles.size(), 0);
  for (std::size_t i = 1; i < sorted.size(); ++i)
    repeated[sorted[i].second] = sorted[i].first == sorted[i - 1].first;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (!repeated[t]) triangles[kept++] = triangles[t];
  const std::size_t dropped = triangles.size() - kept;
  triangles.resize(kept);
  return dropped;
}

/// Places of a kind: how many, and the middle of the first.
struct Places {
  std::size_t count = 0;
  Vec3 first = Vec3::Zero();
  void add(const Vec3& at) {
    if (count++ == 0) first = at;
  }
};

/// Neighbours across the edges that two faces share: for each side of a face the other face, and whether both
/// run along the edge in the same direction.
struct Neighbours {
  std::vector<std::array<int, 3>> face;     // -1: none, -2: none at all, the border
  std::vector<std::array<bool, 3>> agrees;  // opposite directions along the edge
  std::vector<char> at_border;              // a side of it has no neighbour
  std::vector<Vec3> crowded;                // middles of edges of more than two faces
};

Neighbours neighbours_of(const std::vector<Vec3>& vertices, const Triangles& triangles) {
  Neighbours out;
  out.face.assign(triangles.size(), {-1, -1, -1});
  out.agrees.assign(triangles.size(), {true, true, true});
  out.at_border.assign(triangles.size(), 0);
  const std::vector<Side> sides = sorted_sides(triangles);
  const auto side_of = [&](const Side& s) {
    const auto& t = triangles[static_cast<std::size_t>(s.triangle)];
    for (std::size_t k = 0; k < 3; ++k)
      if (std::min(t[k], t[(k + 1) % 3]) == s.low && std::max(t[k], t[(k + 1) % 3]) == s.high) return k;
    return std::size_t{0};
  };
  for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
    for (j = i + 1; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;) ++j;
    if (j == i + 2 && sides[i].triangle != sides[i + 1].triangle) {
      const Side &x = sides[i], &y = sides[i + 1];
      const std::size_t p = side_of(x), q = side_of(y);
      out.face[static_cast<std::size_t>(x.triangle)][p] = y.triangle;
      out.face[static_cast<std::size_t>(y.triangle)][q] = x.triangle;
      out.agrees[static_cast<std::size_t>(x.triangle)][p] =
          out.agrees[static_cast<std::size_t>(y.triangle)][q] = x.forward != y.forward;
      continue;
    }
    if (j == i + 1) out.face[static_cast<std::size_t>(sides[i].triangle)][side_of(sides[i])] = -2;
    if (j > i + 2)
      out.crowded.push_back(0.5 * (vertices[static_cast<std::size_t>(sides[i].low)] +
                                   vertices[static_cast<std::size_t>(sides[i].high)]));
    for (std::size_t k = i; k < j; ++k) out.at_border[static_cast<std::size_t>(sides[k].triangle)] = 1;
  }
  return out;
}

Problem warning(const std::string& name, std::string value, std::string rule, std::string remedy) {
  return {.severity = Problem::Severity::warning,
          .file = name,
          .key = "site.terrain",
          .value = std::move(value),
          .rule = std::move(rule),
          .remedy = std::move(remedy)};
}

/// Rims of the open sheets: border sides that are connected by their ends.
std::size_t rims(const Triangles& triangles, const Neighbours& next, std::size_t vertices) {
  std::vector<int> parent(vertices, -1);  // -1: not at the border
  const auto root = [&](int v) {
    while (parent[static_cast<std::size_t>(v)] != v)
      v = parent[static_cast<std::size_t>(v)] =
          parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(v)])];
    return v;
  };
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      if (next.face[t][k] != -2) continue;
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      for (const int v : {a, b})
        if (parent[static_cast<std::size_t>(v)] < 0) parent[static_cast<std::size_t>(v)] = v;
      parent[static_cast<std::size_t>(root(a))] = root(b);
    }
  std::size_t count = 0;
  for (std::size_t v = 0; v < vertices; ++v) count += parent[v] == static_cast<int>(v);
  return count;
}

/// What hangs in the air, and where ground is missing.
void warn_of_pieces(std::vector<std::pair<std::size_t, Vec3>> pieces, std::size_t open, std::size_t rims,
                    const std::string& name, std::vector<Problem>& warnings) {
  constexpr std::size_t most_named = 3;
  if (pieces.size() > 1) {
    std::sort(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    std::string others;
    for (std::size_t i = 1; i < std::min(pieces.size(), most_named + 1); ++i)
      others += fmt::format("{}{} face{} at {}", i > 1 ? ", " : "", pieces[i].first,
                            pieces[i].first == 1 ? "" : "s", place_text(pieces[i].second));
    if (pieces.size() > most_named + 1) others += fmt::format(", {} more", pieces.size() - most_named - 1);
    warnings.push_back(
        warning(name, fmt::format("{} pieces", pieces.size()),
                fmt::format("share no edge with each other: beside the largest, {}; each faces up by itself "
                            "and ends in walls where no other ground goes on",
                            others),
                "delete what is loose, or merge the vertices along seams (talus convert --repair welds those "
                "within 1e-9 of the size)"));
  }
  if (rims > open)
    warnings.push_back(warning(name, fmt::format("{} hole{}", rims - open, rims - open == 1 ? "" : "s"),
                               "faces are missing within the terrain: a block that gets there falls",
                               "close them in the mesh, if the ground goes on there"));
}

/// Faces of a sheet, and its sums.
struct Sheet {
  std::vector<int> faces;
  bool closed = true;
  double plan = 0, area = 0, as_filed = 0,
         volume = 0;  // six times the volume, about the first face's vertex; twice the areas
  Vec3 outward = Vec3::Zero();
};

std::string edges(const Places& p, const Vec3& origin) {
  return p.count == 1 ? fmt::format("an edge at {}", place_text(p.first + origin))
                      : fmt::format("{} edges, one at {}", p.count, place_text(p.first + origin));
}

}  // namespace

std::vector<Problem> orient_sheets(const std::vector<Vec3>& vertices, Triangles& triangles,
                                   const std::string& name, const Vec3& origin,
                                   const std::optional<Box3>& crop) {
  const auto kept = [&](const Box3& box) {  // by the crop, in plan
    for (int k = 0; crop && k < 2; ++k)
      if (box.max()[k] < crop->min()[k] || box.min()[k] > crop->max()[k]) return false;
    return true;
  };
  std::vector<Problem> warnings;
  if (const std::size_t repeated = drop_repeated(triangles); repeated > 0)
    warnings.push_back(warning(name, fmt::format("{}", repeated), "faces that the file repeats were left out",
                               "none needed"));
  const Neighbours next = neighbours_of(vertices, triangles);
  const auto area_vector = [&](int t) -> Vec3 {
    const auto& c = triangles[static_cast<std::size_t>(t)];
    const Vec3& a = vertices[static_cast<std::size_t>(c[0])];
    return (vertices[static_cast<std::size_t>(c[1])] - a).cross(vertices[static_cast<std::size_t>(c[2])] - a);
  };
  std::vector<signed char> sign(triangles.size(), 0);  // against the file's winding; 0: not reached yet
  std::vector<Vec3> conflicts;                         // middles of edges across which faces change sides
  std::size_t against = 0, open = 0;
  std::vector<std::pair<std::size_t, Vec3>> pieces;  // faces, a place
  for (std::size_t first = 0; first < triangles.size(); ++first) {
    if (sign[first] != 0) continue;
    Sheet sheet;
    const Vec3 base = vertices[static_cast<std::size_t>(triangles[first][0])];
    sign[first] = 1;
    sheet.faces.push_back(static_cast<int>(first));
    for (std::size_t i = 0; i < sheet.faces.size(); ++i) {
      const int t = sheet.faces[i];
      const auto k = static_cast<std::size_t>(t);
      const Vec3 n = sign[k] * area_vector(t);
      sheet.outward += n;
      sheet.plan += n.z();
      sheet.area += n.norm();
      sheet.as_filed += sign[k] * n.norm();
      sheet.volume += n.dot(vertices[static_cast<std::size_t>(triangles[k][0])] - base);
      sheet.closed = sheet.closed && !next.at_border[k];
      for (std::size_t s = 0; s < 3; ++s) {
        const int u = next.face[k][s];
        if (u < 0) continue;
        const auto wanted = static_cast<signed char>(next.agrees[k][s] ? sign[k] : -sign[k]);
        signed char& has = sign[static_cast<std::size_t>(u)];
        if (has == 0) {
          has = wanted;
          sheet.faces.push_back(u);
        } else if (has != wanted) {
          sheet.closed = false;
          if (t < u)
            conflicts.push_back(0.5 * (vertices[static_cast<std::size_t>(triangles[k][s])] +
                                       vertices[static_cast<std::size_t>(triangles[k][(s + 1) % 3])]));
        }
      }
    }
    Box3 box;
    for (const int t : sheet.faces)
      for (const int v : triangles[static_cast<std::size_t>(t)])
        box.extend(vertices[static_cast<std::size_t>(v)]);
    if (kept(box)) pieces.emplace_back(sheet.faces.size(), base + origin);
    open += !sheet.closed;
    const bool stands = !sheet.closed && std::abs(sheet.plan) <= upright * sheet.area;
    const bool turn = sheet.closed ? sheet.volume < 0 : stands ? sheet.as_filed < 0 : sheet.plan < 0;
    std::size_t turned = 0;
    for (const int t : sheet.faces) {
      signed char& s = sign[static_cast<std::size_t>(t)];
      if (turn) s = static_cast<signed char>(-s);
      turned += s < 0;
    }
    against += std::min(turned, sheet.faces.size() - turned);
    if (stands && sheet.area > 0 && kept(box)) {
      const Vec3 n = ((turn ? -1 : 1) * sheet.outward.normalized()).unaryExpr([](double x) {
        return std::round(100 * x) / 100 + 0.0;
      });  // no -0
      warnings.push_back(
          warning(name, fmt::format("{} faces at {}", sheet.faces.size(), place_text(base + origin)),
                  fmt::format("stand upright, connected to nothing that faces up: their winding in the file "
                              "tells the side of the rock; they face [{:g}, {:g}, {:g}]",
                              n.x(), n.y(), n.z()),
                  "turn them in the file if the rock lies on the other side, or set site.two_sided for a "
                  "sheet that bears from both"));
    }
  }
  const std::size_t borders =
      crop ? 0 : rims(triangles, next, vertices.size());  // sides are numbered as the file winds its faces
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (sign[t] < 0) std::swap(triangles[t][1], triangles[t][2]);
  if (against > 0)
    warnings.push_back(
        warning(name, fmt::format("{} of {} faces", against, triangles.size()),
                "are wound against their neighbours; they were turned to face to the same side",
                "none needed, if the file is as meant"));
  Places crowded, inconsistent;
  for (const Vec3& x : next.crowded)
    if (kept(Box3(x, x))) crowded.add(x);
  for (const Vec3& x : conflicts)
    if (kept(Box3(x, x))) inconsistent.add(x);
  if (crowded.count > 0)
    warnings.push_back(warning(name, edges(crowded, origin),
                               "more than two faces meet there: the side of the rock is not carried across, "
                               "each part faces up by itself",
                               "remove inner walls and flaps from the mesh where parts of it overhang"));
  warn_of_pieces(std::move(pieces), open, borders, name, warnings);
  if (inconsistent.count > 0)
    warnings.push_back(warning(name, edges(inconsistent, origin),
                               "the sheet closes in itself like a Moebius strip, so that its faces cannot "
                               "all have the rock on the same side; they change sides there",
                               "correct the mesh, or set site.two_sided"));
  return warnings;
}

}  // namespace talus::geometry
