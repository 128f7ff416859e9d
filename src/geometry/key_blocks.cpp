#include "geometry/key_blocks.hpp"

#include <algorithm>
#include <cmath>

namespace talus::geometry {
namespace {

constexpr double tolerance = 1e-9;  // on unit vectors: a face slid along exactly does not block

bool in_pyramid(const std::vector<BlockPlane>& planes, const Vec3& x) {
  return std::all_of(planes.begin(), planes.end(),
                     [&](const BlockPlane& p) { return p.normal.dot(x) >= -tolerance; });
}

/// Rays that span the joint pyramid, none if it is {0}: the corners of its section with the sides of a cube.
/// Each half-space cuts a side's polygon once, so that blocks of thousands of faces take no long time.
std::vector<Vec3> rays_of_pyramid(const std::vector<BlockPlane>& planes) {
  std::vector<Vec3> rays;
  for (int side = 0; side < 6; ++side) {
    const Vec3 n = (side < 3 ? 1 : -1) * Vec3::Unit(side % 3), u = Vec3::Unit((side + 1) % 3), v = n.cross(u);
    std::vector<Vec3> polygon{n + u + v, n - u + v, n - u - v, n + u - v};
    for (const BlockPlane& p : planes) {
      std::vector<Vec3> kept;
      const auto within = [&](const Vec3& x) { return p.normal.dot(x) + tolerance; };
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
        const double wa = within(a), wb = within(b);
        if (wa >= 0) kept.push_back(a);
        if ((wa > 0 && wb < 0) || (wa < 0 && wb > 0)) kept.emplace_back(a + wa / (wa - wb) * (b - a));
      }
      polygon = std::move(kept);
      if (polygon.empty()) break;
    }
    for (const Vec3& x : polygon) rays.push_back(x.normalized());
  }
  return rays;
}

/// What a face bears along itself without being pressed [N].
double beside_friction(const BlockPlane& p) { return p.strength.cohesion * p.area + p.bridges; }

}  // namespace

KeyBlock key_block(const std::vector<BlockPlane>& given, double free_area, const Vec3& weight) {
  KeyBlock k;
  k.free_area = free_area;
  if (!(free_area > 0)) return k;
  // Faces in one plane, or in parallel planes on the same side, resist together.
  std::vector<BlockPlane> planes;
  for (const BlockPlane& p : given) {
    bool merged = false;
    for (BlockPlane& q : planes)
      if (q.joint == p.joint && (q.normal - p.normal).norm() < 1e-9)
        q.area += p.area, q.bridges += p.bridges, merged = true;
    if (!merged) planes.push_back(p);
  }
  const std::vector<Vec3> rays = rays_of_pyramid(planes);
  if (rays.empty()) {
    k.type = KeyBlock::Type::tapered;
    return k;
  }
  k.type = KeyBlock::Type::stable;
  const double w = weight.norm();
  if (!(w > 0)) return k;
  const Vec3 r = weight / w;
  if (std::all_of(planes.begin(), planes.end(),
                  [&](const BlockPlane& p) { return p.normal.dot(r) > tolerance; })) {
    k.type = KeyBlock::Type::unstable;
    k.mode = KeyBlock::Mode::falling;
    k.direction = r;
    k.driving_force = w;
    k.factor_of_safety = 0;
    return k;
  }
  const auto finish = [&](double resisting) {
    k.factor_of_safety =
        k.driving_force > 0 ? resisting / k.driving_force : std::numeric_limits<double>::infinity();
    k.type = k.factor_of_safety < 1 ? KeyBlock::Type::unstable : KeyBlock::Type::needs_friction;
  };
  // A face that no direction of the pyramid lies in is not slid on.
  std::vector<BlockPlane> slid_on;
  for (const BlockPlane& p : planes)
    if (std::any_of(rays.begin(), rays.end(),
                    [&](const Vec3& x) { return p.normal.dot(x) <= 10 * tolerance; }))
      slid_on.push_back(p);
  for (const BlockPlane& p : slid_on) {
    const double into = p.normal.dot(r);
    if (into > tolerance) continue;
    const Vec3 s = r - into * p.normal;
    if (s.norm() <= tolerance || !in_pyramid(planes, s.normalized())) continue;
    k.mode = KeyBlock::Mode::plane;
    k.joint_1 = p.joint;
    k.direction = s.normalized();
    k.normal_force_1 = -into * w;
    k.driving_force = s.norm() * w;
    finish(k.normal_force_1 * std::tan(p.strength.friction) + beside_friction(p));
    return k;
  }
  for (std::size_t i = 0; i < slid_on.size(); ++i)
    for (std::size_t j = i + 1; j < slid_on.size(); ++j) {
      const BlockPlane &p = slid_on[i], &q = slid_on[j];
      Vec3 s = p.normal.cross(q.normal);
      if (s.norm() < 1e-9) continue;
      s.normalize();
      if (s.dot(r) < 0) s = -s;
      if (s.dot(r) <= tolerance || !in_pyramid(planes, s)) continue;
      // r = s (s.r) - N_p n_p - N_q n_q, both pressing.
      const double c = p.normal.dot(q.normal), rp = r.dot(p.normal), rq = r.dot(q.normal), det = 1 - c * c;
      const double np = -(rp - c * rq) / det, nq = -(rq - c * rp) / det;
      if (np < -tolerance || nq < -tolerance) continue;
      k.mode = KeyBlock::Mode::wedge;
      k.joint_1 = p.joint;
      k.joint_2 = q.joint;
      k.direction = s;
      k.normal_force_1 = np * w;
      k.normal_force_2 = nq * w;
      k.driving_force = s.dot(r) * w;
      finish(k.normal_force_1 * std::tan(p.strength.friction) + beside_friction(p) +
             k.normal_force_2 * std::tan(q.strength.friction) + beside_friction(q));
      return k;
    }
  return k;
}

namespace {

Box3 bounds_of(const CutResult& cut) {
  Box3 box;
  for (const CutBlock& block : cut.blocks)
    for (const Vec3& v : block.body.vertices) box.extend(block.centroid + v);
  return box;
}

}  // namespace

std::vector<KeyBlock> key_blocks(const CutResult& cut, const KeyBlockOptions& options) {
  const Box3 box = bounds_of(cut);
  const auto is_held = [&](const Vec3& point, const Vec3& normal) {
    const bool on_base = normal.z() < -1 + 1e-9 && point.z() - box.min().z() < 1e-6 * box.sizes().norm();
    return on_base || (options.is_held && options.is_held(point, normal));
  };
  const auto strength = [&](int joint) {
    if (options.strength.empty()) return JointStrength{};
    const int last = static_cast<int>(options.strength.size()) - 1;
    return options.strength[joint >= 0 ? std::min(joint, last) : last];
  };
  // A plane without area for each of a block's sides of an interface with bridges: it joins the face there.
  std::vector<std::vector<BlockPlane>> bridges(cut.blocks.size());
  for (const CutInterface& i : cut.interfaces) {
    if (!(i.bonded_area > 0)) continue;
    for (const int side : {i.a, i.b})
      bridges[static_cast<std::size_t>(side)].push_back({.normal = side == i.a ? Vec3(-i.normal) : i.normal,
                                                         .strength = strength(i.joint),
                                                         .joint = i.joint,
                                                         .bridges = i.shear * i.bonded_area});
  }
  std::vector<KeyBlock> out;
  for (std::size_t n = 0; n < cut.blocks.size(); ++n) {
    const CutBlock& block = cut.blocks[n];
    const Polyhedron& p = block.body;
    std::vector<double> area(p.faces(), 0.0);
    std::vector<Vec3> middle(p.faces(), Vec3::Zero());
    for (std::size_t t = 0; t < p.triangles.size(); ++t) {
      const auto& c = p.triangles[t];
      const Vec3 &a = p.vertices[c[0]], &b = p.vertices[c[1]], &d = p.vertices[c[2]];
      const double s = 0.5 * (b - a).cross(d - a).norm();
      area[p.triangle_face[t]] += s;
      middle[p.triangle_face[t]] += s * (a + b + d) / 3;
    }
    std::vector<BlockPlane> planes;
    double free_area = 0;
    for (int f = 0; f < p.faces(); ++f) {
      const int joint = p.face_joint_set[f];
      if (joint < 0 && !is_held(block.centroid + middle[f] / area[f], p.face_normals[f]))
        free_area += area[f];
      else
        planes.push_back({-p.face_normals[f], area[f], strength(joint), joint, 0});
    }
    planes.insert(planes.end(), bridges[n].begin(), bridges[n].end());
    out.push_back(key_block(planes, free_area, options.density * block.volume * options.gravity));
  }
  return out;
}

std::string name_of(KeyBlock::Type type) {
  switch (type) {
    case KeyBlock::Type::enclosed: return "enclosed";
    case KeyBlock::Type::tapered: return "tapered";
    case KeyBlock::Type::stable: return "stable";
    case KeyBlock::Type::needs_friction: return "needs friction";
    case KeyBlock::Type::unstable: return "unstable";
  }
  return "";
}

std::string name_of(KeyBlock::Mode mode) {
  switch (mode) {
    case KeyBlock::Mode::none: return "none";
    case KeyBlock::Mode::falling: return "falling";
    case KeyBlock::Mode::plane: return "plane";
    case KeyBlock::Mode::wedge: return "wedge";
  }
  return "";
}

}  // namespace talus::geometry
