/// Explicit sub-steps follow only the part of a skin that the blocks can come near before it is chosen anew:
/// of a viaduct under one boulder a few faces in a hundred.
#pragma once
#include <cstdint>
#include <vector>

#include "coupling/step/step.hpp"

namespace talus::coupling {

class SurfaceFocus {
 public:
  SurfaceFocus(const IslandContext& in, const Step& step);
  /// Of a macro step: everywhere, or where structures alone go on with what the last one followed.
  void begin();
  /// Before a search with the reach of h: chooses anew what is followed once blocks and skins may have moved
  /// out of it, and says so.
  bool follow(double h);
  void end();
  bool active() const { return followed_ >= 0; }
  /// Bound on how far the skins have moved since the macro step began [m].
  double surface_travel() const { return surface_travel_; }

 private:
  struct Need {
    double blocks, skins;
  };
  struct Seen {
    int block;
    Vec3 c;
    Quat q;
  };
  Need needed(double h, double fastest) const;
  bool serves(const Need& need) const;
  void choose();
  void go_on();

  const IslandContext& in_;
  const Step& step_;
  std::vector<Seen> seen_;  // blocks at structures, where they were when the followed part was chosen
  double followed_ =
      -1;  // how far from those blocks skins are followed, 0 without blocks [m]; negative: everywhere
  double followed_skins_ = 0;                      // how far from each other's faces [m]
  std::vector<std::uint64_t> followed_revisions_;  // of the island's skins as they were chosen
  double surface_path_ = 0;                        // bound on how far the skins have moved since then [m]
  double surface_travel_ = 0;                      // and since the macro step began [m]
};

}  // namespace talus::coupling
