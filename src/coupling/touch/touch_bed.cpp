#include "coupling/touch/touch_bed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "contact/skin/skin_bed.hpp"
#include "coupling/ground/craters.hpp"
#include "coupling/touch/touch_tilt.hpp"

namespace talus::coupling {
namespace {

using contact::Form;

constexpr double one_direction = 0.9;  // cosine between normals of faces that a block sinks into together
constexpr double aside =
    0.005;  // of the force along the skin's normal, across it, up to which it counts as none

/// Names a face by its nodes, which it keeps when others break out beside it; 58 bits.
std::uint64_t name_of(const TriangleSurface& skin, int first) {
  std::array<int, 4> node =
      skin.nodes[static_cast<std::size_t>(skin.triangles[static_cast<std::size_t>(first)][2])].node;
  std::sort(node.begin(), node.end());
  std::uint64_t name = 0;
  for (const int n : node) {  // splitmix64
    name += static_cast<std::uint64_t>(n) + 0x9e3779b97f4a7c15ULL;
    name = (name ^ (name >> 30)) * 0xbf58476d1ce4e5b9ULL;
    name = (name ^ (name >> 27)) * 0x94d049bb133111ebULL;
    name ^= name >> 31;
  }
  return name >> 6;
}

/// Marks the parts of a crushing bed along one normal where what the block's facets push aside does not
/// cancel: where a block ploughs its way, pressed on the side that it goes to and not on the one that lies in
/// its own crater. There the force acts along the facets: without it a motion along the skin would give
/// columns free for nothing, or press them. An elastic bed holds the same wherever on the skin the block
/// lies: its push aside is that of the lower facets alone, which one that leans over takes back.
void mark_sideways(std::span<contact::Footprint> parts) {
  thread_local std::vector<contact::Footprint*> left;
  left.clear();
  for (contact::Footprint& part : parts)
    if (!part.edge) left.push_back(&part);
  while (!left.empty()) {
    const Vec3 normal = left.front()->normal;
    const auto rest = std::stable_partition(left.begin(), left.end(), [&](const contact::Footprint* p) {
      return p->normal.dot(normal) < one_direction;
    });
    Vec3 push = Vec3::Zero();
    for (auto p = rest; p != left.end(); ++p)
      for (const contact::Column& c : (*p)->columns)
        for (const double s : c.spring) push += c.area * std::max(s, 0.0) * c.lift;
    const double along = normal.dot(push);
    if ((push - along * normal).norm() > aside * along)
      for (auto p = rest; p != left.end(); ++p) (*p)->edge = true;
    left.erase(rest, left.end());
  }
}

/// Where a part presses and which way; of what does not press yet by its area.
struct Resultant {
  Vec3 normal, point;  // the point: where its line of action meets the face
};

Resultant resultant(const contact::Footprint& part) {
  Vec3 lift = Vec3::Zero(), moment = Vec3::Zero();
  double depth = 0, force = 0;
  const auto sum =
      [&](const auto& pressure) {  // integrals of products of two functions that are linear over a triangle
        for (const contact::Column& c : part.columns) {
          double all = 0;
          for (const double s : c.spring) all += pressure(s);
          for (std::size_t k = 0; k < 3; ++k) {
            const double f = c.area / 12 * (all + pressure(c.spring[k]));
            depth += f * c.depth[k], moment += f * c.place[k];
          }
          force += c.area / 3 * all, lift += c.area / 3 * all * c.lift;
        }
      };
  sum([](double s) { return std::max(s, 0.0); });
  if (!(force > 0)) sum([](double) { return 1.0; });
  Resultant r{part.normal, moment / force};
  if (!part.edge) return r;
  r.normal = lift.normalized();
  const double up = r.normal.dot(part.normal);
  r.point += depth / force * (r.normal / up - part.normal);
  return r;
}

bool remembered_before(const ContactMemory& m, const std::pair<std::uint64_t, std::uint64_t>& key) {
  return m.partner != key.first ? m.partner < key.first : m.feature < key.second;
}

/// The memories of a partner whose features are `first` and the `count` - 1 after it.
std::span<const ContactMemory> recall(const std::vector<ContactMemory>& memory, std::uint64_t partner,
                                      std::uint64_t first, std::uint64_t count) {
  const auto from =
      std::lower_bound(memory.begin(), memory.end(), std::pair(partner, first), remembered_before);
  auto to = from;
  while (to != memory.end() && to->partner == partner && to->feature - first < count) ++to;
  return {from, to};
}

/// One face of the skin with all its parts.
struct FaceBed {
  std::span<contact::Footprint> parts;
  std::uint64_t rows, cells;  // first features of parts and craters
  double deepest = -std::numeric_limits<double>::infinity(), sunk = 0;
  double crushed = 0;   // an elastic bed's: it lies unloaded down to there [m]
  double unloaded = 0;  // a crushing bed's: depth that no step has known of, on which nothing is held [m]
  bool rested = false;  // and held nothing in the last step
  std::vector<Crater> craters{};
  double limit = 0;  // compression at which its columns crush [m]
};

FaceBed face_bed(const TriangleSurface& skin, std::span<contact::Footprint> parts, bool crushes) {
  const std::uint64_t name = name_of(skin, parts.front().triangle);
  FaceBed face{parts, contact::first_key(crushes ? Form::crushing_bed : Form::elastic_bed) | (name << 2),
               contact::first_key(Form::crater) | ((name << 2) & ~(craters_of_a_face - 1))};
  for (const contact::Footprint& part : parts) {
    face.deepest = std::max(face.deepest, part.deepest);
    for (const contact::Column& c : part.columns) face.sunk += c.mean() > 0 ? c.area : 0.0;
  }
  return face;
}

/// The deepest that the pair's faces were pressed in the last step [m].
double pressed_before(const std::vector<ContactMemory>& memory, std::uint64_t partner) {
  double deepest = 0;
  for (auto m = std::lower_bound(memory.begin(), memory.end(), std::pair(partner, std::uint64_t{0}),
                                 remembered_before);
       m != memory.end() && m->partner == partner; ++m)
    if (!is_crater(*m) && m->feature != born_inside) deepest = std::max(deepest, m->indentation + m->offset);
  return deepest;
}

/// Of the craters of a face that are known [m].
double deepest_floor(const std::vector<ContactMemory>& memory, std::uint64_t partner, const FaceBed& face) {
  double deepest = 0;
  for (const ContactMemory& m : recall(memory, partner, face.cells, craters_of_a_face))
    deepest = std::max(deepest, m.crushed);
  return deepest;
}

/// The face's columns are deep by so much less.
void lie_unloaded(FaceBed& face, double by) {
  face.unloaded = by;
  face.deepest -= by;
  for (contact::Footprint& part : face.parts) {
    part.deepest -= by;
    for (contact::Column& c : part.columns)
      for (std::size_t k = 0; k < 3; ++k) c.depth[k] -= by, c.spring[k] -= by;
  }
}

/// How far the columns may be compressed by what the pair remembers of the face. A new one deep inside is
/// found late if it is more than the block can have covered in a step, or deeper than it can have come: a
/// face that a cell below it bared when it broke out. `reach`: way of the block in a step; `pressed`: how
/// deep others were before it; `limit`: compression at which columns crush.
void set_floor(FaceBed& face, const std::vector<ContactMemory>& memory, std::uint64_t partner, double reach,
               double pressed, double edge, bool crushes, double limit) {
  const auto rows = recall(memory, partner, face.rows, 4),
             cells = recall(memory, partner, face.cells, craters_of_a_face);
  const bool late = rows.empty() && cells.empty() && face.deepest > reach &&
                    (face.sunk > 2 * reach * edge || face.deepest > pressed + 2 * reach);
  if (!crushes) {
    if (late) face.crushed = face.deepest;
    double known = 0;
    for (const ContactMemory& m : rows)
      face.crushed = std::max(face.crushed, m.crushed), known = std::max(known, m.indentation);
    if (!rows.empty())
      face.crushed +=
          std::max(0.0, face.deepest - known -
                            2 * reach);  // columns that were not there, as deep as no motion brings them
    face.rested = face.crushed > 0 && std::none_of(rows.begin(), rows.end(), [](const ContactMemory& m) {
                    return m.normal_energy > 0;
                  });
    if (face.crushed > 0)
      for (contact::Footprint& part : face.parts) compress_at_most(part, face.deepest - face.crushed);
    return;
  }
  for (const ContactMemory& m : rows) face.unloaded = std::max(face.unloaded, m.offset);
  lie_unloaded(face, std::min(face.unloaded, std::max(0.0, face.deepest)));
  face.craters = crush(face.parts, face.cells, cells, limit, late,
                       rows.empty() ? reach : std::numeric_limits<double>::infinity());
}

/// The touch of one part of a face as it would be if it were new.
Touch part_touch(const TriangleSurface& skin, const CandidatePair& pair, const ContactLaw& law,
                 const FaceBed& face, const contact::Footprint& part, double limit) {
  Touch t;
  t.a = pair.a;
  t.b = pair.b;
  t.law = &law;
  t.at.key = face.rows | static_cast<std::uint64_t>(part.sector);
  double sunk = 0, all = 0;
  for (const contact::Column& c : part.columns) {
    all += c.area;
    if (c.mean() > 0) sunk += c.area;
  }
  const Resultant r = resultant(part);
  t.at.normal = r.normal;
  t.at.point_a = r.point;
  t.normal_law.law = &law;
  t.normal_law.bed =
      std::make_shared<const contact::Bed>(part.columns, r.normal, part.deepest, law.normal_stiffness, limit,
                                           face.deepest, face.crushed, face.rested);
  t.at.gap = -part.deepest;
  t.at.area = sunk > 0 ? sunk : all;
  t.stiffness = t.normal_law.stiffness = law.normal_stiffness * t.at.area;
  t.normal_law.limit = law.crushing_pressure * t.at.area;
  t.crushed = law.crushing_pressure * part.crushed;
  t.shear_stiffness = law.shear_stiffness * t.at.area;
  t.at.face_a = contact::triangle_of_face(skin, part.triangle, t.at.point_a);
  t.offset = face.unloaded;
  t.at.point_b = t.at.point_a + (t.at.gap - t.offset) * t.at.normal;
  return t;
}

void go_on_from(const ContactMemory& last, Touch& t) {
  t.warm = last.force;
  t.shear = last.shear - t.at.normal * t.at.normal.dot(last.shear);
  if (last.stiffness < t.stiffness)
    t.shear *= last.stiffness / t.stiffness;  // columns that join are not sheared
  t.stored = last.normal_energy + last.shear_energy;
  t.sheared = last.shear_energy;
  t.lasted = last.lasted;
  if (booked_by_craters(t)) t.crushed_ahead = last.crushed;
  t.broken = last.broken;
  t.persistent = !last.force.isZero(0);
}

/// The same part on four points.
void stand_on_points(const TriangleSurface& skin, const Touch& whole, const contact::Footprint& part,
                     const FaceBed& face, double limit, std::vector<Touch>& out) {
  Touch point = whole;
  point.normal_law.bed = std::make_shared<const contact::Bed>(part.columns, whole.at.normal, part.deepest,
                                                              0.25 * whole.law->normal_stiffness, limit,
                                                              face.deepest, face.crushed, face.rested);
  for (double* shared :
       {&point.at.area, &point.stiffness, &point.normal_law.stiffness, &point.normal_law.limit,
        &point.shear_stiffness, &point.stored, &point.sheared, &point.crushed, &point.crushed_ahead})
    *shared *= 0.25;
  point.warm *= 0.25;
  point.of_part = 0.25;
  bool first = true;
  for (const Vec3& offset : tilt_points(part, whole.at.point_a, whole.at.normal, limit)) {
    point.at.point_a = whole.at.point_a + offset;
    point.at.face_a = contact::triangle_of_face(skin, part.triangle, point.at.point_a);
    point.at.point_a = whole.at.point_a + offset;  // also beside the face
    point.at.point_b = whole.at.point_b + offset;
    out.push_back(point);
    if (std::exchange(first, false)) point.craters.clear();
  }
}

}  // namespace

bool is_bed(const ContactLaw& law) {
  return law.stiffness == ContactLaw::Stiffness::per_area && !law.curved();
}

bool is_crater(const ContactMemory& m) { return contact::form_of(m.feature) == Form::crater; }

void keep_craters(std::span<const Touch* const> touches, int block, std::vector<ContactMemory>& list) {
  std::vector<ContactMemory> fresh;
  for (const Touch* t : touches) {
    if (t->b != block) continue;
    for (const Crater& crater : t->craters) {
      ContactMemory& memory = fresh.emplace_back();
      memory.partner = t->a.id();
      memory.feature = crater.feature;
      memory.place = crater.floor;
      memory.crushed = crater.depth;
    }
  }
  const auto of_a_cell = [](const ContactMemory& m) { return std::pair(m.partner, m.feature >> 16); };
  const auto in_order = [&](const ContactMemory& x, const ContactMemory& y) {
    return of_a_cell(x) < of_a_cell(y);
  };
  std::sort(fresh.begin(), fresh.end(), in_order);
  std::erase_if(list, [&](const ContactMemory& m) {
    return is_crater(m) && std::binary_search(fresh.begin(), fresh.end(), m, in_order);
  });
  list.insert(list.end(), fresh.begin(), fresh.end());
}

void add_point(const ContactMemory& point, ContactMemory& part) {
  const bool crushes = contact::form_of(point.feature) == Form::crushing_bed;  // an energy
  part.force += point.force;
  const double stiffness = part.stiffness + point.stiffness;
  if (stiffness > 0) part.shear += point.stiffness / stiffness * (point.shear - part.shear);
  part.stiffness = stiffness;
  part.normal_energy += point.normal_energy;
  part.end_energy += point.end_energy;
  part.shear_energy += point.shear_energy;
  part.crushed = crushes ? part.crushed + point.crushed : std::max(part.crushed, point.crushed);
  part.indentation = std::max(part.indentation, point.indentation);
  part.offset = std::max(part.offset, point.offset);
  part.broken = part.broken && point.broken;
}

void find_bed(const TriangleSurface& skin, const contact::SurfaceIndex& index, const CandidatePair& pair,
              const ContactLaw& law, const Polyhedron& shape, const Pose& pose, double margin,
              const std::vector<ContactMemory>& memory, const Tilts& tilts, std::vector<Touch>& out) {
  thread_local std::vector<contact::Footprint> parts;
  parts.clear();
  const bool crushes = law.crushes();
  const double limit =
      crushes ? law.crushing_pressure / law.normal_stiffness : std::numeric_limits<double>::infinity();
  contact::skin_bed(index, shape, pose, margin, limit, parts);
  thread_local std::vector<FaceBed> faces;
  faces.clear();
  const double pressed = pressed_before(memory, pair.a.id());
  for (std::size_t i = 0, last; i < parts.size(); i = last) {
    last = i + 1;
    while (last < parts.size() && parts[last].triangle == parts[i].triangle) ++last;
    FaceBed& face = faces.emplace_back(face_bed(skin, std::span(parts).subspan(i, last - i), crushes));
    // Crushed through, a face goes on as an elastic bed on the floor that it has.
    face.limit =
        crushes && law.yield_thickness > 0 && deepest_floor(memory, pair.a.id(), face) >= law.yield_thickness
            ? std::numeric_limits<double>::infinity()
            : limit;
    set_floor(face, memory, pair.a.id(), margin, pressed, face_edge(skin, parts[i].triangle), crushes,
              face.limit);
  }
  if (crushes) mark_sideways(parts);
  for (FaceBed& face : faces)
    for (const contact::Footprint& part : face.parts) {
      Touch t = part_touch(skin, pair, law, face, part, face.limit);
      const auto past = recall(memory, pair.a.id(), t.at.key, 1);
      if (!past.empty()) go_on_from(past.front(), t);
      if (&part == &face.parts.front()) t.craters = face.craters;
      if (part.deepest > 0 && tilts && tilts(t))
        stand_on_points(skin, t, part, face, face.limit, out);
      else
        out.push_back(std::move(t));
    }
}

}  // namespace talus::coupling
