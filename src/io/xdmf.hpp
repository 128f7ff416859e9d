/// results.xdmf: the fields of results.h5 for ParaView and other readers of XDMF 3, with true times.
#pragma once
#include <string>
#include <vector>

namespace talus::io {

/// What the frame group /fields/NNNNNN of results.h5 holds.
struct XdmfFrame {
  double time = 0;
  std::string group;                                   // "/fields/000012"
  std::size_t points = 0, polygons = 0, topology = 0;  // blocks: points, faces, length of the topology array
  struct Part {
    std::string name;  // as in the file
    std::size_t nodes = 0, hexes = 0;
    bool displacement = false, velocity = false, damage_tension = false, damage_compression = false,
         stress = false, crack_width = false;
  };
  std::vector<Part> structures;
};

struct XdmfTerrain {
  std::size_t vertices = 0, triangles = 0;
};

std::string xdmf_text(const std::vector<XdmfFrame>& frames, const XdmfTerrain& terrain);

}  // namespace talus::io
