// Bodies taken out of the ground. One of the few files that pay for CGAL's headers.
#include "geometry/take_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "contact/geometry/polyhedron.hpp"
#include "core/disjoint_sets.hpp"
#include "geometry/cut_internal.hpp"
#include "geometry/overlay.hpp"
#include "geometry/slivers.hpp"

namespace talus::geometry {
namespace {

InputError error(std::string key, std::string value, std::string rule, std::string remedy) {
  return InputError(Problem{.key = std::move(key),
                            .value = std::move(value),
                            .rule = std::move(rule),
                            .remedy = std::move(remedy)});
}

/// Numbers of a surface's triangles whose boxes in plan meet the limits.
std::vector<int> within(const TriangleSurface& s, const Eigen::AlignedBox2d& limits) {
  std::vector<int> found;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    Eigen::AlignedBox2d own;
    for (const int v : s.triangles[t])
      own.extend(Eigen::Vector2d(s.vertices[static_cast<std::size_t>(v)].head<2>()));
    if (own.intersects(limits)) found.push_back(static_cast<int>(t));
  }
  return found;
}

/// Throws if one of these triangles does not face up.
void expect_facing_up(const TriangleSurface& s, const std::vector<int>& triangles, const std::string& key,
                      const std::string& what) {
  for (const int t : triangles) {
    const auto& v = s.triangles[static_cast<std::size_t>(t)];
    const Vec3 &a = s.vertices[static_cast<std::size_t>(v[0])],
               &b = s.vertices[static_cast<std::size_t>(v[1])],
               &c = s.vertices[static_cast<std::size_t>(v[2])];
    if ((b - a).cross(c - a).z() > 0) continue;
    const Vec3 m = (a + b + c) / 3;
    throw error(key, fmt::format("({:.6g}, {:.6g}, {:.6g})", m.x(), m.y(), m.z()),
                what + " overhangs or is vertical there, so that what lies above it is not known",
                "give the body as a closed mesh (region) beside ground that faces up there");
  }
}

/// Leaves out triangles of both surfaces that are the same in plan, where nothing is to be taken out of them
/// nor of those around them.
void leave_out_what_stays(const TriangleSurface& ground, std::vector<int>& near, const TriangleSurface& slip,
                          std::vector<int>& lower) {
  using Place = std::array<double, 2>;
  const auto place = [](const Vec3& x) { return Place{x.x(), x.y()}; };
  const auto corners = [&](const TriangleSurface& s, int t) {
    std::array<Place, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const int v = s.triangles[static_cast<std::size_t>(t)][k];
      p[k] = place(s.vertices[static_cast<std::size_t>(v)]);
    }
    std::sort(p.begin(), p.end());
    return p;
  };
  std::map<Place, double> height;
  std::map<std::array<Place, 3>, int> below;
  for (const int t : lower) {
    below.emplace(corners(slip, t), t);
    for (const int v : slip.triangles[static_cast<std::size_t>(t)]) {
      const Vec3& x = slip.vertices[static_cast<std::size_t>(v)];
      height.emplace(place(x), x.z());
    }
  }
  std::vector<int> same(near.size(), -1);  // the triangle of the slip surface
  std::vector<char> at_work(ground.vertices.size(), 0);
  for (std::size_t i = 0; i < near.size(); ++i) {
    const auto& t = ground.triangles[static_cast<std::size_t>(near[i])];
    const auto twin = below.find(corners(ground, near[i]));
    const bool stays = twin != below.end() && std::all_of(t.begin(), t.end(), [&](int v) {
                         const Vec3& x = ground.vertices[static_cast<std::size_t>(v)];
                         return height.at(place(x)) >= x.z();
                       });
    if (stays)
      same[i] = twin->second;
    else
      for (const int v : t) at_work[static_cast<std::size_t>(v)] = 1;
  }
  std::vector<int> near_kept;
  std::set<int> left_out;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const auto& t = ground.triangles[static_cast<std::size_t>(near[i])];
    if (same[i] < 0 ||
        std::any_of(t.begin(), t.end(), [&](int v) { return at_work[static_cast<std::size_t>(v)] != 0; }))
      near_kept.push_back(near[i]);
    else
      left_out.insert(same[i]);
  }
  near = std::move(near_kept);
  std::erase_if(lower, [&](int t) { return left_out.contains(t); });
}

/// Pieces of the mass that are connected, and those that are no piece: round-off, or smaller than asked for.
std::vector<int> pieces_to_leave(const ExactComplex& complex, const std::vector<int>& cells,
                                 double least_volume, std::vector<Problem>& warnings) {
  std::map<int, int> place;
  for (const int c : cells) place.emplace(c, static_cast<int>(place.size()));
  DisjointSets sets(static_cast<int>(cells.size()));
  for (const auto& f : complex.faces())
    if (place.contains(f.cell[0]) && place.contains(f.cell[1]))
      sets.join(place.at(f.cell[0]), place.at(f.cell[1]));
  std::vector<double> volume(cells.size(), 0.0), surface(cells.size(), 0.0);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const auto root = static_cast<std::size_t>(sets.root(static_cast<int>(k)));
    volume[root] += complex.volume(cells[k]);
    surface[root] += complex.surface(cells[k]);
  }
  std::vector<int> leave;
  std::set<std::size_t> small;
  double stays = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const auto root = static_cast<std::size_t>(sets.root(static_cast<int>(k)));
    const bool round_off = volume[root] <= 0.5 * complex.snap() * surface[root];
    if (!round_off && volume[root] >= least_volume) continue;
    leave.push_back(cells[k]);
    if (!round_off && small.insert(root).second) stays += volume[root];
  }
  std::map<int, double> pieces;
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (const int root = sets.root(static_cast<int>(k));
        volume[static_cast<std::size_t>(root)] >= least_volume)
      pieces[root] = volume[static_cast<std::size_t>(root)];
  if (pieces.size() > 1 && least_volume == 0) {
    double all = 0, most = 0;
    for (const auto& [root, v] : pieces) all += v, most = std::max(most, v);
    warnings.push_back(
        {.severity = Problem::Severity::warning,
         .key = "rock_mass",
         .value = fmt::format("{} pieces", pieces.size()),
         .rule = fmt::format("the mass is not in one piece: the largest piece has {:.4g} of {:.4g} m^3", most,
                             all),
         .remedy =
             "leave small ones in the ground by rock_mass.least_volume; give slip surface and terrain on "
             "one grid"});
  }
  if (!small.empty())
    warnings.push_back(
        {.severity = Problem::Severity::warning,
         .key = "rock_mass.least_volume",
         .value = fmt::format("{:g} m^3", least_volume),
         .rule = fmt::format("{} pieces of the mass, {:.3g} m^3 together, are smaller and stay in the ground",
                             small.size(), stays),
         .remedy = "set it lower to take them out too"});
  return leave;
}

/// What is left of the ground: the faces of the rest.
class Remains {
 public:
  Remains(const ExactComplex& complex, int rest, const TriangleSurface& before, const std::vector<int>& near,
          int bed, TakenOut& out)
      : complex_(complex), rest_(rest), before_(before), bed_(bed), out_(out) {
    out_.ground = before;
    out_.ground.triangles.clear();
    out_.ground.material.clear();
    std::vector<char> looked_at(before.triangles.size(), 0);
    for (const int t : near) looked_at[static_cast<std::size_t>(t)] = 1;
    for (std::size_t t = 0; t < before.triangles.size(); ++t)
      if (looked_at[t] == 0) put(before.triangles[t], material(static_cast<int>(t)), false);
    // What was there keeps its vertices.
    for (const int t : near)
      for (const int v : before.triangles[static_cast<std::size_t>(t)]) {
        const Vec3& x = before.vertices[static_cast<std::size_t>(v)];
        number_.try_emplace({x.x(), x.y(), x.z()}, v);
      }
    sort_faces();
    for (const int t : near) add_ground(t);
    for (const int f : hollow_) add_loop(loop_of(f), bed_, true);
    remove_slivers_of_hollow();
    ++out_.ground.revision;
  }

 private:
  void remove_slivers_of_hollow() {
    TriangleSurface& g = out_.ground;
    const std::vector<int> source = remove_slivers(g.vertices, g.triangles, complex_.snap());
    const std::vector<int> material = std::exchange(g.material, {});
    const std::vector<char> hollow = std::exchange(out_.hollow, {});
    for (const int t : source) {
      g.material.push_back(material[static_cast<std::size_t>(t)]);
      out_.hollow.push_back(hollow[static_cast<std::size_t>(t)]);
    }
  }

  int material(int t) const {
    return before_.material.empty() ? before_.default_material
                                    : before_.material[static_cast<std::size_t>(t)];
  }
  void put(const std::array<int, 3>& t, int material, bool hollow) {
    out_.ground.triangles.push_back(t);
    out_.ground.material.push_back(material);
    out_.hollow.push_back(hollow ? 1 : 0);
  }

  void sort_faces() {
    for (std::size_t f = 0; f < complex_.faces().size(); ++f) {
      const auto& face = complex_.faces()[f];
      const bool first = face.cell[0] == rest_, second = face.cell[1] == rest_;
      if (first != second) {
        const bool outside = (first ? face.cell[1] : face.cell[0]) < 0;
        if (!outside)
          hollow_.push_back(static_cast<int>(f));
        else if (face.mark >= 0)
          stays_[face.mark].push_back(static_cast<int>(f));
      } else if (!first && face.mark >= 0) {
        taken_.insert(face.mark);
      }
    }
    for (const int f : hollow_)
      for (const int v : complex_.faces()[static_cast<std::size_t>(f)].loop) needed_.insert(v);
    for (const auto& [t, faces] : stays_)
      if (taken_.contains(t))
        for (const int f : faces)
          for (const int v : complex_.faces()[static_cast<std::size_t>(f)].loop) needed_.insert(v);
  }

  /// Outward of the rest.
  std::vector<int> loop_of(int f) const {
    const auto& face = complex_.faces()[static_cast<std::size_t>(f)];
    std::vector<int> loop = face.loop;
    if (face.cell[0] != rest_) std::reverse(loop.begin(), loop.end());
    return loop;
  }

  /// A triangle that stays as a whole keeps its corners, and those on its border that its neighbours have.
  void add_ground(int t) {
    const auto it = stays_.find(t);
    if (it == stays_.end()) return;
    if (taken_.contains(t)) {
      for (const int f : it->second) add_loop(loop_of(f), material(t), false);
      return;
    }
    std::map<int, int> next;
    std::set<std::pair<int, int>> edges;
    for (const int f : it->second) {
      const std::vector<int> loop = loop_of(f);
      for (std::size_t k = 0; k < loop.size(); ++k) edges.emplace(loop[k], loop[(k + 1) % loop.size()]);
    }
    for (const auto& [a, b] : edges)
      if (!edges.contains({b, a})) next[a] = b;
    std::set<std::array<double, 3>> corners;
    for (const int v : before_.triangles[static_cast<std::size_t>(t)]) {
      const Vec3& x = before_.vertices[static_cast<std::size_t>(v)];
      corners.insert({x.x(), x.y(), x.z()});
    }
    std::vector<int> loop;
    const int first = next.begin()->first;
    int v = first;
    do {
      const Vec3& x = complex_.vertices()[static_cast<std::size_t>(v)];
      if (needed_.contains(v) || corners.contains({x.x(), x.y(), x.z()})) loop.push_back(v);
      v = next.at(v);
    } while (v != first);
    if (loop.size() == 3)
      put(before_.triangles[static_cast<std::size_t>(t)], material(t), false);
    else
      add_loop(loop, material(t), false);
  }

  int vertex(int v) {
    const Vec3& x = complex_.vertices()[static_cast<std::size_t>(v)];
    const auto [at, added] =
        number_.try_emplace({x.x(), x.y(), x.z()}, static_cast<int>(out_.ground.vertices.size()));
    if (added) out_.ground.vertices.push_back(x);
    return at->second;
  }

  /// A convex polygon, which may have vertices within its sides, as triangles none of which is flat.
  void add_loop(std::vector<int> loop, int material, bool hollow) {
    const auto flat = [&](std::size_t k) {
      const std::size_t n = loop.size();
      return CGAL::collinear(complex_.point(loop[(k + n - 1) % n]), complex_.point(loop[k]),
                             complex_.point(loop[(k + 1) % n]));
    };
    const auto emit = [&](int a, int b, int c) {
      const std::array<int, 3> t{vertex(a), vertex(b), vertex(c)};
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) put(t, material, hollow);
    };
    while (loop.size() > 3) {
      const std::size_t n = loop.size();
      std::size_t corner = n;  // one beside a vertex within a side, whose triangle leaves a convex polygon
      for (std::size_t k = 0; k < n && corner == n; ++k)
        if (!flat(k) && flat((k + 1) % n)) corner = k;
      if (corner == n) break;
      emit(loop[(corner + n - 1) % n], loop[corner], loop[(corner + 1) % n]);
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(corner));
    }
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) emit(loop[0], loop[k], loop[k + 1]);
  }

  const ExactComplex& complex_;
  int rest_;
  const TriangleSurface& before_;
  int bed_;
  TakenOut& out_;
  std::map<int, std::vector<int>> stays_;  // of a triangle of the ground: its faces that stay
  std::set<int> taken_;                    // triangles of which a part goes
  std::vector<int> hollow_;
  std::set<int> needed_;                         // vertices that others than whole triangles have
  std::map<std::array<double, 3>, int> number_;  // by place
};

/// The mass alone, as the cutter takes it.
std::shared_ptr<const CellComplex> mass_of(ExactComplex complex, int rest) {
  complex.remove_cell(rest);
  for (auto& f : complex.faces()) f.mark = f.cell[1] >= 0 ? cutting::mark_division : cutting::mark_surface;
  return std::make_shared<const ExactComplex>(std::move(complex));
}

}  // namespace

TakenOut take_out(const TriangleSurface& ground, const TriangleSurface* slip, const Mesh* region, int bed,
                  double least_volume) {
  Box3 box;
  if (region != nullptr) box = region->bounds();
  if (slip != nullptr) {
    Box3 below;
    for (const Vec3& x : slip->vertices) below.extend(x);
    constexpr double everywhere = std::numeric_limits<double>::infinity();
    below.max().z() = everywhere;
    box = region == nullptr ? below : box.intersection(below);
    if (box.isEmpty())
      throw error("rock_mass.slip_surface", "", "nothing of the region lies above it",
                  "give region or box, and the slip surface, in scene coordinates");
  }
  const Eigen::AlignedBox2d plan(Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>()));
  std::vector<int> near = within(ground, plan);
  const auto nothing = [&] {
    return error("rock_mass",
                 fmt::format("x {:.6g} to {:.6g}, y {:.6g} to {:.6g}, from z = {:.6g}", box.min().x(),
                             box.max().x(), box.min().y(), box.max().y(), box.min().z()),
                 "lies nowhere below the terrain, out of which it is to be cut",
                 "give it in scene coordinates: map coordinates less site.origin");
  };
  if (near.empty()) throw nothing();
  expect_facing_up(ground, near, "site.terrain", "the terrain");
  // Without a slip surface the body reaches below all of the region.
  TriangleSurface floor;
  std::vector<int> lower = near;
  Box3 of_ground;
  for (const int t : near)
    for (const int v : ground.triangles[static_cast<std::size_t>(t)])
      of_ground.extend(ground.vertices[static_cast<std::size_t>(v)]);
  if (slip != nullptr) {
    lower = within(*slip, plan);
    expect_facing_up(*slip, lower, "rock_mass.slip_surface", "the slip surface");
    leave_out_what_stays(ground, near, *slip, lower);
    if (near.empty()) throw nothing();
  } else {
    floor = ground;
    const double low = std::min(of_ground.min().z(), box.min().z()) - box.diagonal().norm();
    for (Vec3& x : floor.vertices) x.z() = low;
  }
  const double sliver = 1e-10 * of_ground.diagonal().norm();
  Between b = between(ground, near, slip != nullptr ? *slip : floor, lower, sliver);
  std::vector<int> mass = b.bodies;
  if (region != nullptr && !mass.empty()) {
    cutting::Parts parts =
        cutting::divide_by(b.complex, mass, make_polyhedron(region->vertices, region->triangles));
    for (const int c : parts.outside) b.complex.hand_over(c, b.rest);
    mass = std::move(parts.inside);
  }
  TakenOut out;
  const std::vector<int> left = pieces_to_leave(b.complex, mass, least_volume, out.warnings);
  if (left.size() == mass.size()) throw nothing();
  for (const int c : left) b.complex.hand_over(c, b.rest);
  Remains(b.complex, b.rest, ground, near, bed, out);
  out.mass = mass_of(std::move(b.complex), b.rest);
  return out;
}

}  // namespace talus::geometry
