/// Scenes with one structure and no block, as text.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "verify/suite.hpp"

namespace talus::verify {

struct StructureText {
  double duration = 1, interval = 1;  // of the run and of the histories [s]
  Vec3 gravity = Vec3::Zero();
  std::string material;  // lines of its [[material]] "m"; density included
  std::string body;      // lines of [[structure]] before its loads
  struct Load {
    Box3 region;
    Vec3 traction;
    std::vector<std::pair<double, double>> history;
  };
  std::vector<Load> loads;
  std::vector<Vec3> probes;
  std::string str() const;
};

/// Displacement of probe `probe` along `axis` in every row.
std::vector<double> probe_history(const Outcome& o, int probe, int axis);

/// Writes a chain of hexahedra along x as an Abaqus deck: at each section a square of the given half width.
/// Faces at the ends are node sets LEFT and RIGHT. Returns the path, in the system's folder for temporary
/// files.
struct Section {
  double x, half;
};
std::string write_chain(const std::string& name, const std::vector<Section>& sections);

/// Removes that folder, which else goes when the program comes to its end.
void remove_temporary();

/// A unit cube of seven distorted cells, one inside and one at each face, after [irons1972]; `nodes` are
/// those inside. Returns the path.
std::string write_patch(std::vector<Vec3>& nodes);

}  // namespace talus::verify
