#include "geometry/terrain.hpp"
namespace talus::geometry {
void decimate(std::vector<Vec3>&, std::vector<std::array<int, 3>>&, double error, double&) {
  throw InputError(Problem{.key = "site.decimation_error", .value = std::to_string(error), .rule = "decimation is not ready yet", .remedy = "leave the key out"});
}
}
