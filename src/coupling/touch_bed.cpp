#include "coupling/touch_bed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "contact/skin_bed.hpp"

namespace talus::coupling {
namespace {

constexpr std::uint64_t elastic_kind = 9, crushing_kind = 10;   // in the upper bits of the key
constexpr double late = 1.5;   // times as compressed as the pair was: what a face may have that has just been reached

std::uint64_t face_of(std::uint64_t feature) { return feature >> 2; }
bool of_bed(const ContactMemory& m) { return m.feature >> 60 == elastic_kind || m.feature >> 60 == crushing_kind; }

/// Names a face by its nodes, which it keeps when others break out beside it; 58 bits.
std::uint64_t name_of(const TriangleSurface& skin, int first) {
  std::array<int, 4> node = skin.nodes[static_cast<std::size_t>(skin.triangles[static_cast<std::size_t>(first)][2])].node;
  std::sort(node.begin(), node.end());
  std::uint64_t name = 0;
  for (const int n : node) {   // splitmix64
    name += static_cast<std::uint64_t>(n) + 0x9e3779b97f4a7c15ULL;
    name = (name ^ (name >> 30)) * 0xbf58476d1ce4e5b9ULL;
    name = (name ^ (name >> 27)) * 0x94d049bb133111ebULL;
    name ^= name >> 31;
  }
  return name >> 6;
}

/// Where a part presses and which way; of what does not press yet by its area.
struct Resultant {
  Vec3 normal, point;   // the point: where its line of action meets the face
};

Resultant resultant(const contact::Footprint& part, double most, double limit) {
  Vec3 lift = Vec3::Zero(), moment = Vec3::Zero();
  double depth = 0, force = 0;
  const auto sum = [&](const auto& pressure) {
    for (const contact::Column& c : part.columns) {
      const double f = c.area * pressure(c);
      force += f, depth += f * c.depth, moment += f * c.place, lift += f * c.lift;
    }
  };
  sum([&](const contact::Column& c) { return std::clamp(std::min(c.depth, most), 0.0, limit); });
  if (!(force > 0)) sum([](const contact::Column&) { return 1.0; });
  Resultant r{part.normal, moment / force};
  if (!part.edge) return r;
  r.normal = lift.normalized();
  const double up = r.normal.dot(part.normal);
  r.point += depth / force * (r.normal / up - part.normal);
  return r;
}

/// What a pair remembers of one face.
struct Past {
  const ContactMemory* same = nullptr;   // this very part
  bool face = false;                     // some part of this face
  double crushed = 0;
  double compressed = 0;                 // most of all its faces
};

Past recall(const std::vector<ContactMemory>& memory, std::uint64_t partner, std::uint64_t feature) {
  Past past;
  for (const ContactMemory& m : memory) {
    if (m.partner != partner || !of_bed(m)) continue;
    past.compressed = std::max(past.compressed, m.indentation - m.crushed);
    if (face_of(m.feature) != face_of(feature)) continue;
    past.face = true;
    past.crushed = std::max(past.crushed, m.crushed);
    if (m.feature == feature) past.same = &m;
  }
  return past;
}

}  // namespace

bool is_bed(const ContactLaw& law) {
  return law.stiffness == ContactLaw::Stiffness::per_area && (law.kind == ContactLaw::Kind::linear || law.kind == ContactLaw::Kind::crushing);
}

bool is_crater(const ContactMemory& m) { return m.feature >> 60 == crushing_kind && m.crushed > 0; }

void reopen_crater(const ContactMemory& now, std::vector<ContactMemory>& list) {
  if (!of_bed(now)) return;
  std::erase_if(list, [&](const ContactMemory& m) { return m.stiffness == 0 && m.partner == now.partner && is_crater(m) && face_of(m.feature) == face_of(now.feature); });
}

void find_bed(const TriangleSurface& skin, const contact::SurfaceIndex& index, const CandidatePair& pair, const ContactLaw& law, const Polyhedron& shape, const Pose& pose, double margin,
              const std::vector<ContactMemory>& memory, std::vector<Touch>& out) {
  thread_local std::vector<contact::Footprint> parts;
  parts.clear();
  const bool crushes = law.kind == ContactLaw::Kind::crushing;
  const double limit = crushes ? law.crushing_pressure / law.normal_stiffness : std::numeric_limits<double>::infinity();
  contact::skin_bed(index, shape, pose, margin, limit, parts);
  double face_deepest = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const contact::Footprint& part = parts[i];
    if (i == 0 || parts[i - 1].triangle != part.triangle) {
      face_deepest = -std::numeric_limits<double>::infinity();
      for (std::size_t k = i; k < parts.size() && parts[k].triangle == part.triangle; ++k) face_deepest = std::max(face_deepest, parts[k].deepest);
    }
    Touch t;
    t.a = pair.a;
    t.b = pair.b;
    t.law = &law;
    t.at.key = ((crushes ? crushing_kind : elastic_kind) << 60) | (name_of(skin, part.triangle) << 2) | static_cast<std::uint64_t>(part.sector);
    double sunk = 0, all = 0;
    for (const contact::Column& c : part.columns) {
      all += c.area;
      if (c.depth > 0) sunk += c.area;
    }
    const Past past = recall(memory, pair.a.id(), t.at.key);
    double crushed = past.crushed;
    if (!past.face) crushed = std::max(0.0, face_deepest - late * past.compressed - margin);
    t.normal_law.law = &law;
    const Resultant r = resultant(part, face_deepest - crushed, limit);
    t.at.normal = r.normal;
    t.at.point_a = r.point;
    t.normal_law.bed = std::make_shared<const contact::Bed>(part.columns, r.normal, part.deepest, law.normal_stiffness, limit, face_deepest, crushed);
    t.at.gap = -part.deepest;
    t.at.area = sunk > 0 ? sunk : all;
    t.stiffness = t.normal_law.stiffness = law.normal_stiffness * t.at.area;
    t.normal_law.limit = law.crushing_pressure * t.at.area;
    t.shear_stiffness = law.shear_stiffness * t.at.area;
    t.at.face_a = contact::triangle_of_face(skin, part.triangle, t.at.point_a);
    t.at.point_b = t.at.point_a + t.at.gap * t.at.normal;
    if (const ContactMemory* last = past.same) {
      t.warm = last->force;
      t.shear = last->shear - t.at.normal * t.at.normal.dot(last->shear);
      if (last->stiffness < t.stiffness) t.shear *= last->stiffness / t.stiffness;   // columns that join are not sheared
      t.stored = last->normal_energy + last->shear_energy;
      t.broken = last->broken;
      t.persistent = !last->force.isZero(0);
    }
    out.push_back(t);
  }
}

}  // namespace talus::coupling
