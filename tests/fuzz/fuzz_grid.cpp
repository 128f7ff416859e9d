// A terrain grid (through the raster module, as a run reads it), and the polygons of material areas.
#include "fuzz_input.hpp"
#include "geometry/terrain.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace talus;
  const fuzz::Input input(data, size);
  fuzz::read_or_refuse([&] {
    if (input.choice % 2 == 1) {
      (void)geometry::read_area(fuzz::file("area.geojson", input.bytes), "site.area.polygon")
          .contains(0.5, 0.5);
      return;
    }
    const geometry::Terrain terrain = geometry::load_terrain(fuzz::file("terrain.asc", input.bytes));
    for (const auto& t : terrain.surface.triangles)
      for (const int v : t)
        fuzz::require(v >= 0 && v < static_cast<int>(terrain.surface.vertices.size()),
                      "a triangle names vertices that exist");
    for (const Vec3& v : terrain.surface.vertices) fuzz::require(v.allFinite(), "heights are finite");
  });
  return 0;
}
