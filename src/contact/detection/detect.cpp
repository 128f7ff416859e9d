#include "contact/detection/detect.hpp"

#include <limits>

#include "contact/narrow/narrow_convex.hpp"
#include "contact/narrow/narrow_local.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {

int block_block(const Polyhedron& A, const Pose& pose_a, const Polyhedron& B, const Pose& pose_b,
                double margin, std::vector<ContactPoint>& out) {
  if (A.convex && B.convex) return narrow::convex_convex(A, pose_a, B, pose_b, margin, out);
  return narrow::concave_concave(A, pose_a, B, pose_b, margin, out);
}

int plane_block(const Plane& plane, const Polyhedron& B, const Pose& pose_b, double margin,
                std::vector<ContactPoint>& out) {
  const Vec3& n = plane.normal;
  const double centre = n.dot(pose_b.c - plane.point);
  if (centre - B.radius * narrow::stretch_bound(pose_b.F) > margin) return 0;
  const Vec3 down = pose_b.F.transpose() * n;  // gap of X: centre + down . X
  const Mat3 cof = narrow::cofactor(pose_b.F);
  const Vec3 n_body = cof.transpose() * n;  // n . cof n_f: alignment of a face
  const std::size_t start = out.size();
  const int vertices = static_cast<int>(B.vertices.size());
  for (int v = 0; v < vertices; ++v) {
    const double gap = centre + down.dot(B.vertices[v]);
    if (gap > margin) continue;
    // Only vertices that can be lowest somewhere near this pose: a flat or far-side vertex adds nothing.
    bool descends = false, faces_plane = false;
    for (int i = B.vertex_edge_offset[v]; i < B.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = B.edges[B.vertex_edges[i]];
      const Vec3 d = B.vertices[e.v0 == v ? e.v1 : e.v0] - B.vertices[v];
      descends |= down.dot(d) < -tolerances().steep * d.norm();
      faces_plane |= std::min(n_body.dot(B.face_normals[e.left]), n_body.dot(B.face_normals[e.right])) <
                     -tolerances().lean;
    }
    if (B.vertex_edge_offset[v] == B.vertex_edge_offset[v + 1] || (descends && !faces_plane)) continue;
    ContactPoint c;
    c.point_b = pose_b.world(B.vertices[v]);
    c.point_a = c.point_b - gap * n;
    c.normal = n;
    c.gap = gap;
    c.area = 0;
    c.key = make_key(Form::face_vertex, 0, v);
    c.face_a = 0;
    out.push_back(c);
  }
  if (out.size() == start) return 0;
  // Faces lying on the plane press on their area.
  const auto add = [&](int v, double area, int face) {
    const FeatureKey key = make_key(Form::face_vertex, 0, v);
    for (std::size_t i = start; i < out.size(); ++i)
      if (out[i].key == key) {
        out[i].area += area;
        out[i].face_b = face;
      }
  };
  for (int f = 0; f < B.faces(); ++f) {
    const Vec3 area_normal = cof * B.face_normals[f];
    if (n.dot(area_normal) > -tolerances().parallel_cosine() * area_normal.norm()) continue;
    const int first = B.face_offset[f], count = B.face_offset[f + 1] - first;
    if (B.convex) {
      // Fan about the centroid: weights sum to the area and keep the centroid.
      const auto at = [&](int k) -> const Vec3& { return B.vertices[B.face_vertices[first + k % count]]; };
      const Vec3& nf = B.face_normals[f];
      Vec3 centroid = Vec3::Zero();
      double twice = 0;
      for (int k = 1; k + 1 < count; ++k) {
        const double a = nf.dot((at(k) - at(0)).cross(at(k + 1) - at(0)));
        twice += a;
        centroid += a * (at(0) + at(k) + at(k + 1)) / 3;
      }
      centroid /= twice;
      for (int k = 0; k < count; ++k) {
        const double a = 0.5 * nf.dot((at(k) - centroid).cross(at(k + 1) - centroid)) * area_normal.norm();
        add(B.face_vertices[first + k], a / 2, f);
        add(B.face_vertices[first + (k + 1) % count], a / 2, f);
      }
    } else {
      for (std::size_t t = 0; t < B.triangles.size(); ++t) {
        if (B.triangle_face[t] != f) continue;
        const auto& v = B.triangles[t];
        const double a =
            0.5 *
            (cof * (B.vertices[v[1]] - B.vertices[v[0]]).cross(B.vertices[v[2]] - B.vertices[v[0]])).norm();
        for (const int w : v) add(w, a / 3, f);
      }
    }
  }
  return static_cast<int>(out.size() - start);
}

PressedCorner pressed_corner(FeatureKey key) {
  const Form form = form_of(key);
  const auto [first, second] = features_of(key);
  PressedCorner corner;
  if (form == Form::vertex_face || form == Form::vertex_edge) corner.of_a = first;
  if (form == Form::face_vertex || form == Form::edge_vertex || form == Form::vertex_vertex)
    corner.of_b = second;
  return corner;
}

Pose Motion::at(double s) const {
  Pose p;
  p.c = start.c + s * displacement + (s * s - s) * half_gravity_step;
  const double angle = rotation.norm();
  p.F =
      angle > 0 ? Mat3(Eigen::AngleAxisd(s * angle, rotation / angle).toRotationMatrix() * start.F) : start.F;
  return p;
}

Box3 bounds(const Polyhedron& p, const Pose& pose, double margin) {
  Box3 box;
  for (const auto& x : p.vertices) box.extend(pose.F * x);
  box.min() += pose.c - Vec3::Constant(margin);
  box.max() += pose.c + Vec3::Constant(margin);
  return box;
}

Box3 swept_bounds(const Polyhedron& p, const Motion& motion, double margin) {
  // Every vertex stays near its chord: the parabola departs by at most q / 4 (at s = 1/2), the rotation of a
  // vertex at radius r through angle a by at most r a^2 / 8 (error of linear interpolation), and by 2 r at
  // any angle.
  Box3 box = bounds(p, motion.start);
  box.extend(bounds(p, motion.at(1)));
  const double angle = motion.rotation.norm();
  const double reach = p.radius * narrow::stretch_bound(motion.start.F);
  const double bulge = reach * std::min(angle * angle / 8, 2.0);
  const Vec3 grow = motion.half_gravity_step.cwiseAbs() / 4 + Vec3::Constant(bulge + margin);
  box.min() -= grow;
  box.max() += grow;
  return box;
}

}  // namespace talus::contact
