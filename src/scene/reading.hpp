/// What the parts of read_scene share: the scene being filled, the problems found, names, files.
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/table.hpp"
#include "scene/scene.hpp"
#include "scene/view.hpp"

namespace talus::scene {

/// A pair of materials that an [[interface]] gives the law of.
struct LawUse {
  View view;  // of the interface
  int a, b;   // materials
};

struct Reading {
  Scene& scene;
  std::vector<Problem>& problems;
  std::string directory;                             // that relative paths start from
  std::map<std::string, std::string> expected_hash;  // from scene.resolved.json
  std::map<std::string, int> material_index;
  bool names_good = true;                     // every material that is named is known
  bool interface_wildcard = false;            // some interface.between holds "*"
  std::map<std::string, int> interface_name;  // names in interface.between that no [[material]] declares
  const std::vector<std::pair<std::string, std::string>>* known_files =
      nullptr;  // whose hashes are known; null: none
  std::vector<LawUse> law_uses{};
  std::set<std::string> unknown_materials{};  // names that are no material's, which have been reported

  /// Index of the material named at `key`; reports unknown ones. A `surface` (terrain, plane) may name one
  /// that only an interface knows, since nothing but the contact law of it is used.
  int material(const View& view, const std::string& key, bool surface = false);
  /// Whether the material named at `key` is one that has its properties: not one that is missing or reported.
  bool has_material(const View& view, const std::string& key) const;
  /// Absolute path of the file named at `key`, empty if it is absent or cannot be read (reported). Books its
  /// hash, unless what it holds becomes part of the scene (`inlined`).
  std::string file(const View& view, const std::string& key, bool inlined = false);
  /// Reports a name that is empty, too long, holds what no file or dataset name may hold, or was taken
  /// before.
  std::string name(const View& view, const std::string& key, const std::string& otherwise,
                   std::map<std::string, int>& taken);
};

void read_materials(Reading& in, const View& root);
void read_site(Reading& in, const View& root);
void read_blocks(Reading& in, const View& root);
void read_rock_mass(Reading& in, const View& root);
void read_structures(Reading& in, const View& root);
void read_impact(Reading& in, const View& root);
/// `whole`: the scene that variables name keys of, where `root` is a part of it.
void read_ensemble(Reading& in, const View& root, const Node& whole);
/// Where every table and key stands. Entries of a list that have no name go by their place, and by the name
/// that they get.
void note_places(const Node& root, std::map<std::string, Where>& places);
/// Warns of numbers that are allowed and hardly meant.
void warn_of_the_implausible(const Reading& in, const View& root);
/// Warns of keys that have no effect in this scene.
void warn_of_idle_keys(const Reading& in, const View& root);
/// Last, when everything that can touch is known.
void read_interfaces(Reading& in, const View& root);

/// `scaled_elsewhere`: volume or mass come from a file.
Shape read_shape(Reading& in, const View& view, bool scaled_elsewhere = false);
/// Rotation body to world; identity if the key is absent.
Mat3 read_orientation(const View& view);
/// Dip direction and dip of a joint, from either form.
bool read_joint_orientation(const View& view, double& dip_direction, double& dip);
/// Edge of a cube of the shape's volume, as far as it is known without its mesh; 0 if not.
double shape_size(const Shape& shape, double density);
/// Numbers of a table in a file, in SI.
struct NumberTable {
  std::vector<std::vector<double>> rows;
  std::vector<std::string> header;  // names of the columns without their units; empty: the file has none
  std::vector<int> lines;           // of the file, one for each row
  std::vector<Dimension> units;     // of the columns that name one; none for the others
};
/// What a column holds, by its place and its name.
using ColumnUse = std::function<ColumnHolds(std::size_t, const std::string&)>;
/// Reads a table of `columns` numbers a row (0: as many as it has names). Rows of text before the first
/// number name the columns, "s [mm]" or "F (kN)", or their units alone, or the units below the names; numbers
/// of such columns are converted. Reports what is wrong at `key`, a unit that is not known or of another kind
/// than `holds` says among it; then there are no rows.
NumberTable read_numbers(const View& view, const std::string& key, const std::string& path,
                         std::size_t columns, const ColumnUse& holds);

/// tan(phi) of a coefficient or an angle.
double friction_coefficient(const Node& node);

}  // namespace talus::scene
