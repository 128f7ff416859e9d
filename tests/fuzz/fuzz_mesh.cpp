// A surface mesh in each of its formats. Indices of what is read are in range.
#include "fuzz_input.hpp"
#include "geometry/mesh.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace talus;
  static const char* names[] = {"a.obj", "a.stl", "a.ply", "a.off", "a.vtu"};
  const fuzz::Input input(data, size);
  const std::string name = names[input.choice % 5];
  fuzz::read_or_refuse([&] {
    const geometry::Mesh mesh = geometry::read_mesh_text(std::string(input.bytes), name);
    for (const auto& t : mesh.triangles)
      for (const int v : t)
        fuzz::require(v >= 0 && v < static_cast<int>(mesh.vertices.size()),
                      "a triangle names vertices that exist");
    for (const Vec3& v : mesh.vertices) fuzz::require(v.allFinite(), "coordinates are finite");
    fuzz::require(mesh.group.empty() || mesh.group.size() == mesh.triangles.size(),
                  "every triangle has its group");
  });
  return 0;
}
