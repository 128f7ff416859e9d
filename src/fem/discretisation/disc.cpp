#include "fem/discretisation/disc.hpp"

#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/tria.h>

namespace talus::fem {

DiscMesh disc_mesh(int levels) {
  dealii::Triangulation<2> disc;
  dealii::GridGenerator::hyper_ball(disc, dealii::Point<2>(), 0.5);
  disc.refine_global(static_cast<unsigned>(levels));
  DiscMesh mesh;
  std::vector<int> number(disc.n_vertices(), -1);
  for (const auto& cell : disc.active_cell_iterators()) {
    static const unsigned around[4] = {0, 1, 3, 2};  // deal.II numbers vertices lexicographically
    std::array<int, 4> quad;
    for (int a = 0; a < 4; ++a) {
      const unsigned v = cell->vertex_index(around[a]);
      if (number[v] < 0) {
        number[v] = static_cast<int>(mesh.nodes.size());
        mesh.nodes.push_back({disc.get_vertices()[v][0], disc.get_vertices()[v][1]});
      }
      quad[static_cast<std::size_t>(a)] = number[v];
    }
    mesh.quads.push_back(quad);
  }
  return mesh;
}

}  // namespace talus::fem
