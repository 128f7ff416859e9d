/// A structure as contact sees it: its skin, the motion of its nodes there, and probes. Of several ranks all
/// hold the whole skin, by the numbers of the whole mesh, and ask the owners for its motion when somebody
/// asks for it.
#pragma once
#include "fem/integrators/nodal_fields.hpp"
#include "fem/structure_body.hpp"

namespace talus::fem {

class ContactSurface : public StructureSkin {
 public:
  ContactSurface(const StructureBody& body, const NodalFields& fields) : body_(body), fields_(fields) {}

  /// Cells are gone or new.
  void rebuild();
  void probe(std::vector<ProbePoint> points) { probes_ = std::move(points); }
  const std::vector<SkinQuad>& faces() const { return face_; }
  const TriangleSurface& surface() const override;
  double young() const override { return body_.spec.young; }
  double node_mass(int node) const override;
  Vec3 node_position(int node) const override;
  Vec3 node_built(int node) const override;
  Vec3 node_velocity(int node) const override;
  Vec3 predicted_velocity(int node) const override;
  std::array<bool, 3> node_held(int node) const override;
  std::vector<Vec3> probe_displacements() const override;
  /// Finds the nodes that others ask for; again once masses are known.
  void watch();
  std::size_t memory_consumption() const;  // [bytes]

 private:
  std::vector<SkinQuad> whole_skin() const;
  const double* seen(int node) const;  // u, v of the skin and of probes
  std::size_t seen_place(int node) const;
  void share_prediction() const;  // v_hat there

  const StructureBody& body_;
  const NodalFields& fields_;
  std::vector<ProbePoint> probes_;
  std::vector<SkinQuad> face_;
  std::vector<int> node_;  // of each vertex of the surface, the first ones
  mutable TriangleSurface surface_;
  WatchedNodes watched_;  // of skin and probes
  struct Seen {
    std::vector<double> built, motion, prediction;
  };  // of each watched node: place as built, mass, directions held, 0; u, v; v_hat
  mutable Seen seen_;
  mutable long surface_of_ = -1, seen_of_ = -1,
               prediction_of_ = -1;  // revisions of the fields that they hold
};

}  // namespace talus::fem
