// A hexahedral mesh: Gmsh .msh and Abaqus .inp. Cells and groups name nodes that exist.
#include "fem/discretisation/hex_mesh.hpp"
#include "fuzz_input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace talus;
  const fuzz::Input input(data, size);
  StructureSpec spec;
  spec.name = std::string(1, 'S');  // an assignment of "S" makes GCC 12 warn of a copy that overlaps
  spec.file = fuzz::file(input.choice % 2 == 0 ? "mesh.msh" : "mesh.inp", input.bytes);
  fuzz::read_or_refuse([&] {
    const fem::HexMesh mesh = fem::read_mesh(spec);
    const int n = static_cast<int>(mesh.nodes.size());
    for (const auto& hex : mesh.hexes)
      for (const int v : hex) fuzz::require(v >= 0 && v < n, "a cell names nodes that exist");
    for (const auto& [name, nodes] : mesh.node_groups)
      for (const int v : nodes) fuzz::require(v >= 0 && v < n, "a group names nodes that exist");
    for (const Vec3& v : mesh.nodes) fuzz::require(v.allFinite(), "coordinates are finite");
  });
  return 0;
}
