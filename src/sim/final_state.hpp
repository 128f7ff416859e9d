/// What a run hands on to a later one (key simulation.initial_state): the last state of blocks and structures
/// by name, and of the contacts between them.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/types.hpp"
#include "coupling/environment.hpp"

namespace talus::sim {

struct FinalState {
  struct Block {
    Vec3 c, v, w;
    Quat q;
    Vec6 eps, eps_rate;
  };  // as dda::State
  struct Structure {
    std::vector<Vec3> nodes;      // reference positions: the mesh this history belongs to [m]
    std::vector<double> history;  // Structure::save
    /// Where its cells were halved before blocks struck, in the order of their finding.
    struct Halved {
      StructureSpec::Refinement zone;
      double energy = 0;  // of the block [J]
    };
    std::vector<Halved> halved;
  };
  /// Whatever may be touched: a block, a structure, a plane, the terrain. A later run knows it again by its
  /// name and its undeformed form.
  struct Body {
    std::string name;       // "block B", "structure wall", "plane", "terrain"
    std::int64_t form = 0;  // hash of its geometry
    bool operator==(const Body&) const = default;
  };
  /// What a body remembers of a contact with another; both by their place in `bodies`, which stands for the
  /// memory's own `partner`.
  struct Contact {
    std::int64_t body = 0, partner = 0;
    coupling::ContactMemory memory;
  };
  std::map<std::string, Block> blocks;
  std::map<std::string, Structure> structures;
  std::vector<Body> bodies;  // empty: of method dda-1988, which hands on no contacts
  std::vector<Contact> contacts;
};

}  // namespace talus::sim
