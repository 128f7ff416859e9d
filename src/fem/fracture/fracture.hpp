/// Erosion and fragments: what leaves a structure, with its mass, momenta and energy.
#pragma once
#include <map>

#include "fem/bearings/bearing_pads.hpp"
#include "fem/fracture/pieces.hpp"
#include "fem/integrators/energy_account.hpp"
#include "fem/output/contact_surface.hpp"

namespace talus::fem {

std::vector<int> spent_cells(const StructureBody& body);  // own cells to erode

class Fracture {
 public:
  Fracture(StructureBody& body, NodalFields& fields, Forces& forces, EnergyAccount& energy,
           ContactSurface& skin, const Stresses& stresses)
      : body_(body),
        fields_(fields),
        forces_(forces),
        energy_(energy),
        skin_(skin),
        pieces_(body, stresses) {}

  /// Cells by their numbers in the whole mesh.
  void erode(const std::vector<int>& cells);
  /// As Structure says.
  std::vector<Fragment> take_fragments();
  Structure::Unsupported unsupported();
  /// Without an account of what they take along.
  void switch_off(const std::vector<int>& cells);
  void remove_node(int n);
  /// What has left, what cells and masses are there, and the history of the law; `here` as save_here().
  void save(std::vector<double>& state, bool here) const;
  void restore(StateReader& state, bool here);

 private:
  struct Excerpt {
    HexMesh mesh;           // these cells alone, with numbers of their own
    std::vector<int> node;  // numbers in the whole mesh, ascending
    std::vector<Vec3> position, velocity;
    std::vector<double> mass, cell_mass;
    std::vector<int> cells_at_node;  // in the structure
    int place(int whole) const;      // -1: not in it
  };
  Excerpt excerpt(const std::vector<int>& cells) const;
  double cell_energy(int cell) const;
  double link_energy(
      const std::vector<int>& cells) const;  // of the bars in them and the bearings at them [J]
  void drop_orphans(const std::vector<int>& cells);
  bool is_rubble(const std::vector<int>& piece) const;
  struct Leaving {
    double mass = 0;
    int cells = 0;      // of the piece
    bool goes = false;  // keeps no cell
    Vec3 position, velocity;
  };
  std::map<int, Leaving> leaving_nodes(const HexMesh& mesh, const std::vector<int>& cells,
                                       const Excerpt* apart) const;
  void shape_of_piece(const HexMesh& mesh, const std::vector<int>& cells, double smallest,
                      const std::map<int, Leaving>& nodes, const std::vector<SeatedNode>& seated,
                      Fragment& f) const;
  Fragment detach(const std::vector<int>& cells, const std::vector<SeatedNode>& seats);
  std::vector<SeatedNode> seated_nodes() const;  // of all decks, as long as cells of both sides are there

  StructureBody& body_;
  NodalFields& fields_;
  Forces& forces_;
  EnergyAccount& energy_;
  ContactSurface& skin_;
  Pieces pieces_;
};

}  // namespace talus::fem
