/// The scene's rock mass as the cutter takes it.
#pragma once
#include <algorithm>
#include <string>

#include "geometry/cut.hpp"
#include "geometry/terrain.hpp"
#include "scene/scene.hpp"

namespace talus::sim {

/// `terrain`: the scene's, out of which the mass may be cut.
inline geometry::CutSpec cut_spec(const scene::RockMass& mass, const geometry::Terrain* terrain) {
  geometry::CutSpec spec;
  if (mass.from_terrain && terrain != nullptr) {
    spec.mass = terrain->taken_out;
  } else {
    spec.region = mass.region;
    spec.box = mass.box;
  }
  spec.least_volume = mass.least_volume;
  for (const scene::JointSet& j : mass.joint_sets) {
    geometry::CutJointSet s;
    s.name = j.name;
    s.dip_direction = j.dip_direction;
    s.dip = j.dip;
    s.spacing = j.spacing;
    s.origin = j.origin;
    s.persistence = j.persistence;
    s.fisher = j.fisher;
    s.spacing_distribution = j.spacing_distribution;
    s.spacing_deviation = j.spacing_deviation;
    s.seed = j.seed;
    s.bond_tension = j.bond_tension;
    s.bond_shear = j.bond_shear;
    spec.joint_sets.push_back(std::move(s));
  }
  for (const scene::Joint& j : mass.joints) {
    geometry::CutJoint s;
    s.name = j.name;
    s.dip_direction = j.dip_direction;
    s.dip = j.dip;
    s.through = j.through;
    s.radius = j.radius;
    s.polygon = j.polygon;
    s.bond_tension = j.bond_tension;
    s.bond_shear = j.bond_shear;
    spec.joints.push_back(std::move(s));
  }
  return spec;
}

/// True if the block is one that was cut from the rock mass, by its name.
inline bool is_cut_from_mass(const scene::Scene& scene, const std::string& name) {
  if (!scene.rock_mass || !scene.rock_mass->blocks.empty()) return false;
  const std::string& prefix = scene.rock_mass->block_prefix;
  return name.starts_with(prefix) &&
         name.find_first_not_of("0123456789", prefix.size()) == std::string::npos &&
         std::none_of(scene.blocks.begin(), scene.blocks.end(),
                      [&](const scene::Block& b) { return b.name == name; });
}

}  // namespace talus::sim
