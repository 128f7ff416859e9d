#include "geometry/cell_complex.hpp"

#include <algorithm>
#include <cmath>

namespace talus::geometry {

int CellComplex::add_vertex(const Vec3& x) {
  x_.push_back(x);
  return static_cast<int>(x_.size()) - 1;
}

int CellComplex::add_plane(const Vec3& normal, double offset) {
  planes_.push_back({normal, offset});
  return static_cast<int>(planes_.size()) - 1;
}

void CellComplex::link(int face) {
  const auto& loop = faces_[face].loop;
  for (std::size_t k = 0; k < loop.size(); ++k)
    edge_faces_[key(loop[k], loop[(k + 1) % loop.size()])].push_back(face);
}

void CellComplex::unlink(int face) {
  const auto& loop = faces_[face].loop;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const auto it = edge_faces_.find(key(loop[k], loop[(k + 1) % loop.size()]));
    auto& list = it->second;
    list.erase(std::find(list.begin(), list.end(), face));
    if (list.empty()) edge_faces_.erase(it);
  }
}

int CellComplex::add_cell(const std::vector<std::vector<int>>& loops, const std::vector<int>& planes,
                          int mark) {
  const int cell = static_cast<int>(cells_.size());
  cells_.emplace_back();
  for (std::size_t f = 0; f < loops.size(); ++f) {
    Face face;
    face.loop = loops[f];
    face.cell[0] = cell;
    face.plane = planes[f];
    face.mark = mark;
    faces_.push_back(std::move(face));
    cells_[cell].faces.push_back(static_cast<int>(faces_.size()) - 1);
    link(static_cast<int>(faces_.size()) - 1);
  }
  bound(cell);
  return cell;
}

int CellComplex::add_cell() {
  cells_.emplace_back();
  return static_cast<int>(cells_.size()) - 1;
}

int CellComplex::add_face(Face face) {
  const int f = static_cast<int>(faces_.size());
  faces_.push_back(std::move(face));
  for (const int c : faces_[f].cell)
    if (c >= 0) cells_[c].faces.push_back(f);
  link(f);
  return f;
}

void CellComplex::bound(int cell) {
  Cell& c = cells_[cell];
  Box3 box;
  for (int f : c.faces)
    for (int v : faces_[f].loop) box.extend(x_[v]);
  c.centre = box.center();
  c.radius = 0;
  for (int f : c.faces)
    for (int v : faces_[f].loop) c.radius = std::max(c.radius, (x_[v] - c.centre).norm());
}

int CellComplex::crossing(int a, int b, const CutPlane& p) {
  const double sa = p.normal.dot(x_[a]) - p.offset, sb = p.normal.dot(x_[b]) - p.offset;
  return add_vertex(x_[a] + (sa / (sa - sb)) * (x_[b] - x_[a]));
}

int CellComplex::split_edge(int a, int b, const CutPlane& p) {
  if (a > b) std::swap(a, b);  // the same point whichever face asks
  const int m = crossing(a, b, p);
  const auto it = edge_faces_.find(key(a, b));
  const std::vector<int> around = std::move(it->second);
  edge_faces_.erase(it);
  for (int f : around) {
    auto& loop = faces_[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const int u = loop[k], v = loop[(k + 1) % loop.size()];
      if ((u == a && v == b) || (u == b && v == a)) {
        loop.insert(loop.begin() + static_cast<std::ptrdiff_t>(k) + 1, m);
        break;
      }
    }
  }
  edge_faces_[key(a, m)] = around;
  edge_faces_[key(m, b)] = around;
  return m;
}

/// The face keeps its positive part; the negative part becomes a new face. `sides` goes with the loop, after
/// its edges have been split. False if the face lies on one side.
bool CellComplex::split_loop(int face, const std::vector<int>& sides, int& negative) {
  negative = -1;
  const std::vector<int> loop = faces_[face].loop;
  const std::size_t n = loop.size();
  if (std::find(sides.begin(), sides.end(), 1) == sides.end() ||
      std::find(sides.begin(), sides.end(), -1) == sides.end())
    return false;
  // From the corner on the plane that follows the last + to the one that precedes the first + again.
  std::size_t start = 0;
  while (!(sides[start] <= 0 && sides[(start + n - 1) % n] == 1)) ++start;
  std::size_t end = start;
  while (!(sides[end] <= 0 && sides[(end + 1) % n] == 1)) end = (end + 1) % n;
  if (sides[start] != 0 || sides[end] != 0 || start == end) return false;
  std::vector<int> minus, plus;
  for (std::size_t k = start;; k = (k + 1) % n) {
    minus.push_back(loop[k]);
    if (k == end) break;
  }
  for (std::size_t k = end;; k = (k + 1) % n) {
    plus.push_back(loop[k]);
    if (k == start) break;
  }
  if (minus.size() < 3 || plus.size() < 3) return false;
  unlink(face);
  Face part = faces_[face];
  part.loop = std::move(minus);
  faces_[face].loop = std::move(plus);
  faces_.push_back(std::move(part));
  negative = static_cast<int>(faces_.size()) - 1;
  link(face);
  link(negative);
  for (int c : faces_[negative].cell)
    if (c >= 0) cells_[c].faces.push_back(negative);
  return true;
}

int CellComplex::split_face(int face, const CutPlane& along) {
  bool plus = false, minus = false;
  for (int v : faces_[face].loop) {
    const int s = side(v, along);
    plus |= s > 0;
    minus |= s < 0;
  }
  if (!plus || !minus) return -1;
  const std::vector<int> before = faces_[face].loop;
  for (std::size_t k = 0; k < before.size(); ++k) {
    const int a = before[k], b = before[(k + 1) % before.size()];
    if (side(a, along) * side(b, along) < 0) split_edge(a, b, along);
  }
  std::vector<int> sides;
  for (int v : faces_[face].loop) {
    const bool old = std::find(before.begin(), before.end(), v) != before.end();
    sides.push_back(old ? side(v, along) : 0);
  }
  int negative;
  return split_loop(face, sides, negative) ? negative : -1;
}

std::optional<std::vector<std::vector<int>>> CellComplex::close(int cell, const std::vector<int>& plus_faces,
                                                                const Sides& sides, const CutPlane&) {
  // The new face closes the positive part: its loop is that part's border, run backwards.
  std::unordered_map<std::uint64_t, int> uses;
  for (int f : plus_faces) directed_edges(cell, f, [&](int a, int b) { ++uses[key(a, b)]; });
  std::unordered_map<int, int> previous;
  bool good = true;
  int first = -1;
  for (int f : plus_faces)
    directed_edges(cell, f, [&](int a, int b) {
      if (uses[key(a, b)] != 1) return;
      good &= sides.at(a) == 0 && sides.at(b) == 0 && previous.emplace(b, a).second;
      if (first < 0 || a < first) first = a;
    });
  std::vector<int> loop;
  if (good && first >= 0)
    for (int v = first; loop.size() <= previous.size();) {
      loop.push_back(v);
      const auto it = previous.find(v);
      if (it == previous.end()) return std::nullopt;
      v = it->second;
      if (v == first) break;
    }
  if (!good || loop.size() < 3 || loop.size() != previous.size()) return std::nullopt;
  return std::vector<std::vector<int>>{std::move(loop)};
}

CellComplex::Split CellComplex::split_cell(int cell, int plane, int mark) {
  const CutPlane p = planes_[plane];
  Split split;
  const double off = p.normal.dot(cells_[cell].centre) - p.offset;
  split.side = off > 0 ? 1 : -1;
  if (std::abs(off) > cells_[cell].radius) return split;
  Sides sides;
  bool plus = false, minus = false;
  for (int f : cells_[cell].faces)
    for (int v : faces_[f].loop) {
      const auto [at, is_new] = sides.try_emplace(v, 0);
      if (is_new) at->second = side(v, p);
      plus |= at->second > 0;
      minus |= at->second < 0;
    }
  split.side = plus ? 1 : minus ? -1 : 0;
  if (!plus || !minus) return split;

  const std::vector<int> before = cells_[cell].faces;
  for (int f : before) {
    const std::vector<int> loop = faces_[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const int a = loop[k], b = loop[(k + 1) % loop.size()];
      // Vertices made by this cut lie on the plane by construction.
      if (sides.at(a) * sides.at(b) < 0) sides[split_edge(a, b, p)] = 0;
    }
  }
  for (int f : before) {
    std::vector<int> of_loop;
    for (int v : faces_[f].loop) of_loop.push_back(sides.at(v));
    int negative;
    split_loop(f, of_loop, negative);
  }
  std::vector<int> plus_faces, minus_faces;
  for (int f : cells_[cell].faces) {
    bool is_plus = false, is_minus = false;
    for (int v : faces_[f].loop) is_plus |= sides.at(v) > 0, is_minus |= sides.at(v) < 0;
    if (!is_plus && !is_minus) is_plus = bounds_plus(cell, f, p);
    (is_plus ? plus_faces : minus_faces).push_back(f);
  }
  auto loops = close(cell, plus_faces, sides, p);
  if (!loops || minus_faces.empty()) {
    split.side = 0;
    return split;  // a graze, thinner than the snapping distance
  }

  const int below = static_cast<int>(cells_.size());
  cells_.emplace_back();
  for (int f : minus_faces)
    for (int& c : faces_[f].cell)
      if (c == cell) c = below;
  for (auto& loop : *loops) {
    Face cap;
    cap.loop = std::move(loop);
    cap.cell[0] = cell;
    cap.cell[1] = below;
    cap.plane = plane;
    cap.mark = mark;
    faces_.push_back(std::move(cap));
    const int cap_id = static_cast<int>(faces_.size()) - 1;
    link(cap_id);
    plus_faces.push_back(cap_id);
    minus_faces.push_back(cap_id);
    split.caps.push_back(cap_id);
  }
  cells_[cell].faces = std::move(plus_faces);
  cells_[below].faces = std::move(minus_faces);
  bound(cell);
  bound(below);
  split.plus = separate(cell);
  split.minus = separate(below);
  return split;
}

void CellComplex::remove_cell(int cell) {
  cells_[cell].alive = false;
  for (int f : cells_[cell].faces) {
    Face& face = faces_[f];
    if (face.cell[1] == cell) {
      face.cell[1] = -1;
    } else {
      face.cell[0] = face.cell[1];
      face.cell[1] = -1;
      std::reverse(face.loop.begin(), face.loop.end());
    }
  }
  cells_[cell].faces.clear();
}

void CellComplex::hand_over(int cell, int to) {
  cells_[cell].alive = false;
  for (int f : cells_[cell].faces) {
    for (int& c : faces_[f].cell)
      if (c == cell) c = to;
    cells_[to].faces.push_back(f);
  }
  cells_[cell].faces.clear();
}

Vec3 CellComplex::area_vector(int face) const {
  const auto& loop = faces_[face].loop;
  Vec3 a = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < loop.size(); ++k)
    a += (x_[loop[k]] - x_[loop[0]]).cross(x_[loop[k + 1]] - x_[loop[0]]);
  return 0.5 * a;
}

double CellComplex::area(int face) const { return area_vector(face).norm(); }

Vec3 CellComplex::centroid(int face) const {
  const auto& loop = faces_[face].loop;
  const Vec3 n = area_vector(face).normalized();
  double total = 0;
  Vec3 c = Vec3::Zero(), mean = Vec3::Zero();
  for (int v : loop) mean += x_[v] / static_cast<double>(loop.size());
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    const Vec3 &p = x_[loop[0]], &q = x_[loop[k]], &r = x_[loop[k + 1]];
    const double a = (q - p).cross(r - p).dot(n);
    total += a;
    c += a * (p + q + r) / 3;
  }
  return total > 0 ? Vec3(c / total) : mean;
}

double CellComplex::volume(int cell) const {
  const Cell& c = cells_[cell];
  double six = 0;
  for (int f : c.faces) {
    const auto& loop = faces_[f].loop;
    double sum = 0;
    const Vec3 o = x_[loop[0]] - c.centre;
    for (std::size_t k = 1; k + 1 < loop.size(); ++k)
      sum += o.dot((x_[loop[k]] - c.centre).cross(x_[loop[k + 1]] - c.centre));
    six += faces_[f].cell[0] == cell ? sum : -sum;
  }
  return six / 6;
}

double CellComplex::surface(int cell) const {
  double sum = 0;
  for (int f : cells_[cell].faces) sum += area(f);
  return sum;
}

int CellComplex::neighbour_at_edge(int cell, int face, int a, int b) const {
  for (int f : edge_faces_.at(key(a, b)))
    if (f != face && (faces_[f].cell[0] == cell || faces_[f].cell[1] == cell)) return f;
  return -1;
}

}  // namespace talus::geometry
