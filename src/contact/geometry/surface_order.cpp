#include "contact/geometry/surface_order.hpp"

#include "contact/geometry/bvh_tree.hpp"

namespace talus::contact {

void put_in_search_order(TriangleSurface& s) {
  BoxTree tree;
  tree.build(static_cast<int>(s.triangles.size()), [&](int t) {
    const auto& v = s.triangles[static_cast<std::size_t>(t)];
    Box3 box(s.vertices[v[0]]);
    box.extend(s.vertices[v[1]]);
    box.extend(s.vertices[v[2]]);
    return box;
  });
  TriangleSurface sorted;
  sorted.triangles.reserve(s.triangles.size());
  sorted.vertices.reserve(s.vertices.size());
  std::vector<int> number(s.vertices.size(), -1);
  for (const int t : tree.order()) {
    std::array<int, 3> corners = s.triangles[static_cast<std::size_t>(t)];
    for (int& v : corners) {
      int& n = number[static_cast<std::size_t>(v)];
      if (n < 0) {
        n = static_cast<int>(sorted.vertices.size());
        sorted.vertices.push_back(s.vertices[static_cast<std::size_t>(v)]);
      }
      v = n;
    }
    sorted.triangles.push_back(corners);
    if (!s.material.empty()) sorted.material.push_back(s.material[static_cast<std::size_t>(t)]);
  }
  s.triangles.swap(sorted.triangles);
  s.vertices.swap(sorted.vertices);
  s.material.swap(sorted.material);
}

}  // namespace talus::contact
