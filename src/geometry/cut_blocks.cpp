// Cells to blocks: gluing, merging of slivers, and the boundary of each block without the traces of the
// division.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "core/disjoint_sets.hpp"
#include "geometry/cut_internal.hpp"
#include "geometry/mesh.hpp"
#include "geometry/slivers.hpp"

namespace talus::geometry::cutting {
namespace {

/// The boundary of one block as the complex has it.
struct Side {
  int face;               // of the complex
  int cell;               // the block's cell behind it
  std::vector<int> loop;  // outward, vertices of the complex; later local copies
  int plane, joint;
  bool along;  // outward normal = plane's normal
  double area;
};

/// Faces of a block lower than this, times its size, face anywhere by rounding; a tenth of the overlap of
/// blocks at the start that counts as contact.
constexpr double thin = 1e-10;

class BlockBuilder {
 public:
  BlockBuilder(const CellComplex& complex, const std::vector<Mark>& marks, const std::vector<int>& block_of)
      : complex_(complex), marks_(marks), block_of_(block_of) {}

  CutBlock build(const std::vector<int>& cells) {
    collect(cells);
    copy_corners();
    double volume = 0;
    for (int c : cells) volume += complex_.volume(c);
    std::vector<std::array<int, 3>> triangles;
    std::vector<int> joint, patch;
    const double size = bounds().diagonal().norm();
    if (!simplified(triangles, joint, patch) ||
        std::abs(signed_volume(x_, triangles) - volume) > 1e-12 * size * size * size)
      raw(triangles, joint, patch);
    divide_diagonals(triangles, joint, patch);
    const std::vector<int> source = remove_slivers(x_, triangles, thin * size);
    const std::vector<int> given = joint;
    joint.clear();
    for (const int t : source) joint.push_back(given[static_cast<std::size_t>(t)]);
    CutBlock block;
    block.cells = static_cast<int>(cells.size());
    block.centroid = centroid(triangles);
    for (Vec3& v : x_) v -= block.centroid;
    block.volume = signed_volume(x_, triangles);
    try {
      block.body = make_polyhedron(x_, triangles, one_plane);
    } catch (const InputError& e) {
      throw InputError(Problem{
          .key = "rock_mass",
          .value = fmt::format("({:.6g}, {:.6g}, {:.6g})", block.centroid.x(), block.centroid.y(),
                               block.centroid.z()),
          .rule = "the block about this place would touch itself in an edge: " + e.problems().front().str(),
          .remedy = "shift the origin of a joint set, the region or the slip surface by a centimetre"});
    }
    // The joint of a face: that of the larger part of its triangles (coplanar parts may come from two
    // joints).
    block.body.face_joint_set.assign(block.body.faces(), -1);
    std::map<std::pair<int, int>, double> share;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const auto& c = triangles[t];
      share[{block.body.triangle_face[t], joint[t]}] +=
          (x_[c[1]] - x_[c[0]]).cross(x_[c[2]] - x_[c[0]]).norm();
    }
    std::vector<double> best(block.body.faces(), -1);
    for (const auto& [key, area] : share)
      if (area > best[key.first]) best[key.first] = area, block.body.face_joint_set[key.first] = key.second;
    return block;
  }

 private:
  void collect(const std::vector<int>& cells) {
    sides_.clear();
    const int block = block_of_[cells[0]];
    for (int c : cells)
      for (int f : complex_.cells()[c].faces) {
        const auto& face = complex_.faces()[f];
        const bool first = face.cell[0] == c;
        const int other = face.cell[first ? 1 : 0];
        if (other >= 0 && block_of_[other] == block) continue;
        Side s{f, c, face.loop, face.plane, marks_[face.mark].joint, false, complex_.area(f)};
        if (!first) std::reverse(s.loop.begin(), s.loop.end());
        s.along = complex_.area_vector(f).dot(complex_.planes()[face.plane].normal) * (first ? 1 : -1) > 0;
        sides_.push_back(std::move(s));
      }
  }

  /// Edge uses of all sides: (lower, higher vertex, side, corner).
  struct Use {
    int a, b, side, corner;
  };
  std::vector<Use> edge_uses() const {
    std::vector<Use> uses;
    for (int s = 0; s < static_cast<int>(sides_.size()); ++s) {
      const auto& loop = sides_[s].loop;
      for (int k = 0; k < static_cast<int>(loop.size()); ++k) {
        const int u = loop[k], v = loop[(k + 1) % loop.size()];
        uses.push_back({std::min(u, v), std::max(u, v), s, k});
      }
    }
    std::sort(uses.begin(), uses.end(), [](const Use& l, const Use& r) {
      return std::tie(l.a, l.b, l.side, l.corner) < std::tie(r.a, r.b, r.side, r.corner);
    });
    return uses;
  }

  /// A vertex where two parts of the block only touch becomes two: the surface stays a manifold. Fills x_ and
  /// the sides' loops with local numbers, and twin_ with the neighbouring side across each edge.
  void copy_corners() {
    std::vector<int> offset{0};
    for (const Side& s : sides_) offset.push_back(offset.back() + static_cast<int>(s.loop.size()));
    DisjointSets corners(static_cast<int>(offset.back()));
    twin_.assign(sides_.size(), {});
    for (std::size_t s = 0; s < sides_.size(); ++s) twin_[s].assign(sides_[s].loop.size(), -1);
    const auto uses = edge_uses();
    const auto corner_of = [&](const Use& u, int vertex) {
      const auto& loop = sides_[u.side].loop;
      const int next = (u.corner + 1) % static_cast<int>(loop.size());
      return offset[u.side] + (loop[u.corner] == vertex ? u.corner : next);
    };
    std::vector<std::pair<Use, Use>> wedges;  // at edges where there are several
    const auto glue = [&](const Use& p, const Use& q) {
      corners.join(corner_of(p, p.a), corner_of(q, p.a));
      corners.join(corner_of(p, p.b), corner_of(q, p.b));
      twin_[p.side][p.corner] = q.side;
      twin_[q.side][q.corner] = p.side;
    };
    for (std::size_t i = 0; i < uses.size();) {
      std::size_t j = i;
      while (j < uses.size() && uses[j].a == uses[i].a && uses[j].b == uses[i].b) ++j;
      if (j - i == 2) {
        glue(uses[i], uses[i + 1]);
      } else {
        // Several wedges of the block meet at this edge: walk through the rock of each from face to face.
        for (std::size_t k = i; k < j; ++k) {
          int cell = sides_[uses[k].side].cell, face = sides_[uses[k].side].face;
          for (int guard = 0; guard < 1000; ++guard) {
            face = complex_.neighbour_at_edge(cell, face, uses[i].a, uses[i].b);
            if (face < 0) break;
            const auto& f = complex_.faces()[face];
            const int other = f.cell[f.cell[0] == cell ? 1 : 0];
            if (other < 0 || block_of_[other] != block_of_[cell]) break;
            cell = other;
          }
          for (std::size_t l = i; l < j; ++l)
            if (sides_[uses[l].side].face == face && l != k) {
              glue(uses[k], uses[l]);
              if (l > k) wedges.emplace_back(uses[k], uses[l]);
            }
        }
      }
      i = j;
    }
    x_.clear();
    cuts_.clear();
    std::vector<int> local(static_cast<std::size_t>(offset.back()), -1);
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (std::size_t k = 0; k < sides_[s].loop.size(); ++k) {
        const int root = corners.root(offset[s] + static_cast<int>(k));
        if (local[root] < 0) {
          local[root] = static_cast<int>(x_.size());
          x_.push_back(complex_.vertices()[sides_[s].loop[k]]);
        }
      }
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (std::size_t k = 0; k < sides_[s].loop.size(); ++k)
        sides_[s].loop[k] = local[corners.root(offset[s] + static_cast<int>(k))];
    // Wedges that have both ends of their edge in common get a vertex of their own between.
    std::map<std::pair<int, int>, int> ends;  // -> wedges
    std::vector<std::tuple<int, int, int>> insertions;
    for (const auto& [p, q] : wedges) {
      const auto& loop = sides_[p.side].loop;
      const int a = loop[p.corner], b = loop[(p.corner + 1) % loop.size()];
      if (ends[std::minmax(a, b)]++ == 0) continue;
      const int middle = static_cast<int>(x_.size());
      x_.emplace_back(0.5 * (x_[a] + x_[b]));
      cuts_.push_back(middle);
      insertions.emplace_back(p.side, p.corner, middle);
      insertions.emplace_back(q.side, q.corner, middle);
    }
    std::sort(insertions.rbegin(), insertions.rend());
    for (const auto& [side, corner, v] : insertions) {
      sides_[side].loop.insert(sides_[side].loop.begin() + corner + 1, v);
      twin_[side].insert(twin_[side].begin() + corner + 1, int{twin_[side][corner]});
    }
  }

  Box3 bounds() const {
    Box3 box;
    for (const Vec3& v : x_) box.extend(v);
    return box;
  }

  /// Coplanar neighbours become one polygon, and vertices within a straight edge or within a face are left
  /// out.
  bool simplified(std::vector<std::array<int, 3>>& triangles, std::vector<int>& joint,
                  std::vector<int>& patch) const {
    const int n = static_cast<int>(sides_.size());
    DisjointSets patches(static_cast<int>(n));
    for (int s = 0; s < n; ++s)
      for (int t : twin_[s])
        if (t >= 0 && sides_[s].plane == sides_[t].plane && sides_[s].along == sides_[t].along)
          patches.join(s, t);
    std::vector<std::vector<int>> at_vertex(x_.size());  // patches around each vertex
    for (int s = 0; s < n; ++s)
      for (int v : sides_[s].loop) {
        auto& list = at_vertex[v];
        const int p = patches.root(s);
        if (std::find(list.begin(), list.end(), p) == list.end()) list.push_back(p);
      }
    std::map<int, std::map<int, int>> next;  // patch -> border edge from vertex to vertex
    std::map<int, std::map<int, double>> joint_area;
    for (int s = 0; s < n; ++s) {
      const int p = patches.root(s);
      joint_area[p][sides_[s].joint] += sides_[s].area;
      const auto& loop = sides_[s].loop;
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const int t = twin_[s][k];
        if (t < 0) return false;
        if (patches.root(t) == p) continue;
        if (!next[p].emplace(loop[k], loop[(k + 1) % loop.size()]).second)
          return false;  // the border pinches
      }
    }
    const double straight = 1e-13 * bounds().diagonal().norm();
    std::vector<char> keep(x_.size(), 0);
    for (const int v : cuts_) keep[v] = 1;
    for (const auto& [p, edges] : next)
      for (const auto& [a, b] : edges) {
        if (at_vertex[b].size() != 2) {
          keep[b] = 1;
          continue;
        }
        const auto it = edges.find(b);
        if (it == edges.end()) return false;
        const Vec3 along = x_[it->second] - x_[a];
        if (!(along.norm() > 0) || along.cross(x_[b] - x_[a]).norm() > straight * along.norm() ||
            along.dot(x_[b] - x_[a]) <= 0)
          keep[b] = 1;
      }
    for (const auto& [p, edges] : next) {
      const Vec3 normal = complex_.planes()[sides_[p].plane].normal * (sides_[p].along ? 1 : -1);
      std::vector<std::vector<int>> outer, holes;
      std::map<int, char> seen;
      for (const auto& [start, unused] : edges) {
        if (seen[start]) continue;
        std::vector<int> loop;
        Vec3 area = Vec3::Zero();
        for (int v = start; !seen[v];) {
          seen[v] = 1;
          if (keep[v]) loop.push_back(v);
          const auto it = edges.find(v);
          if (it == edges.end()) return false;
          area += (x_[v] - x_[start]).cross(x_[it->second] - x_[start]);
          v = it->second;
        }
        if (loop.size() < 3) return false;
        (area.dot(normal) > 0 ? outer : holes).push_back(std::move(loop));
      }
      if (outer.size() != 1) return false;
      int best_joint = -1;
      double best = -1;
      for (const auto& [j, area] : joint_area[p])
        if (area > best) best = area, best_joint = j;
      outer.insert(outer.end(), holes.begin(), holes.end());
      const auto part = triangulate_polygon(x_, outer, normal);
      if (part.empty()) return false;
      for (const auto& t : part) triangles.push_back(t), joint.push_back(best_joint), patch.push_back(p);
    }
    return true;
  }

  /// Every side as it is, should the simplification not be possible.
  void raw(std::vector<std::array<int, 3>>& triangles, std::vector<int>& joint,
           std::vector<int>& patch) const {
    triangles.clear();
    joint.clear();
    patch.clear();
    for (const Side& s : sides_) {
      const Vec3 normal = complex_.planes()[s.plane].normal * (s.along ? 1 : -1);
      auto part = triangulate_polygon(x_, {s.loop}, normal);
      if (part.empty())
        for (std::size_t k = 1; k + 1 < s.loop.size(); ++k)
          part.push_back({s.loop[0], s.loop[k], s.loop[k + 1]});
      for (const auto& t : part)
        triangles.push_back(t), joint.push_back(s.joint),
            patch.push_back(static_cast<int>(&s - sides_.data()));
    }
  }

  /// Two patches may have a diagonal between the same two corners, as the upper and the lower side of a lens:
  /// each gets a vertex of its own in the middle.
  void divide_diagonals(std::vector<std::array<int, 3>>& triangles, std::vector<int>& joint,
                        std::vector<int>& patch) {
    std::map<std::pair<int, int>, std::map<int, std::vector<std::size_t>>> at_edge;  // patch -> triangles
    std::map<std::pair<int, int>, int> uses;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) {
        const auto edge = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
        if (++uses[edge] > 2) at_edge[edge];
      }
    if (at_edge.empty()) return;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (int k = 0; k < 3; ++k)
        if (const auto it = at_edge.find(std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]));
            it != at_edge.end())
          it->second[patch[t]].push_back(t);
    for (const auto& [edge, patches] : at_edge)
      for (const auto& [p, sides] : patches) {
        if (sides.size() != 2) continue;  // the border of a patch
        const int middle = static_cast<int>(x_.size());
        x_.emplace_back(0.5 * (x_[edge.first] + x_[edge.second]));
        for (const std::size_t side : sides) divide(side, edge, middle, triangles, joint, patch);
      }
  }

  /// A triangle has been divided before if it has two such diagonals: then one of its parts has the edge.
  static void divide(std::size_t t, const std::pair<int, int>& edge, int middle,
                     std::vector<std::array<int, 3>>& triangles, std::vector<int>& joint,
                     std::vector<int>& patch) {
    const int p = patch[t];
    for (std::size_t i = t; i < triangles.size(); ++i)
      for (int k = 0; k < 3 && patch[i] == p; ++k) {
        const auto [a, b, c] =
            std::array{triangles[i][k], triangles[i][(k + 1) % 3], triangles[i][(k + 2) % 3]};
        if (std::minmax(a, b) != std::minmax(edge.first, edge.second)) continue;
        triangles[i] = {a, middle, c};
        triangles.push_back({middle, b, c});
        joint.push_back(int{joint[i]});
        patch.push_back(p);
        return;
      }
  }

  Vec3 centroid(const std::vector<std::array<int, 3>>& triangles) const {
    const Vec3 o = bounds().center();
    double six = 0;
    Vec3 sum = Vec3::Zero();
    for (const auto& t : triangles) {
      const Vec3 a = x_[t[0]] - o, b = x_[t[1]] - o, c = x_[t[2]] - o;
      const double det = a.dot(b.cross(c));
      six += det;
      sum += det * (a + b + c);
    }
    return six > 0 ? Vec3(o + sum / (4 * six)) : o;
  }

  const CellComplex& complex_;
  const std::vector<Mark>& marks_;
  const std::vector<int>& block_of_;
  std::vector<Side> sides_;
  std::vector<std::vector<int>> twin_;
  std::vector<Vec3> x_;
  std::vector<int> cuts_;  // vertices that keep wedges apart
};

}  // namespace

void make_blocks(const CellComplex& complex, const std::vector<Mark>& marks, double least_volume,
                 CutResult& result) {
  const int n = static_cast<int>(complex.cells().size());
  DisjointSets sets(static_cast<int>(n));
  for (const auto& f : complex.faces())
    if (f.cell[0] >= 0 && f.cell[1] >= 0 && marks[f.mark].intact) sets.join(f.cell[0], f.cell[1]);

  // Slivers, the smallest first, join the neighbour with the largest common area.
  std::vector<double> volume(n, 0.0), surface(n, 0.0);
  std::vector<std::map<int, double>> shared(n);
  for (int c = 0; c < n; ++c)
    if (complex.cells()[c].alive) {
      volume[sets.root(c)] += complex.volume(c);
      surface[sets.root(c)] += complex.surface(c);
    }
  const auto is_round_off = [&](int c) { return volume[c] <= 0.5 * complex.snap() * surface[c]; };
  const auto is_small = [&](int c) { return volume[c] < least_volume || is_round_off(c); };
  for (int f = 0; f < static_cast<int>(complex.faces().size()); ++f) {
    const auto& face = complex.faces()[f];
    if (face.cell[0] < 0 || face.cell[1] < 0) continue;
    const int a = sets.root(face.cell[0]), b = sets.root(face.cell[1]);
    if (a == b || !(is_small(a) || is_small(b))) continue;
    const double area = complex.area(f);
    shared[a][b] += area;
    shared[b][a] += area;
  }
  std::vector<std::pair<double, int>> small;
  for (int c = 0; c < n; ++c)
    if (complex.cells()[c].alive && sets.root(c) == c && is_small(c)) small.emplace_back(volume[c], c);
  std::sort(small.begin(), small.end());
  int alone = 0;
  for (std::size_t i = 0; i < small.size(); ++i) {
    const auto [was, c] = small[i];
    if (sets.root(c) != c || !is_small(c)) continue;  // has been joined by, or has joined, another
    int best = -1;
    double area = 0;
    for (const auto& [other, a] : shared[c])
      if (a > area) area = a, best = other;
    if (best < 0) {
      alone += !is_round_off(c);
      continue;
    }
    const int keep = std::min(c, best), gone = std::max(c, best);
    sets.join(c, best);
    volume[keep] = volume[c] + volume[best];
    surface[keep] = surface[c] + surface[best];
    for (const auto& [other, a] : shared[gone]) {
      shared[other].erase(gone);
      if (other == keep) continue;
      shared[keep][other] += a;
      shared[other][keep] += a;
    }
    shared[gone].clear();
    ++result.merged;
    if (is_small(keep))
      small.insert(std::upper_bound(small.begin() + static_cast<std::ptrdiff_t>(i) + 1, small.end(),
                                    std::pair{volume[keep], keep}),
                   {volume[keep], keep});
  }
  if (alone > 0)
    result.warnings.push_back(
        {.severity = Problem::Severity::warning,
         .key = "rock_mass.least_volume",
         .value = fmt::format("{:g} m^3", least_volume),
         .rule = fmt::format("{} smaller blocks share no face with another that they could join", alone),
         .remedy = "they stay blocks of their own"});

  std::vector<int> block_of(n, -1);
  std::vector<std::vector<int>> members;
  std::vector<int> number(n, -1);
  for (int c = 0; c < n; ++c) {
    const int root = sets.root(c);
    if (!complex.cells()[c].alive || is_round_off(root)) continue;
    if (number[root] < 0) {
      number[root] = static_cast<int>(members.size());
      members.emplace_back();
    }
    block_of[c] = number[root];
    members[block_of[c]].push_back(c);
  }
  std::vector<CutBlock> blocks;
  BlockBuilder builder(complex, marks, block_of);
  for (const auto& cells : members) blocks.push_back(builder.build(cells));

  std::vector<int> order(blocks.size()), rank(blocks.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const Vec3 &p = blocks[a].centroid, &q = blocks[b].centroid;
    return std::tuple(p.z(), p.y(), p.x(), a) < std::tuple(q.z(), q.y(), q.x(), b);
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = static_cast<int>(i);
    result.blocks.push_back(std::move(blocks[order[i]]));
  }

  std::map<std::tuple<int, int, int, int>, CutInterface> interfaces;  // blocks, plane, joint
  for (int f = 0; f < static_cast<int>(complex.faces().size()); ++f) {
    const auto& face = complex.faces()[f];
    if (face.cell[0] < 0 || face.cell[1] < 0 || block_of[face.cell[0]] == block_of[face.cell[1]] ||
        block_of[face.cell[0]] < 0 || block_of[face.cell[1]] < 0)
      continue;
    int a = rank[block_of[face.cell[0]]], b = rank[block_of[face.cell[1]]];
    const bool swap = a > b;
    if (swap) std::swap(a, b);
    const Mark& mark = marks[face.mark];
    CutInterface& i = interfaces[{a, b, face.plane, mark.joint}];
    const double area = complex.area(f);
    const Vec3 middle = complex.centroid(f);
    i.a = a, i.b = b, i.joint = mark.joint;
    i.normal = complex.area_vector(f).normalized() * (swap ? -1 : 1);
    i.centroid = (i.area * i.centroid + area * middle) / (i.area + area);
    i.area += area;
    if (mark.bonded) {
      i.bond_centroid = (i.bonded_area * i.bond_centroid + area * middle) / (i.bonded_area + area);
      i.bonded_area += area;
      i.tension = mark.tension, i.shear = mark.shear;
    }
    std::vector<Vec3> polygon;
    for (int v : face.loop) polygon.push_back(complex.vertices()[v]);
    if (swap) std::reverse(polygon.begin(), polygon.end());
    i.polygons.push_back(std::move(polygon));
  }
  for (auto& [key, i] : interfaces) result.interfaces.push_back(std::move(i));
}

}  // namespace talus::geometry::cutting
