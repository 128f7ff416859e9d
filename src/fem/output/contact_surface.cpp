#include "fem/output/contact_surface.hpp"

#include <algorithm>
#include <limits>

#include "core/error.hpp"
#include "core/sort_unique.hpp"
#include "fem/discretisation/hanging.hpp"

namespace talus::fem {

/// Of several ranks each finds the faces of its own nodes; all of them hold the whole skin, in numbers of the
/// whole mesh.
std::vector<SkinQuad> ContactSurface::whole_skin() const {
  std::vector<SkinQuad> quads = skin(body_.mesh, body_.live);
  if (!body_.partition) return quads;
  std::vector<double> mine;
  for (const SkinQuad& q : quads) {
    if (!body_.own_node(*std::min_element(q.node.begin(), q.node.end())))
      continue;  // both cells of an own face are computed here
    mine.insert(mine.end(), {6.0 * body_.partition->whole_cell(q.cell) + q.face});
    for (const int n : q.node) mine.push_back(body_.partition->whole_node(n));
  }
  const std::vector<double> all = body_.partition->records(5, mine);
  quads.clear();
  for (std::size_t at = 0; at < all.size(); at += 5) {
    const int place = static_cast<int>(all[at]);
    SkinQuad& q = quads.emplace_back(SkinQuad{{}, place / 6, place % 6});
    for (std::size_t k = 0; k < 4; ++k) q.node[k] = static_cast<int>(all[at + 1 + k]);
  }
  return quads;
}

void ContactSurface::rebuild() {
  face_ = whole_skin();
  std::vector<int> vertex(body_.partition ? body_.partition->nodes_in_all() : body_.mesh.nodes.size(), -1);
  node_.clear();
  for (const SkinQuad& quad : face_)
    for (int n : quad.node)
      if (vertex[n] < 0) vertex[n] = 0;
  for (std::size_t n = 0; n < vertex.size(); ++n)
    if (vertex[n] == 0) vertex[n] = static_cast<int>(node_.size()), node_.push_back(static_cast<int>(n));
  TriangleSurface& s = surface_;
  const int nodes = static_cast<int>(node_.size());
  s.vertices.assign(nodes + face_.size(), Vec3::Zero());
  s.velocities.assign(nodes + face_.size(), Vec3::Zero());
  s.nodes.assign(nodes + face_.size(), {});
  s.triangles.clear();
  s.parent_face.clear();
  s.default_material = body_.spec.material;
  for (int i = 0; i < nodes; ++i) s.nodes[i] = followed_by_node(body_.mesh, node_[i]);
  for (int q = 0; q < static_cast<int>(face_.size()); ++q) {
    s.nodes[nodes + q] = followed_by_face(body_.mesh, face_[q].node);
    for (int k = 0; k < 4; ++k) {
      s.triangles.push_back({vertex[face_[q].node[k]], vertex[face_[q].node[(k + 1) % 4]], nodes + q});
      s.parent_face.push_back(q);
    }
  }
  ++s.revision;
  surface_of_ = -1;
  if (body_.partition) watch();
}

const TriangleSurface& ContactSurface::surface() const {
  if (surface_of_ != fields_.revision) {
    // The nodes of the skin come first, then the middle of every face, four triangles around each
    // (rebuild()).
    const std::size_t nodes = node_.size();
    for (std::size_t i = 0; i < nodes; ++i)
      surface_.vertices[i] = node_position(node_[i]), surface_.velocities[i] = node_velocity(node_[i]);
    const auto middle = [&](std::vector<Vec3>& of, std::size_t q) {
      const auto corner = [&](std::size_t k) -> const Vec3& {
        return of[static_cast<std::size_t>(surface_.triangles[4 * q + k][0])];
      };
      of[nodes + q] = 0.25 * ((corner(0) + corner(1)) + (corner(2) + corner(3)));
    };
    for (std::size_t q = 0; q < face_.size(); ++q) {
      const TriangleSurface::NodeWeights& w = surface_.nodes[nodes + q];
      if (w.count == 4 && std::all_of(w.weight.begin(), w.weight.end(), [](double x) { return x == 0.25; })) {
        middle(surface_.vertices, q), middle(surface_.velocities, q);
        continue;
      }
      // Corners hang: the middle moves as the nodes that contact presses on, or it would do other work.
      Vec3 &x = surface_.vertices[nodes + q], &v = surface_.velocities[nodes + q];
      x = v = Vec3::Zero();
      for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k)
        x += w.weight[k] * node_position(w.node[k]), v += w.weight[k] * node_velocity(w.node[k]);
    }
    surface_of_ = fields_.revision;
  }
  return surface_;
}

double ContactSurface::node_mass(int node) const {
  const std::array<bool, 3> held = node_held(node);
  return held[0] && held[1] && held[2]
             ? std::numeric_limits<double>::infinity()
             : fields_.drag * (body_.partition ? seen_.built[6 * seen_place(node) + 3] : body_.mass[node]);
}

Vec3 ContactSurface::node_position(int node) const {
  return body_.partition ? Vec3(Vec3(&seen_.built[6 * seen_place(node)]) + Vec3(seen(node)))
                         : fields_.position(node);
}

Vec3 ContactSurface::node_built(int node) const {
  return body_.partition ? Vec3(&seen_.built[6 * seen_place(node)]) : body_.mesh.nodes[node];
}

Vec3 ContactSurface::node_velocity(int node) const {
  return body_.partition ? Vec3(seen(node) + 3) : fields_.velocity(node);
}

Vec3 ContactSurface::predicted_velocity(int node) const {
  if (!body_.partition)
    return {fields_.v_hat[4 * node], fields_.v_hat[4 * node + 1], fields_.v_hat[4 * node + 2]};
  share_prediction();
  return Vec3(&seen_.prediction[3 * seen_place(node)]);
}

std::array<bool, 3> ContactSurface::node_held(int node) const {
  if (!body_.partition) return body_.supports.held[node];
  const auto bits = static_cast<int>(seen_.built[6 * seen_place(node) + 4]);
  return {(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
}

std::vector<Vec3> ContactSurface::probe_displacements() const {
  std::vector<Vec3> result;
  for (const ProbePoint& p : probes_) {
    Vec3 u = Vec3::Zero();
    for (int a = 0; a < 8; ++a) {
      const double* const there =
          body_.partition ? seen(p.node[a]) : &fields_.u[4 * static_cast<std::size_t>(p.node[a])];
      for (int c = 0; c < 3; ++c) u[c] += p.weight[a] * there[c];
    }
    result.push_back(u);
  }
  return result;
}

void ContactSurface::watch() {
  std::vector<int> nodes = node_;
  for (const TriangleSurface::NodeWeights& w :
       surface_.nodes)  // those that hanging ones follow may lie within
    nodes.insert(nodes.end(), w.node.begin(), w.node.begin() + w.count);
  for (const ProbePoint& p : probes_) nodes.insert(nodes.end(), p.node.begin(), p.node.end());
  sort_unique(nodes);
  watched_ = WatchedNodes(std::move(nodes), *body_.partition);
  AlignedVector reference(4 * body_.mesh.nodes.size()), rest(reference.size());
  for (std::size_t n = 0; n < body_.mesh.nodes.size(); ++n) {
    std::copy_n(body_.mesh.nodes[n].data(), 3, &reference[4 * n]);
    const auto& held = body_.supports.held[n];
    rest[4 * n] = body_.mass.empty() ? 0.0 : body_.mass[n],
             rest[4 * n + 1] = held[0] + 2 * held[1] + 4 * held[2];
  }
  const std::array<const AlignedVector*, 2> fields{&reference, &rest};
  watched_.gather(fields, seen_.built);
  seen_of_ = -1;
}

// What is seen from outside is whole for whoever asks; which numbers have already been fetched is not part of
// the state.
const double* ContactSurface::seen(int node) const {
  if (seen_of_ != fields_.revision) {
    const std::array<const AlignedVector*, 2> fields{&fields_.u, &fields_.v};
    watched_.gather(fields, seen_.motion);
    seen_of_ = fields_.revision;
  }
  return &seen_.motion[6 * seen_place(node)];
}

std::size_t ContactSurface::seen_place(int node) const {
  const int place = watched_.place(node);
  if (place < 0)
    throw NumericalFailure("structure " + body_.spec.name +
                           ": a node was asked for that is not on its surface");
  return static_cast<std::size_t>(place);
}

void ContactSurface::share_prediction() const {
  const long now = fields_.revision + fields_.predictions;  // neither falls
  if (prediction_of_ == now) return;
  const AlignedVector* const field = &fields_.v_hat;
  watched_.gather({&field, 1}, seen_.prediction);
  prediction_of_ = now;
}

std::size_t ContactSurface::memory_consumption() const {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return of(face_) + of(node_) + of(surface_.vertices) + of(surface_.velocities) + of(surface_.triangles) +
         of(surface_.parent_face) + of(surface_.nodes) + watched_.memory_consumption() + of(seen_.built) +
         of(seen_.motion) + of(seen_.prediction);
}

}  // namespace talus::fem
