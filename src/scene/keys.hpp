/// The one table of scene keys: it validates (`validate`), fills defaults (`View`), documents (docs/scene.md)
/// and answers `talus explain`.
#pragma once
#include <limits>
#include <string>
#include <vector>

#include "core/units.hpp"

namespace talus::scene {

enum class Type {
  boolean,
  integer,
  quantity,
  text,
  choice,
  path,
  vector,          // [x, y, z] of quantities
  plan_vector,     // [x, y] or [x, y, z]
  vectors,         // [[x, y, z], ...]
  plan_points,     // [[x, y], ...], two or more
  quaternion,      // [w, x, y, z]
  pair_list,       // [[a, b], ...]: the dimension is b's, `first` is a's
  counts,          // [nx, ny, nz]
  texts,           // a text or a list of texts
  friction,        // a coefficient, or an angle with a unit
  stiffness,       // "hard", N/m or Pa/m
  joint,           // "dip direction/dip" in degrees
  text_or_table,   // a name, or a table with the keys below it
  path_or_tables,  // a file, or [[tables]]
  supports,        // list of faces, mesh groups or tables
  section,         // a name, or [x, y]
  velocity,        // a vector, or a speed
  table,
  tables,
  amount,      // a quantity of any dimension
  amounts,     // a list of them
  values,      // a list of values of any kind
  free_table,  // names of the user's own, each a quantity of any dimension
  planned      // an error that says so
};

struct Key {
  std::string path{};  // "block.size"
  Type type = Type::text;
  Dimension dimension{};
  std::string fallback{};  // as it would stand in the file; empty: none
  std::string doc{};
  std::string required{};  // when it must be there: "always" is checked by validate(), other conditions by
                           // read_scene()
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
  bool above = false;  // min itself is not allowed
  bool below = false;  // max itself is not allowed
  std::vector<std::string> choices{};
  std::string otherwise{};  // a default that read_scene() does not fill in: what stands for the key when it
                            // is left out
  std::string source{};     // where the number or the rule comes from
  Dimension first{};        // pair_list
};

const std::vector<Key>& keys();
const Key* find_key(const std::string& path);
/// The keys directly below a table ("" for the root), in the order of the table.
std::vector<std::string> keys_below(const std::string& table);

/// "text", "length in m", "[x, y, z], velocity in m/s", ...
std::string type_text(const Key& key);
/// "> 0", "0 to 1", "" if there is no bound.
std::string range_text(const Key& key);

/// The key that a user's own path means: "block.B1.size" is block.size; null: none.
const Key* key_of_path(const std::string& path);
/// What `talus explain KEY` prints. Also for a table, and for a user's own path such as "block.B1.size".
/// Throws InputError that names the nearest key.
std::string explain(const std::string& key);
/// docs/scene.md.
std::string scene_markdown();
/// All keys, one a line, for a listing and for shell completion.
std::vector<std::string> all_keys();

}  // namespace talus::scene
