#include "geometry/cut.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "geometry/cut_internal.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/mesh.hpp"
#include "geometry/random.hpp"

namespace talus::geometry {

using std::numbers::pi;

Vec3 joint_normal(double dip_direction, double dip) {
  return {std::sin(dip_direction) * std::sin(dip), std::cos(dip_direction) * std::sin(dip), std::cos(dip)};
}

std::vector<Problem> cut_problems(const CutSpec& spec) {
  std::vector<Problem> out;
  const auto error = [&](const std::string& key, const std::string& value, const std::string& rule,
                         const std::string& remedy) {
    out.push_back({.key = key, .value = value, .rule = rule, .remedy = remedy});
  };
  const auto orientation = [&](const std::string& key, double dip_direction, double dip) {
    if (!(dip >= 0) || dip > pi / 2 * (1 + 1e-12))
      error(key + ".orientation", fmt::format("dip {:.6g} deg", dip * 180 / pi),
            "dip must lie between 0 and 90 degrees",
            "an overhanging plane of dip 90 + x is one of dip 90 - x and the opposite dip direction");
    if (!(dip_direction >= -2 * pi) || dip_direction > 4 * pi)
      error(key + ".orientation", fmt::format("dip direction {:.6g} deg", dip_direction * 180 / pi),
            "dip direction must lie between 0 and 360 degrees", "give it clockwise from north (+y)");
  };
  const auto number = [&](const std::string& key, double x, bool good, const std::string& rule,
                          const std::string& remedy) {
    if (!good) error(key, fmt::format("{}", x), rule, remedy);
  };
  if (spec.region.empty() && !spec.box && !spec.mass)
    error("rock_mass", "", "needs a region", "give region = \"mass.obj\" or box = { min, max }");
  if (!spec.region.empty() && spec.box)
    error("rock_mass.box", "", "stands beside region", "give one of the two");
  if (spec.box && !(spec.box->sizes().minCoeff() > 0))
    error("rock_mass.box", "", "min must be below max in x, y and z", "correct the box");
  number("rock_mass.least_volume", spec.least_volume,
         spec.least_volume >= 0 && std::isfinite(spec.least_volume), "must not be negative", "give m^3");
  for (const CutJointSet& s : spec.joint_sets) {
    const std::string key = "rock_mass.joint_set." + s.name;
    orientation(key, s.dip_direction, s.dip);
    number(key + ".spacing", s.spacing, s.spacing > 0 && std::isfinite(s.spacing), "must be positive",
           "give metres along the normal");
    number(key + ".persistence", s.persistence, s.persistence > 0 && s.persistence <= 1, "must lie in (0, 1]",
           "1: every block across a joint is cut");
    number(key + ".fisher", s.fisher, s.fisher >= 0 && std::isfinite(s.fisher), "must not be negative",
           "0: no scatter; large: little");
    number(key + ".spacing_deviation", s.spacing_deviation,
           s.spacing_deviation >= 0 && std::isfinite(s.spacing_deviation), "must not be negative",
           "give metres");
    number(key + ".bond_tension", s.bond_tension, s.bond_tension >= 0, "must not be negative", "give Pa");
    number(key + ".bond_shear", s.bond_shear, s.bond_shear >= 0, "must not be negative", "give Pa");
    if (s.spacing_distribution != "constant" && s.spacing_distribution != "exponential" &&
        s.spacing_distribution != "normal" && s.spacing_distribution != "lognormal")
      error(key + ".spacing_distribution", s.spacing_distribution, "is not a known distribution",
            "use constant, exponential, normal or lognormal");
  }
  for (const CutJoint& j : spec.joints) {
    const std::string key = "rock_mass.joint." + j.name;
    orientation(key, j.dip_direction, j.dip);
    number(key + ".radius", j.radius, j.radius >= 0 && std::isfinite(j.radius), "must not be negative",
           "0: unbounded");
    if (!j.polygon.empty() && j.radius > 0)
      error(key + ".polygon", "", "stands beside radius", "give one of the two");
    if (!j.polygon.empty() && j.polygon.size() < 3)
      error(key + ".polygon", fmt::format("{} points", j.polygon.size()), "needs three points or more",
            "add points");
    if (!j.through.allFinite()) error(key + ".through", "", "must be finite", "give [x, y, z]");
  }
  for (std::size_t a = 0; a < spec.joint_sets.size(); ++a)
    for (std::size_t b = a + 1; b < spec.joint_sets.size(); ++b) {
      const auto &p = spec.joint_sets[a], &q = spec.joint_sets[b];
      const double sine =
          joint_normal(p.dip_direction, p.dip).cross(joint_normal(q.dip_direction, q.dip)).norm();
      if (sine < std::sin(10 * pi / 180) && spec.least_volume == 0)
        out.push_back(
            {.severity = Problem::Severity::warning,
             .key = "rock_mass.joint_set." + q.name,
             .value = fmt::format("{:.2f} deg from {}", std::asin(std::min(1.0, sine)) * 180 / pi, p.name),
             .rule = "sets that are nearly parallel cut slivers",
             .remedy = "set rock_mass.least_volume to merge them"});
    }
  return out;
}

namespace {

/// Blocks that sets of endless joints cut from a large volume: one per corner, and each three planes make
/// one.
double expected_blocks(const std::vector<CutJointSet>& sets, double volume) {
  double density = 0;
  for (std::size_t a = 0; a < sets.size(); ++a)
    for (std::size_t b = a + 1; b < sets.size(); ++b)
      for (std::size_t c = b + 1; c < sets.size(); ++c) {
        const auto normal = [&](std::size_t k) { return joint_normal(sets[k].dip_direction, sets[k].dip); };
        density += std::abs(normal(a).dot(normal(b).cross(normal(c)))) /
                   (sets[a].spacing * sets[b].spacing * sets[c].spacing);
      }
  return density * volume;
}

/// From the first to the last of the points along a unit vector [m].
double extent_along(const std::vector<Vec3>& points, const Vec3& direction) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Vec3& p : points)
    least = std::min(least, direction.dot(p)), most = std::max(most, direction.dot(p));
  return most - least;
}

}  // namespace

namespace cutting {

std::vector<JointPlane> set_planes(const CutJointSet& set, int joint, const Box3& region,
                                   const std::vector<Vec3>& corners) {
  const Vec3 mean = joint_normal(set.dip_direction, set.dip), o = set.origin.value_or(region.center());
  double lo = 1e300, hi = -1e300;
  for (const Vec3& c : corners) lo = std::min(lo, mean.dot(c - o)), hi = std::max(hi, mean.dot(c - o));
  if (set.fisher > 0) {  // tilted planes reach the region from further off
    const double reach = region.diagonal().norm() * std::min(1.0, 3 / std::sqrt(set.fisher));
    lo -= reach, hi += reach;
  }
  if ((hi - lo) / set.spacing > 200000)
    throw InputError(
        Problem{.key = "rock_mass.joint_set." + set.name + ".spacing",
                .value = fmt::format("{}", set.spacing),
                .rule = fmt::format("gives {:.0f} planes in the region", (hi - lo) / set.spacing),
                .remedy = "enlarge the spacing"});
  Random random(set.seed * 1000003ull + static_cast<unsigned>(joint));
  const auto step = [&] {
    const double s = set.spacing, d = set.spacing_deviation;
    double x = s;
    if (set.spacing_distribution == "exponential") x = s * random.exponential();
    if (set.spacing_distribution == "normal") x = s + d * random.normal();
    if (set.spacing_distribution == "lognormal" && d > 0) {
      const double v = std::log(1 + d * d / (s * s));
      x = std::exp(std::log(s) - v / 2 + std::sqrt(v) * random.normal());
    }
    return std::max(x, 1e-3 * s);
  };
  std::vector<double> at;
  if (set.spacing_distribution == "constant") {
    // k times the spacing, not a sum: planes far from the origin lie where they should.
    for (double k = std::ceil(lo / set.spacing); k * set.spacing <= hi; ++k) at.push_back(k * set.spacing);
  } else {
    for (double t = 0; t <= hi; t += step()) at.push_back(t);
    for (double t = -step(); t >= lo; t -= step()) at.push_back(t);
    std::sort(at.begin(), at.end());
  }
  std::vector<JointPlane> planes;
  for (const double t : at) {
    const Vec3 n = set.fisher > 0 ? random.fisher(mean, set.fisher) : mean;
    planes.push_back({n, n.dot(o + t * mean), joint});
  }
  return planes;
}

std::vector<Vec3> joint_polygon(const CutJoint& joint, const Vec3& n) {
  std::vector<Vec3> polygon;
  if (joint.radius > 0) {
    const int corners = 32;
    const double r =
        joint.radius * std::sqrt(2 * pi / (corners * std::sin(2 * pi / corners)));  // the disc's area
    const Vec3 u = n.unitOrthogonal(), w = n.cross(u);
    for (int k = 0; k < corners; ++k) {
      const double a = 2 * pi * k / corners;
      polygon.push_back(joint.through + r * (std::cos(a) * u + std::sin(a) * w));
    }
    return polygon;
  }
  Vec3 area = Vec3::Zero();
  for (const Vec3& p : joint.polygon) polygon.push_back(p - n * n.dot(p - joint.through));
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    area += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]);
  if (area.dot(n) < 0) std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

namespace {

bool on_plane(const CellComplex& complex, const CellComplex::Face& f, const Vec3& n, double d) {
  return std::all_of(f.loop.begin(), f.loop.end(),
                     [&](int v) { return std::abs(n.dot(complex.vertices()[v]) - d) <= complex.snap(); });
}

/// Area of the polygon within a convex loop in the same plane (the loop counter-clockwise about n).
double overlap_area(std::vector<Vec3> polygon, const std::vector<Vec3>& loop, const Vec3& n) {
  for (std::size_t k = 0; k < loop.size() && polygon.size() >= 3; ++k) {
    const Vec3 inward = n.cross(loop[(k + 1) % loop.size()] - loop[k]);
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double sa = inward.dot(a - loop[k]), sb = inward.dot(b - loop[k]);
      if (sa >= 0) kept.push_back(a);
      if ((sa > 0 && sb < 0) || (sa < 0 && sb > 0)) kept.push_back(a + sa / (sa - sb) * (b - a));
    }
    polygon = std::move(kept);
  }
  Vec3 area = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    area += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]);
  return 0.5 * area.dot(n);
}

/// Section of a convex cell by a plane, counter-clockwise about its normal; empty if it is missed.
std::vector<Vec3> section(const CellComplex& complex, int cell, const Vec3& n, double d) {
  std::vector<Vec3> points;
  // Faces that share an edge give its point alike but for rounding; two of them would make a side of no
  // direction.
  const auto add = [&](const Vec3& x) {
    if (std::none_of(points.begin(), points.end(),
                     [&](const Vec3& p) { return (p - x).norm() <= complex.snap(); }))
      points.push_back(x);
  };
  for (int f : complex.cells()[cell].faces) {
    const auto& loop = complex.faces()[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec3 &a = complex.vertices()[loop[k]], &b = complex.vertices()[loop[(k + 1) % loop.size()]];
      const double sa = n.dot(a) - d, sb = n.dot(b) - d;
      if (sa * sb <= 0 && sa != sb) add(a + sa / (sa - sb) * (b - a));
    }
  }
  if (points.size() < 3) return {};
  // Convex hull in the plane (monotone chain).
  const Vec3 u = n.unitOrthogonal(), w = n.cross(u);
  struct P {
    double x, y;
    Vec3 p;
  };
  std::vector<P> q, hull;
  for (const Vec3& p : points) q.push_back({u.dot(p), w.dot(p), p});
  std::sort(q.begin(), q.end(), [](const P& a, const P& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  const auto turn = [](const P& a, const P& b, const P& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const P& p : q) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(q.begin(), q.end());
  }
  std::vector<Vec3> out;
  for (const P& p : hull) out.push_back(p.p);
  return out;
}

bool convex_polygon(const std::vector<Vec3>& p, const Vec3& n) {
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Vec3 &a = p[k], &b = p[(k + 1) % p.size()], &c = p[(k + 2) % p.size()];
    if ((b - a).cross(c - b).dot(n) < 0) return false;
  }
  return true;
}

bool inside_polygon(const std::vector<Vec3>& polygon, const Vec3& n, const Vec3& x) {
  const Vec3 u = n.unitOrthogonal(), w = n.cross(u);
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const double ax = u.dot(polygon[i] - x), ay = w.dot(polygon[i] - x), bx = u.dot(polygon[j] - x),
                 by = w.dot(polygon[j] - x);
    if ((ay > 0) != (by > 0) && 0 < ax - ay * (bx - ax) / (by - ay)) inside = !inside;
  }
  return inside;
}

/// Divides a face in the plane of a joint into the parts within and beyond its border, and marks them.
void mark_parts(CellComplex& complex, int face, const Vec3& n, const std::vector<Vec3>& polygon,
                int open_mark, int bridge_mark) {
  const bool convex = convex_polygon(polygon, n);
  std::vector<int> parts{face};
  for (std::size_t k = 0; k < polygon.size() && !parts.empty(); ++k) {
    const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const Vec3 inward = n.cross(b - a).normalized();
    const CellComplex::CutPlane line{inward, inward.dot(a)};
    const std::size_t count = parts.size();
    std::vector<int> inner;
    for (std::size_t i = 0; i < count; ++i) {
      const int beyond = complex.split_face(parts[i], line);
      if (!convex) {
        inner.push_back(parts[i]);
        if (beyond >= 0) inner.push_back(beyond);
        continue;
      }
      if (beyond >= 0) {
        complex.faces()[beyond].mark = bridge_mark;
        inner.push_back(parts[i]);
      } else if (inward.dot(complex.centroid(parts[i])) >= line.offset) {
        inner.push_back(parts[i]);
      } else {
        complex.faces()[parts[i]].mark = bridge_mark;
      }
    }
    parts = std::move(inner);
  }
  for (int f : parts)
    complex.faces()[f].mark =
        convex || inside_polygon(polygon, n, complex.centroid(f)) ? open_mark : bridge_mark;
}

}  // namespace

void cut_with_plane(CellComplex& complex, std::vector<Mark>& marks, const JointPlane& plane, int open_mark,
                    int mark) {
  // Rock that lies on both sides of this very plane already (a division, a bridge) is opened.
  for (auto& f : complex.faces())
    if (f.cell[1] >= 0 && (marks[f.mark].intact || marks[f.mark].bonded) &&
        on_plane(complex, f, plane.normal, plane.offset))
      f.mark = open_mark;
  const int id = complex.add_plane(plane.normal, plane.offset);
  const int cells = static_cast<int>(complex.cells().size());
  for (int c = 0; c < cells; ++c) {
    const auto& cell = complex.cells()[c];
    if (cell.alive && std::abs(plane.normal.dot(cell.centre) - plane.offset) <= cell.radius)
      complex.split_cell(c, id, mark);
  }
}

void cut_with_polygon(CellComplex& complex, std::vector<Mark>& marks, const JointPlane& plane,
                      const std::vector<Vec3>& polygon, int open_mark, int bridge_mark) {
  Box3 box;
  for (const Vec3& p : polygon) box.extend(p);
  const double least = complex.snap() * box.diagonal().norm();
  const auto loop_points = [&](int f) {
    std::vector<Vec3> p;
    for (int v : complex.faces()[f].loop) p.push_back(complex.vertices()[v]);
    if (complex.area_vector(f).dot(plane.normal) < 0) std::reverse(p.begin(), p.end());
    return p;
  };
  const int faces = static_cast<int>(complex.faces().size());
  for (int f = 0; f < faces; ++f) {
    const auto& face = complex.faces()[f];
    if (face.cell[1] >= 0 && (marks[face.mark].intact || marks[face.mark].bonded) &&
        on_plane(complex, face, plane.normal, plane.offset) &&
        overlap_area(polygon, loop_points(f), plane.normal) > least)
      mark_parts(complex, f, plane.normal, polygon, open_mark, face.mark);
  }
  const int id = complex.add_plane(plane.normal, plane.offset);
  const int cells = static_cast<int>(complex.cells().size());
  for (int c = 0; c < cells; ++c) {
    const auto& cell = complex.cells()[c];
    if (!cell.alive || std::abs(plane.normal.dot(cell.centre) - plane.offset) > cell.radius ||
        box.exteriorDistance(cell.centre) > cell.radius)
      continue;
    const auto cross = section(complex, c, plane.normal, plane.offset);
    if (cross.size() < 3 || overlap_area(polygon, cross, plane.normal) <= least) continue;
    const std::vector<int> caps = complex.split_cell(c, id, open_mark).caps;
    double within = 0;  // of a cell that is not convex the section is less than its hull
    for (const int cap : caps) within += overlap_area(polygon, loop_points(cap), plane.normal);
    for (const int cap : caps)
      if (within > least)
        mark_parts(complex, cap, plane.normal, polygon, open_mark, bridge_mark);
      else
        complex.faces()[cap].mark = mark_division;
  }
}

}  // namespace cutting

Mesh region_mesh(const std::string& file, const std::optional<Box3>& box) {
  if (!box) return read_closed_mesh(file);
  std::vector<Vec3> p;
  for (int i = 0; i < 8; ++i)
    p.emplace_back(i & 1 ? box->max().x() : box->min().x(), i & 2 ? box->max().y() : box->min().y(),
                   i & 4 ? box->max().z() : box->min().z());
  return convex_hull(p);
}

CutResult cut(const CutSpec& spec) {
  using namespace cutting;
  CutResult result;
  std::vector<Problem> problems = cut_problems(spec);
  if (std::any_of(problems.begin(), problems.end(),
                  [](const Problem& p) { return p.severity == Problem::Severity::error; }))
    throw InputError(std::move(problems));
  result.warnings = std::move(problems);

  std::unique_ptr<CellComplex> cells;
  if (spec.mass) {
    cells = spec.mass->clone();
  } else {
    const Mesh mesh = region_mesh(spec.region, spec.box);
    const Polyhedron region = make_polyhedron(mesh.vertices, mesh.triangles);
    const double snap = 1e-10 * bounding_box(region).diagonal().norm();
    cells = region.convex ? std::make_unique<CellComplex>(snap) : exact_complex(snap);
    add_region(*cells, region);
  }
  CellComplex& complex = *cells;
  Box3 box;
  std::vector<Vec3> corners;
  for (std::size_t c = 0; c < complex.cells().size(); ++c) {
    if (!complex.cells()[c].alive) continue;
    result.region_volume += complex.volume(static_cast<int>(c));
    for (const int f : complex.cells()[c].faces)
      for (const int v : complex.faces()[f].loop) corners.push_back(complex.vertices()[v]);
  }
  for (const Vec3& x : corners) box.extend(x);
  if (const double blocks = expected_blocks(spec.joint_sets, result.region_volume);
      blocks > 2 * static_cast<double>(spec.most_blocks)) {
    std::string names;
    for (const CutJointSet& s : spec.joint_sets)
      names += (names.empty() ? "" : ", ") + fmt::format("{} {:g} m", s.name, s.spacing);
    throw InputError(Problem{
        .key = "rock_mass.joint_set",
        .value = "spacing " + names,
        .rule = fmt::format("would cut about {:.2g} blocks; at most {} are cut", blocks, spec.most_blocks),
        .remedy = "enlarge the spacing or shrink the region"});
  }
  std::vector<Mark> marks(2);
  marks[mark_division].intact = true;
  const auto new_mark = [&](const Mark& m) {
    marks.push_back(m);
    return static_cast<int>(marks.size()) - 1;
  };
  const auto check_size = [&](const std::string& name) {
    if (complex.cells().size() > 2 * spec.most_blocks)
      throw InputError(Problem{.key = "rock_mass." + name,
                               .value = fmt::format("{}", complex.cells().size()),
                               .rule = fmt::format("more than {} blocks", spec.most_blocks),
                               .remedy = "enlarge the spacing or shrink the region"});
  };
  const auto report = [&](const std::string& what) {
    if (spec.report)
      spec.report(fmt::format("progress: rock mass: {} parts; {}", complex.cells().size(), what));
  };
  const auto warn = [&](const std::string& key, std::string value, std::string rule, std::string remedy) {
    result.warnings.push_back({.severity = Problem::Severity::warning,
                               .key = "rock_mass." + key,
                               .value = std::move(value),
                               .rule = std::move(rule),
                               .remedy = std::move(remedy)});
  };
  const auto separates = [&](std::size_t cells_before) { return complex.cells().size() > cells_before; };
  const std::string useless = "separates no blocks of the region";
  const int sets = static_cast<int>(spec.joint_sets.size());
  std::vector<std::pair<int, int>> set_marks;  // of open faces and of rock bridges
  for (int k = 0; k < sets; ++k) {
    const std::size_t cells_before = complex.cells().size();
    const CutJointSet& set = spec.joint_sets[k];
    result.joint_names.push_back(set.name);
    report("cutting by joint set " + set.name);
    const int open = new_mark({.joint = k});
    const bool bonds = set.bond_tension > 0 || set.bond_shear > 0;
    const int bridge = set.persistence < 1 ? new_mark({.joint = k,
                                                       .intact = !bonds,
                                                       .bonded = bonds,
                                                       .tension = set.bond_tension,
                                                       .shear = set.bond_shear})
                                           : open;
    set_marks.emplace_back(open, bridge);
    for (const JointPlane& plane : set_planes(set, k, box, corners)) {
      cut_with_plane(complex, marks, plane, open, bridge);
      result.planes.push_back({plane.normal, plane.offset, k});
      check_size("joint_set." + set.name);
    }
    if (const double width = extent_along(corners, joint_normal(set.dip_direction, set.dip));
        !separates(cells_before))
      warn("joint_set." + set.name, {}, useless, "check its origin and spacing against the region's size");
    else if (set.spacing > width)
      warn("joint_set." + set.name + ".spacing", fmt::format("{:.4g} m", set.spacing),
           fmt::format("is more than the region spans across these joints, {:.3g} m", width),
           "check its unit: a bare number is in m; a single joint is a [[rock_mass.joint]]");
  }
  for (int j = 0; j < static_cast<int>(spec.joints.size()); ++j) {
    const CutJoint& joint = spec.joints[j];
    const std::size_t cells_before = complex.cells().size();
    result.joint_names.push_back(joint.name);
    report("cutting by joint " + joint.name);
    const Vec3 n = joint_normal(joint.dip_direction, joint.dip);
    const JointPlane plane{n, n.dot(joint.through), sets + j};
    result.planes.push_back({plane.normal, plane.offset, plane.joint});
    const int open = new_mark({.joint = sets + j});
    if (joint.radius <= 0 && joint.polygon.empty()) {
      cut_with_plane(complex, marks, plane, open, open);
    } else {
      const bool bonds = joint.bond_tension > 0 || joint.bond_shear > 0;
      const int bridge = new_mark({.joint = sets + j,
                                   .intact = !bonds,
                                   .bonded = bonds,
                                   .tension = joint.bond_tension,
                                   .shear = joint.bond_shear});
      cut_with_polygon(complex, marks, plane, joint_polygon(joint, n), open, bridge);
    }
    check_size("joint." + joint.name);
    if (!separates(cells_before))
      warn("joint." + joint.name, {}, useless, "check through, and radius or polygon, against the region");
  }
  // Once all joints have cut: a set that is listed first would be drawn by whole planes.
  for (int k = 0; k < sets; ++k) {
    const auto [open, bridge] = set_marks[k];
    if (bridge == open) continue;
    Random random(spec.joint_sets[k].seed * 7919ull + 104729ull * static_cast<unsigned>(k + 1));
    for (auto& f : complex.faces())
      if (f.cell[1] >= 0 && f.mark == bridge && random.uniform() < spec.joint_sets[k].persistence)
        f.mark = open;
  }
  report("making blocks");
  make_blocks(complex, marks, spec.least_volume, result);
  if (spec.least_volume == 0) {
    constexpr double tiny = 1e-4;  // of the mean volume: 1/20 of the mean size
    const double mean =
        result.region_volume / static_cast<double>(std::max<std::size_t>(1, result.blocks.size()));
    double least = mean;
    std::size_t count = 0;
    for (const CutBlock& b : result.blocks) {
      least = std::min(least, b.volume);
      count += b.volume < tiny * mean ? 1 : 0;
    }
    if (count > 0)
      result.warnings.push_back(
          {.severity = Problem::Severity::warning,
           .key = "rock_mass.least_volume",
           .value = "0 m^3",
           .rule =
               fmt::format("{} of {} blocks have less than {:g} of the mean volume, {:.3g} m^3 the least: "
                           "contacts of slivers among blocks take long",
                           count, result.blocks.size(), tiny, least),
           .remedy = fmt::format("let them join a neighbour, for example least_volume = \"{:.1g} m^3\"",
                                 0.01 * mean)});
  }
  return result;
}

}  // namespace talus::geometry
