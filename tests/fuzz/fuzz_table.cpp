// Tables of numbers that a scene names: bars of reinforcement, the points of a contact law, trajectories that
// end at a structure. Each is read or refused with InputError; what is read is finite and of the order that
// its users rely on.
#include <cmath>
#include <set>

#include "fem/rebar/rebar_geometry.hpp"
#include "fuzz_input.hpp"
#include "scene/scene.hpp"

namespace {

using namespace talus;

constexpr const char* head = R"(
schema = 1
[simulation]
duration = "0.2 s"
[[material]]
name = "rock"
density = 2500
[[material]]
name = "C40"
f_cm = "48 MPa"
)";
constexpr const char* law = R"(
[[interface]]
between = ["*", "*"]
friction = 0.5
normal_stiffness = "1 GN/m"
contact_law = { kind = "table", file = "table.csv" }
)";
constexpr const char* any = R"(
[[interface]]
between = ["*", "*"]
friction = 0.5
[[structure]]
name = "P1"
kind = "box"
material = "C40"
position = [0, 0, 0]
size = [2, 2, 8]
cell_size = 1
support = ["-z"]
)";
constexpr const char* block = R"(
[[plane]]
point = [0, 0, 0]
normal = [0, 0, 1]
material = "C40"
[[block]]
name = "A"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 3]
)";
constexpr const char* impact = R"(
[impact]
material = "rock"
shape = "EOTA111"
trajectories = "table.csv"
row = 1
)";

void bars(std::string_view bytes) {
  std::set<std::string> names;
  for (const rebar::Bar& bar : rebar::parse_bars(std::string(bytes), "bars.csv")) {
    fuzz::require(names.insert(bar.name).second, "a name belongs to one bar");
    fuzz::require(bar.diameter > 0 && bar.diameter <= 0.2, "a diameter is one of a bar");
    fuzz::require(bar.points.size() >= 2, "a bar has two ends");
    for (const Vec3& p : bar.points) fuzz::require(p.allFinite(), "coordinates are finite");
  }
}

scene::Scene scene_with(const std::string& parts, std::string_view bytes) {
  fuzz::file("table.csv", bytes);
  return scene::read_scene_text(head + parts, (fuzz::directory() / "scene.toml").string());
}

void contact_law(std::string_view bytes) {
  const scene::Scene scene = scene_with(std::string(law) + block, bytes);
  const auto& table = scene.laws(0, 1).table;
  fuzz::require(table.size() >= 2 && table[0] == std::pair(0.0, 0.0), "a law starts at 0, 0");
  for (std::size_t i = 1; i < table.size(); ++i)
    fuzz::require(std::isfinite(table[i].first) && std::isfinite(table[i].second) &&
                      table[i].first > table[i - 1].first && table[i].second >= table[i - 1].second,
                  "a law grows");
}

void trajectory(std::string_view bytes) {
  const scene::Scene scene = scene_with(std::string(any) + impact, bytes);
  fuzz::require(scene.impact && scene.impact->point.allFinite() && scene.impact->velocity.allFinite(),
                "a trajectory is finite");
  fuzz::require(scene.impact->velocity.norm() > 0, "a trajectory moves");
  fuzz::require(scene.impact->shape.mass > 0 || scene.impact->shape.volume > 0, "what moves has a size");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Input input(data, size);
  fuzz::read_or_refuse([&] {
    if (input.choice % 3 == 0)
      bars(input.bytes);
    else if (input.choice % 3 == 1)
      contact_law(input.bytes);
    else
      trajectory(input.bytes);
  });
  return 0;
}
