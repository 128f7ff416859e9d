#include "sim/builder.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/names.hpp"
#include "geometry/block_output.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/precision.hpp"
#include "geometry/shape.hpp"
#include "geometry/stated_unit.hpp"
#include "scene/fragment_names.hpp"
#include "sim/held_points.hpp"
#include "sim/rock_mass.hpp"

namespace talus::sim {
namespace {

geometry::ShapeSpec shape_spec(const scene::Shape& s, double density) {
  geometry::ShapeSpec g;
  g.kind = s.kind;
  g.size = s.size;
  g.diameter = s.diameter;
  g.longitudes = s.longitudes;
  g.latitudes = s.latitudes;
  g.vertices = s.vertices;
  g.file = s.file;
  g.volume = s.volume;
  g.mass = s.mass;
  g.density = density;
  g.seed = s.seed;
  g.aspect = s.aspect;
  return g;
}

/// Kelvin-Voigt time so that the slowest strain mode of the block has this ratio of critical damping.
constexpr double strain_damping_ratio = 0.02;

/// STL files and most PLY files hold single precision: of coordinates of a map it keeps centimetres to half a
/// metre.
std::vector<Problem> rounded_shape(const scene::Block& b, const geometry::Shape& shape) {
  constexpr double allowed = 1e-4;  // of the size
  if (b.shape.file.empty() || !geometry::holds_single_precision(b.shape.file)) return {};
  const double step = geometry::single_precision_step(shape.shift.cwiseAbs().maxCoeff());
  if (step <= allowed * shape.body.radius) return {};
  return {
      {.severity = Problem::Severity::warning,
       .file = b.shape.file,
       .key = "block." + b.name + ".file",
       .value = fmt::format("centroid at [{:.7g}, {:.7g}, {:.7g}]", shape.shift.x(), shape.shift.y(),
                            shape.shift.z()),
       .rule = fmt::format("this file keeps seven digits, here steps of {:.2g} m: the shape of a block of "
                           "radius {:.3g} m is rounded to them",
                           step, shape.body.radius),
       .remedy = "export it about a local origin, or as OBJ with all digits, or PLY with property double"}};
}

/// A unit that the file of a shape names, where nothing else gives the block's size.
std::vector<Problem> other_unit(const scene::Block& b) {
  if (b.shape.file.empty() || b.shape.mass > 0 || b.shape.volume > 0) return {};
  const geometry::StatedUnit unit = geometry::stated_unit(b.shape.file);
  if (unit.name.empty()) return {};
  return {{.severity = Problem::Severity::warning,
           .file = b.shape.file,
           .key = "block." + b.name + ".file",
           .value = unit.name,
           .rule = "is the unit that the head of the file names, and its numbers are taken as metres",
           .remedy = fmt::format("scale it by {:g} in the program that made it, or give the block's mass or "
                                 "volume",
                                 unit.metres)}};
}

}  // namespace

void Builder::push(dda::Model::Block b, const Vec3& c, const Mat3& rotation, const Vec3& v, const Vec3& w) {
  if (!names_.insert(b.name).second)
    problem("block." + b.name, b.name, "another block or a structure has this name",
            "rename one, so that it is plain which struck which: copies of a release area are called NAME-1, "
            "NAME-2, ..., imported blocks as their "
            "groups");
  dda::State& s = state_.blocks;
  s.c.push_back(c);
  s.v.push_back(v);
  s.w.push_back(w);
  s.q.push_back(Quat(rotation).normalized());
  s.eps.push_back(Vec6::Zero());
  s.eps_rate.push_back(Vec6::Zero());
  model_.blocks.push_back(std::move(b));
}

dda::Model::Block Builder::make_block(const std::string& name, Polyhedron shape, int material,
                                      bool deformable) {
  const scene::Material& m = world_->scene.materials[static_cast<std::size_t>(material)];
  const geometry::MassProperties properties = geometry::mass_properties(shape, m.density);
  constexpr double least_volume = 1e-9;  // [m^3] a millimetre cubed
  if (properties.volume < least_volume) {
    Problem tiny;
    tiny.severity = Problem::Severity::warning;
    tiny.key = "block." + name;
    tiny.value = fmt::format("{:.3g} m^3", properties.volume);
    tiny.rule = "is smaller than a cubic millimetre";
    tiny.remedy = "lengths are metres: check the size and its unit";
    add_warnings({tiny});
  }
  dda::Model::Block b;
  b.name = name;
  b.mass = properties.mass;
  b.volume = properties.volume;
  b.second_moment = properties.second_moment;
  b.inertia = properties.inertia();
  b.material = material;
  b.deformable = deformable && m.young > 0;
  b.young = m.young;
  b.poisson = m.poisson;
  if (b.deformable) {
    const double omega = M_PI * std::sqrt(m.young / m.density) / (2 * shape.radius);
    b.strain_damping = 2 * strain_damping_ratio / omega;
  }
  b.shape = shapes_.share(std::move(shape));
  return b;
}

/// A point that stays is one of the block, up to a thousandth of its size: beyond it nothing holds the block
/// to the point.
void Builder::check_held(const dda::Model::Block& b, const Vec3& c, const Mat3& rotation, const Vec3& x) {
  const Vec3 at = rotation.transpose() * (x - c), near = nearest_of(*b.shape, at),
             world = (c + rotation * near).unaryExpr([&](double v) {
               return std::abs(v) < 1e-9 * b.shape->radius ? 0.0 : v;
             });
  const double outside = (near - at).norm();
  if (outside <= 1e-3 * b.shape->radius) return;
  problem(fmt::format("block.{}.fixed_points", b.name),
          fmt::format("[{:g}, {:g}, {:g}]", x.x(), x.y(), x.z()),
          fmt::format("lies {:.4g} m outside of the block", outside),
          fmt::format("give points of the block in world coordinates at t = 0; the nearest one of it is "
                      "[{:.6g}, {:.6g}, {:.6g}]",
                      world.x(), world.y(), world.z()));
}

RigidMotion Builder::held_start(const dda::Model::Block& b, const Mat3& rotation, const RigidMotion& given) {
  std::vector<Vec3> arms;
  double fastest = 0;
  for (const Vec3& x : b.fixed_points) {
    arms.push_back(rotation * x);
    fastest = std::max(fastest, (given.v + given.w.cross(arms.back())).norm());
  }
  if (b.fixed || fastest <= 1e-12 * (given.v.norm() + b.shape->radius * given.w.norm())) return given;
  const Mat3 inertia = rotation * b.inertia * rotation.transpose();
  const RigidMotion motion = held_motion(b.mass, inertia, arms, given);
  const auto energy = [&](const RigidMotion& m) {
    return 0.5 * (b.mass * m.v.squaredNorm() + m.w.dot(inertia * m.w));
  };
  const auto text = [](const Vec3& v) {
    return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z());
  };
  const double before = energy(given), lost = before - energy(motion);
  if (lost > 1e-6 * before)  // less is the rounding of what was written
    add_warnings(
        {{.severity = Problem::Severity::warning,
          .file = {},
          .key = fmt::format("block.{}.velocity", b.name),
          .value = fmt::format("{}, spin {}", text(given.v), text(given.w)),
          .rule = fmt::format("moves its fixed points, by up to {:.3g} m/s: it starts with velocity {} and "
                              "spin {}, as if it were caught there, {:.3g} % of its kinetic energy less",
                              fastest, text(motion.v), text(motion.w), 100 * lost / before),
          .remedy = "about a fixed point at x, velocity = spin x (position - x)"}});
  return motion;
}

void Builder::add_block(const scene::Block& b) {
  try {
    const double density = world_->scene.materials[static_cast<std::size_t>(b.material)].density;
    geometry::Shape shape = geometry::make_shape_with_shift(shape_spec(b.shape, density));
    add_warnings(rounded_shape(b, shape));
    add_warnings(other_unit(b));
    if (b.release) {
      if (!ground_failed_) add_copies(b, shape.body);
      return;
    }
    dda::Model::Block block = make_block(b.name, std::move(shape.body), b.material, b.deformable);
    const Vec3 c = b.position ? *b.position : shape.shift;
    block.fixed = b.fixed;
    for (const Vec3& x : b.fixed_points) {
      check_held(block, c, b.rotation, x);
      block.fixed_points.push_back(b.rotation.transpose() * (x - c));
      block.fixed_points_world.push_back(x);
    }
    const RigidMotion motion = held_start(block, b.rotation, {b.velocity, b.spin});
    push(std::move(block), c, b.rotation, motion.v, motion.w);
  } catch (const InputError& e) {
    for (Problem p : e.problems()) {
      if (p.file.empty()) p.file = world_->scene.file;
      p.key = fmt::format("block.{}{}{}", b.name, p.key.empty() ? "" : ".", p.key);
      problems_.push_back(std::move(p));
    }
  }
}

void Builder::add_copies(const scene::Block& b, const Polyhedron& body) {
  if (b.release->at) {
    const Vec3 c = place_above(*b.release, body, b.rotation, world_->scene, terrain_.get());
    push(make_block(b.name, body, b.material, b.deformable), c, b.rotation, b.velocity, b.spin);
    return;
  }
  int serial = 0;
  for (const auto& [c, rotation] :
       release_places(*b.release, body, world_->scene, terrain_.get(), world_->header.crs, occupied_))
    push(make_block(fmt::format("{}-{}", b.name, ++serial), body, b.material, b.deformable), c, rotation,
         b.velocity, b.spin);
}

void Builder::add_rock_mass() {
  const auto& mass = world_->scene.rock_mass;
  if (!mass || (mass->from_terrain && !terrain_)) return;  // that it cannot be had is told already
  geometry::CutResult cut;
  try {
    if (!mass->blocks.empty()) return add_block_system(*mass);
    geometry::CutSpec spec = cut_spec(*mass, terrain_.get());
    spec.report = world_->report;
    cut = geometry::cut(spec);
  } catch (const InputError& e) {
    add_problems(e.problems());
    return;
  }
  for (const Problem& w : cut.warnings) world_->scene.warnings.push_back(w);
  const int first = static_cast<int>(model_.blocks.size());
  int serial = 0;
  for (geometry::CutBlock& b : cut.blocks)
    push(make_block(fmt::format("{}{}", mass->block_prefix, ++serial), std::move(b.body), mass->material,
                    mass->deformable),
         b.centroid, Mat3::Identity(), Vec3::Zero(), Vec3::Zero());
  const ContactLaw& law = world_->scene.laws(mass->material, mass->material);
  bool own = false;
  for (const scene::JointSet& j : mass->joint_sets) {
    std::optional<ContactLaw> joint;
    if (j.friction || j.cohesion || j.tension) {
      joint = law;
      joint->friction = j.friction.value_or(law.friction);
      joint->cohesion = j.cohesion.value_or(law.cohesion);
      joint->tension = j.tension.value_or(law.tension);
      own = true;
    }
    env_.joint_laws.push_back(joint);
  }
  if (!own) env_.joint_laws.clear();
  for (const geometry::CutInterface& i : cut.interfaces)
    if (i.bonded_area > 0 && i.area > 0)
      env_.bonds.push_back({first + i.a, first + i.b, i.joint, i.shear * i.bonded_area / i.area,
                            i.tension * i.bonded_area / i.area});
  world_->notes.push_back(
      fmt::format("Rock mass: {} blocks cut from {:.6g} m^3, {} slivers merged, {} rock bridges.",
                  cut.blocks.size(), cut.region_volume, cut.merged, env_.bonds.size()));
}

void Builder::add_block_system(const scene::RockMass& mass) {
  double volume = 0;
  std::vector<geometry::NamedBlock> blocks = geometry::read_block_system(mass.blocks);
  for (geometry::NamedBlock& b : blocks) {
    volume += b.volume;
    if (const std::string structure = scene::structure_of_fragment(world_->scene, b.name); !structure.empty())
      problems_.push_back({.file = mass.blocks,
                           .line = geometry::group_line(mass.blocks, b.name),
                           .key = "group",
                           .value = b.name,
                           .rule = fragment_name_rule(structure),
                           .remedy = fragment_name_remedy});
    push(make_block(b.name, std::move(b.body), mass.material, mass.deformable), b.centroid, Mat3::Identity(),
         Vec3::Zero(), Vec3::Zero());
  }
  world_->notes.push_back(
      fmt::format("Rock mass: {} blocks of {:.6g} m^3, read from {}.", blocks.size(), volume, mass.blocks));
}

}  // namespace talus::sim
