/// Piers, columns, boxes and spans of decks as the members an engineer sees: axis, section, cuts at several
/// heights.
///
/// A layer is the cells that a plane crosses. What the part above hands down through it is the sum of the
/// internal forces of these cells on their nodes above the plane (nodal equilibrium), in which each cell's
/// weight w stands at its nodes; the section has above it the part t of the cell instead:
///
///   F = sum f_a + sum_cells (t - n/8) w
///   M = sum (x_a - c) x f_a + sum_cells (t x_t - sum_n x_a / 8 - (t - n/8) c) x w
///   N = -F . e_z,  V = (F . e_x, F . e_y),  M = (M . e_x, M . e_y)
///
/// A section in a plane of nodes takes the mean of the layers on both of its sides, so that what else acts at
/// these nodes counts by half; at an end there is one. Exact up to the inertia of half a layer.
///
/// symbol        meaning                                                     unit
/// f_a           force on the layer at node a, current configuration         N
/// t, x_t        part of a cell above the plane, and its centroid            1, m
/// n             how many of its eight nodes lie above the plane             1
/// c             centre of the section, moved with the mean of its nodes     m
/// e_x e_y e_z   axes of the member, e_z from base to top                    -
#pragma once
#include <string>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"
#include "fem/rebar/rebar_geometry.hpp"
#include "fem/rebar/rebar_section.hpp"

namespace talus::fem {

struct Pier {
  std::string name;
  rebar::Member shape;  // its length holds the bars: for a pier the cap beam above it, too
  double wall = 0;      // hollow [m]
  double clear = 0;     // length from base to cap beam, or the whole [m]
  bool span = false;    // of a deck: axis_x across, axis_y up
  int support = 0;      // of a viaduct, from 0: that it belongs to, of a span the first of its two
  double area = 0;      // of a section that is no full rectangle; 0: as shape and wall say [m^2]
  std::array<double, 2>
      web{};  // what shears along axis_x, axis_y if it is not the whole section; 0: as shape and wall say [m]
  Vec3 axis() const { return shape.axis_x.cross(shape.axis_y); }
};

/// Viaduct: its piers; column: itself; box: along its longest side; a mesh has none.
std::vector<Pier> find_piers(const StructureSpec& spec);
/// The spans of a viaduct's deck, S1, S2 ...; else none.
std::vector<Pier> find_spans(const StructureSpec& spec);

/// Cells that a plane crosses, or that lie on one side of a plane of nodes.
struct Layer {
  std::vector<int> cells;
  std::vector<double> part;  // t of each cell
  std::vector<int> above;    // nodes above the plane
  std::vector<int> nodes;    // all nodes
};

struct Cut {
  double at = 0;              // distance from the base [m]
  std::vector<Layer> layers;  // two in a plane of nodes
  std::vector<int> nodes;     // of all layers
};

/// Where one pier lies in a mesh.
struct PierPlace {
  std::vector<int> cells;
  std::vector<int> foot, top;  // nodes of the end sections
  std::vector<Cut> cuts;
};

/// Cuts at equal distances from base to top (n >= 2). Empty cells if the pier is not in the mesh.
PierPlace place_of(const Pier& pier, const HexMesh& mesh, int cuts);

/// Shear resistance of a section by EN 1992-1-1, 6.2, for a force along axis_x (0) or axis_y (1); bars as
/// laid, axial force N with compression positive, to which the prestress of bars adds. The tension side of a
/// span is its lower one, of a pier either. Each tie counts over the length between the midpoints to its
/// neighbours, so that regular ones give A_sw / s. Circular sections by the effective width and depth of
/// their segment [clarke1993].
rebar::ShearInput shear_input(const Pier& pier, const std::vector<rebar::Bar>& bars, double at, int axis,
                              double axial);

}  // namespace talus::fem
