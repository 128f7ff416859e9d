/// Makes a structure by its specification: cells, masses, supports, loads, laws, bars and bearings, the
/// stable step and damping; with several ranks the part of each.
///
///   m_a = int rho N_a dV                        masses of nodes by row sums
///   m_m += w m_h,   f_m += w f_h                what hangs on a node at the border of smaller cells
///
/// so that the whole mass and, since a hanging node lies where its masters' mean does, both momenta and the
/// power of every force are those of the free mesh.
#pragma once
#include "fem/members/member_loads.hpp"
#include "fem/output/contact_surface.hpp"

namespace talus::fem {

class StructureSetup {
 public:
  StructureSetup(StructureBody& body, NodalFields& fields, ContactSurface& skin, MemberLoads& loads)
      : body_(body), fields_(fields), skin_(skin), loads_(loads) {}

  /// `before`: the same structure with larger cells, whose first frequency it takes. With several ranks, all
  /// of them call this and divide() together. Cells and nodes have the numbers of this rank's part of the
  /// mesh; the skin, probes, lists of cells that leave, and what is asked for from outside have those of the
  /// whole. Throws InputError for what does not fit together.
  void build(const StructureBody* before);
  /// Whether anything presses it from the start, and it is asked to be at rest under that.
  bool weighs() const;
  /// Divides the work of a structure that every rank holds whole.
  void divide();

 private:
  void set_material(bool first);
  Box3 make_cells();  // the extent of the whole mesh
  void check_supports(const HexMesh& mesh);
  void set_loads(const Box3& extent);
  void make_links(const HexMesh& whole);  // bars and bearings
  void set_masses();
  void settle_hanging_nodes();  // their masses, supports and loads go to the nodes that they follow
  void find_critical_step();
  material::CellSize largest_cell() const;
  bool divides_memory(const HexMesh& whole) const;
  void make_partition(const HexMesh& whole, bool everywhere);
  void take_part(HexMesh&& whole);

  StructureBody& body_;
  NodalFields& fields_;
  ContactSurface& skin_;
  MemberLoads& loads_;
};

}  // namespace talus::fem
