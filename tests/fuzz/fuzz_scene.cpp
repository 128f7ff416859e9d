// A scene, TOML or JSON: every text is read or refused with InputError, and what is read comes back from its
// resolved form.
#include "core/error.hpp"
#include "fuzz_input.hpp"
#include "scene/scene.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace talus;
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::string resolved;
  try {
    resolved = scene::read_scene_text(text, "/nowhere/scene.toml").resolved_json;
  } catch (const InputError& e) {
    fuzz::require(!e.problems().empty(), "a refusal names a problem");
    return 0;
  }
  try {
    fuzz::require(scene::read_scene_text(resolved, "/nowhere/scene.resolved.json").resolved_json == resolved,
                  "the resolved scene resolves to itself");
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    fuzz::require(false, "the resolved scene is a scene");
  }
  return 0;
}
