#include "coupling/touch_bed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "contact/skin_bed.hpp"

namespace talus::coupling {
namespace {

constexpr std::uint64_t elastic_kind = 9, crushing_kind = 10;   // in the upper bits of the key
constexpr double same_direction = 0.9;
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

/// Centre of pressure; of what does not press yet of its area.
Vec3 centre_of(const std::vector<contact::Column>& columns, double most, double limit) {
  Vec3 pressed = Vec3::Zero(), all = Vec3::Zero();
  double force = 0, area = 0;
  for (const contact::Column& c : columns) {
    const double f = c.area * std::clamp(std::min(c.depth, most), 0.0, limit);
    force += f, pressed += f * c.place;
    area += c.area, all += c.area * c.place;
  }
  return force > 0 ? Vec3(pressed / force) : Vec3(all / area);
}

/// What a pair remembers of one face and of the direction that it presses in.
struct Past {
  const ContactMemory* same = nullptr;   // this very part
  bool face = false;                     // some part of this face
  double crushed = 0;
  double compressed = 0;                 // most of all in this direction
};

Past recall(const std::vector<ContactMemory>& memory, std::uint64_t partner, std::uint64_t feature, const Vec3& normal) {
  Past past;
  for (const ContactMemory& m : memory) {
    if (m.partner != partner || !of_bed(m)) continue;
    if (m.normal.dot(normal) > same_direction) past.compressed = std::max(past.compressed, m.indentation - m.crushed);
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
    t.at.normal = part.normal;
    double sunk = 0, all = 0;
    for (const contact::Column& c : part.columns) {
      all += c.area;
      if (c.depth > 0) sunk += c.area;
    }
    const Past past = recall(memory, pair.a.id(), t.at.key, part.normal);
    double crushed = past.crushed;
    if (!past.face) crushed = std::max(0.0, face_deepest - late * past.compressed - margin);
    t.normal_law.law = &law;
    t.normal_law.bed = std::make_shared<const contact::Bed>(part.columns, part.deepest, law.normal_stiffness, limit, face_deepest, crushed);
    t.at.gap = -part.deepest;
    t.at.area = sunk > 0 ? sunk : all;
    t.stiffness = t.normal_law.stiffness = law.normal_stiffness * t.at.area;
    t.normal_law.limit = law.crushing_pressure * t.at.area;
    t.shear_stiffness = law.shear_stiffness * t.at.area;
    t.at.point_a = centre_of(part.columns, face_deepest - crushed, limit);
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
