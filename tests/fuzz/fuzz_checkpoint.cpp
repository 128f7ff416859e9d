// A checkpoint whose checksum is right and whose arrays are not: the input edits the arrays of a real one. It
// is restored or refused with InputError, never read out of bounds. Choice 0: the file itself, raw.
#include <cstring>
#include <iterator>

#include "fuzz_input.hpp"
#include "io/checkpoint.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace {

using namespace talus;

constexpr const char* scene_text = R"(
schema = 1
[simulation]
duration = "0.2 s"
threads = 1
[[plane]]
point = [0, 0, 0]
normal = [0, 0, 1]
material = "slope"
[[material]]
name = "rock"
density = 2500
[[interface]]
between = ["rock", "slope"]
friction = 0.5
[[interface]]
between = ["rock", "rock"]
friction = 0.5
[[block]]
name = "A"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 0.5]
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0.2, 0.1, 1.5]
)";

sim::Simulation simulation() {
  return sim::Simulation(scene::read_scene_text(scene_text, "/nowhere/scene.toml"));
}

const sim::Checkpoint& real() {
  static const sim::Checkpoint one = [] {
    sim::Simulation s = simulation();
    sim::Sink none;
    s.run(none);
    return s.save();
  }();
  return one;
}

/// Edits of 11 bytes each: which array, what to do, where, a value.
void edit(sim::Checkpoint& c, std::string_view bytes) {
  for (; bytes.size() >= 11; bytes.remove_prefix(11)) {
    const auto array = static_cast<unsigned char>(bytes[0]), what = static_cast<unsigned char>(bytes[1]),
               at = static_cast<unsigned char>(bytes[2]);
    std::int64_t integer = 0;
    double number = 0;
    std::memcpy(&integer, bytes.data() + 3, 8);
    std::memcpy(&number, bytes.data() + 3, 8);
    const auto apply = [&](auto& arrays, std::size_t i, auto value) {
      auto it = std::next(arrays.begin(), static_cast<std::ptrdiff_t>(i));
      auto& values = it->second;
      if (what % 4 == 0)
        arrays.erase(it);
      else if (what % 4 == 1)
        values.resize(at);
      else if (what % 4 == 2)
        values.push_back(value);
      else if (!values.empty())
        values[at % values.size()] = value;
    };
    const std::size_t n = c.numbers.size(), all = n + c.integers.size() + 1;
    if (const std::size_t k = array % all; k < n)
      apply(c.numbers, k, number);
    else if (k + 1 < all)
      apply(c.integers, k - n, integer);
    else
      c.fragment_names.push_back("F");
    if (c.numbers.empty() || c.integers.empty()) return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Input input(data, size);
  fuzz::read_or_refuse([&] {
    if (input.choice == 0) {
      (void)io::load_checkpoint(fuzz::file("checkpoint.h5", input.bytes), "hash", "version");
      return;
    }
    sim::Checkpoint c = real();
    edit(c, input.bytes);
    sim::Simulation s = simulation();
    s.restore(c);
    (void)s.save();
  });
  return 0;
}
