#include "contact/structures/structure.hpp"

#include <memory>
#include <utility>

namespace talus {

Structure::Snapshot Structure::snapshot() const {
  Snapshot all;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  const TakePart take = [&](const Snapshot& part) {
    append(all.nodes, part.nodes), append(all.hexes, part.hexes), append(all.bars, part.bars);
    append(all.displacement, part.displacement), append(all.velocity, part.velocity);
    append(all.damage_tension, part.damage_tension), append(all.damage_compression, part.damage_compression);
    append(all.stress_von_mises, part.stress_von_mises), append(all.crack_width, part.crack_width);
    append(all.bar_points, part.bar_points), append(all.bar_strain, part.bar_strain);
    append(all.bar_stress, part.bar_stress), append(all.bar_state, part.bar_state);
  };
  shape(take);
  values(take);
  return all;
}

std::vector<Vec3> Structure::built_nodes() const {
  std::vector<Vec3> all;
  shape([&](const Snapshot& part) { all.insert(all.end(), part.nodes.begin(), part.nodes.end()); });
  return all;
}

Structure::Fields Structure::fields() const {
  return {[this](const TakePart& take) { shape(take); }, [this](const TakePart& take) { values(take); }};
}

Structure::Fields Structure::fields(Snapshot snapshot) {
  const auto give = [kept = std::make_shared<const Snapshot>(std::move(snapshot))](const TakePart& take) {
    take(*kept);
  };
  return {give, give};
}

}  // namespace talus
