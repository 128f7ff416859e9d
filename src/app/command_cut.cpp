// talus cut: block cutting alone.
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/progress.hpp"
#include "app/tell.hpp"
#include "core/text_file.hpp"
#include "geometry/block_output.hpp"
#include "geometry/cut.hpp"
#include "io/files.hpp"
#include "sim/ground.hpp"
#include "sim/rock_mass.hpp"

namespace talus::app {

namespace fs = std::filesystem;

int command_cut(const Options& options) {
  const scene::Scene scene = scene::read_scene(options.input, options.overrides());
  if (!scene.rock_mass) {
    Problem problem;
    problem.file = options.input;
    problem.key = "rock_mass";
    problem.rule = "the scene has no [rock_mass]";
    problem.remedy = "add [rock_mass] with a region or box and joint sets: see talus explain rock_mass";
    throw InputError(problem);
  }
  const fs::path directory = options.output;
  io::check_directory(directory, io::Results::other);
  for (const Problem& warning : scene.warnings) tell("{}\n", warning.str());
  const scene::RockMass& mass = *scene.rock_mass;
  BuildProgress progress;
  const auto report = [&](const std::string& line) { progress.show(line); };
  const std::optional<geometry::Terrain> terrain = sim::load_ground(scene, report);
  geometry::CutSpec spec = sim::cut_spec(mass, terrain ? &*terrain : nullptr);
  spec.report = report;
  const geometry::CutResult cut = geometry::cut(spec);
  for (const Problem& warning : cut.warnings) tell("{}\n", warning.str());

  // Removability needs the strength of each joint: the set's own where it is given, else the law of the rock
  // against itself.
  const ContactLaw& law = scene.laws(mass.material, mass.material);
  geometry::KeyBlockOptions keys;
  keys.gravity = scene.simulation.gravity;
  keys.density = scene.materials[static_cast<std::size_t>(mass.material)].density;
  for (const scene::JointSet& s : mass.joint_sets)
    keys.strength.push_back(
        {std::atan(s.friction.value_or(law.friction)), s.cohesion.value_or(law.cohesion)});
  for (std::size_t i = 0; i < mass.joints.size(); ++i)
    keys.strength.push_back({std::atan(law.friction), law.cohesion});
  // The last for rock outside the region.
  const ContactLaw& bed = mass.from_terrain ? scene.laws(mass.material, mass.bed_material) : law;
  keys.strength.push_back({std::atan(bed.friction), bed.cohesion});
  // A face closer to the ground than this, along its normal, rests on it.
  const double reach = 1e-3 * std::cbrt(cut.region_volume);
  keys.is_held = [reach, in_ground = sim::ground_of(terrain ? &terrain->surface : nullptr, scene.planes)](
                     const Vec3& point, const Vec3& normal) { return in_ground(point + reach * normal); };
  const std::vector<geometry::KeyBlock> key_blocks = geometry::key_blocks(cut, keys);

  const io::DirectoryLock lock = io::claim_directory(directory, io::Results::other);
  const auto file = [&](const char* name) { return (directory / name).string(); };
  geometry::write_mesh(file("blocks.obj"), geometry::block_system(cut, mass.block_prefix));
  geometry::write_blocks_vtu(file("blocks.vtu"), cut, key_blocks);
  geometry::write_blocks_csv(file("blocks.csv"), cut, mass.block_prefix, key_blocks);
  geometry::write_interfaces_csv(file("interfaces.csv"), cut, mass.block_prefix);
  const geometry::SizeCurve curve = geometry::size_curve(cut);
  geometry::write_size_curve_csv(file("sizes.csv"), curve);
  write_bytes(file("sizes.svg"), geometry::size_curve_svg(curve));
  geometry::StereonetOptions net;
  net.friction = std::atan(law.friction);
  write_bytes(file("stereonet.svg"), geometry::stereonet_svg(spec, cut, net));

  double sum = 0;
  for (const geometry::CutBlock& block : cut.blocks) sum += block.volume;
  fmt::print("{} blocks, {:.6g} m^3 of {:.6g} m^3 (difference {:.1e} of it), {} merged\n", cut.blocks.size(),
             sum, cut.region_volume, std::abs(sum - cut.region_volume) / cut.region_volume, cut.merged);
  fmt::print("Volumes that 25, 50, 75 and 90 % pass: {:.4g}, {:.4g}, {:.4g}, {:.4g} m^3\n", curve.v25,
             curve.v50, curve.v75, curve.v90);
  std::map<std::string, int> types;
  for (const geometry::KeyBlock& key : key_blocks) ++types[geometry::name_of(key.type)];
  for (const auto& [type, count] : types) fmt::print("{}: {}\n", type, count);
  fmt::print("Results: {}\n", directory.string());
  return done;
}

}  // namespace talus::app
