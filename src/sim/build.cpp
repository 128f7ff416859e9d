// The only place that decides what exists.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

#include "core/error.hpp"
#include "coupling/touch.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/block_output.hpp"
#include "geometry/shape.hpp"
#include "sim/footing.hpp"
#include "sim/ground.hpp"
#include "sim/rock_mass.hpp"
#include "sim/section.hpp"
#include "sim/world.hpp"

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

/// Alphabetic, runs of digits by their number: B2 before B10. No two different names are equal.
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto run = [&](const std::string& s, std::size_t& at) {   // of digits, without zeros in front
      const std::size_t end = std::find_if_not(s.begin() + static_cast<std::ptrdiff_t>(at), s.end(), digit) - s.begin();
      while (at < end && s[at] == '0') ++at;
      const std::string_view number = std::string_view(s).substr(at, end - at);
      at = end;
      return number;
    };
    const std::string_view x = run(a, i), y = run(b, j);
    if (x != y) return x.size() != y.size() ? x.size() < y.size() : x < y;
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

/// Kelvin-Voigt time so that the slowest strain mode of the block has this ratio of critical damping.
constexpr double strain_damping_ratio = 0.02;

class Builder {
 public:
  Builder(scene::Scene scene, Report report) : world_(std::make_unique<World>()) {
    world_->scene = std::move(scene);
    world_->report = report ? std::move(report) : [](const std::string&) {};
  }

  std::unique_ptr<World> build() {
    const scene::Scene& s = world_->scene;
    model_.gravity = s.simulation.gravity;
    add_terrain();
    for (const scene::Block& b : s.blocks) add_block(b);
    single_blocks_ = model_.blocks.size();
    add_rock_mass();
    refuse_what_is_missing();
    check_ground();
    env_.planes = s.planes;
    env_.laws = s.laws;
    complete_laws();
    if (problems_.empty()) add_structures();
    warn_of_small_blocks();
    pair_structures();
    if (!problems_.empty()) throw InputError(problems_);

    coupling::SystemSettings settings;
    settings.step.fixed_step = s.simulation.step.value_or(0);
    settings.step.accuracy = s.simulation.accuracy.value_or(1e-3);
    settings.step.min_step = s.simulation.min_step;
    settings.step.exchanges_per_rise = s.coupling.exchanges_per_rise;
    settings.sleeping = s.simulation.sleeping;
    settings.threads = std::max(1, s.simulation.threads);
    settings.longest_stretch = std::max(0.05, s.output.history_interval);
    sort_blocks();
    world_->system = std::make_unique<coupling::CoupledSystem>(std::move(model_), std::move(state_), std::move(env_), settings);
    if (const std::vector<Problem> overlaps = initial_overlaps(*world_); !overlaps.empty()) throw InputError(overlaps);
    if (s.simulation.method == scene::Simulation::Method::dda1988) {
      world_->paper.emplace();
      const coupling::Environment& env = world_->system->environment();
      if (env.terrain) world_->paper->surfaces.push_back(env.terrain.get());
      for (const coupling::StructurePart& p : env.structures) world_->paper->surfaces.push_back(p.index.get());
    }
    fill_header();
    return std::move(world_);
  }

 private:
  void problem(std::string key, std::string value, std::string rule, std::string remedy) {
    Problem p;
    p.file = world_->scene.file;
    p.key = std::move(key);
    p.value = std::move(value);
    p.rule = std::move(rule);
    p.remedy = std::move(remedy);
    problems_.push_back(std::move(p));
  }

  void add_problems(const std::vector<Problem>& found) {
    for (Problem p : found) {
      if (p.file.empty()) p.file = world_->scene.file;
      problems_.push_back(std::move(p));
    }
  }

  void add_warnings(const std::vector<Problem>& found) {
    for (Problem p : found) {
      if (p.file.empty()) p.file = world_->scene.file;
      world_->scene.warnings.push_back(std::move(p));
    }
  }

  void push(dda::Model::Block b, const Vec3& c, const Mat3& rotation, const Vec3& v, const Vec3& w) {
    if (!names_.insert(b.name).second)
      problem("block." + b.name, b.name, "two blocks have this name", "rename one: copies of a release area are called NAME-1, NAME-2, ..., imported blocks as their groups");
    dda::State& s = state_.blocks;
    s.c.push_back(c);
    s.v.push_back(v);
    s.w.push_back(w);
    s.q.push_back(Quat(rotation).normalized());
    s.eps.push_back(Vec6::Zero());
    s.eps_rate.push_back(Vec6::Zero());
    model_.blocks.push_back(std::move(b));
  }

  dda::Model::Block make_block(const std::string& name, Polyhedron shape, int material, bool deformable) {
    const scene::Material& m = world_->scene.materials[static_cast<std::size_t>(material)];
    const geometry::MassProperties properties = geometry::mass_properties(shape, m.density);
    constexpr double least_volume = 1e-9;   // [m^3] a millimetre cubed
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
    b.shape = std::make_shared<const Polyhedron>(std::move(shape));
    return b;
  }

  void add_block(const scene::Block& b) {
    try {
      const double density = world_->scene.materials[static_cast<std::size_t>(b.material)].density;
      geometry::Shape shape = geometry::make_shape_with_shift(shape_spec(b.shape, density));
      if (b.release) return add_copies(b, shape.body);
      dda::Model::Block block = make_block(b.name, std::move(shape.body), b.material, b.deformable);
      const Vec3 c = b.position ? *b.position : shape.shift;
      block.fixed = b.fixed;
      for (const Vec3& x : b.fixed_points) {
        block.fixed_points.push_back(b.rotation.transpose() * (x - c));
        block.fixed_points_world.push_back(x);
      }
      push(std::move(block), c, b.rotation, b.velocity, b.spin);
    } catch (const InputError& e) {
      for (Problem p : e.problems()) {
        if (p.file.empty()) p.file = world_->scene.file;
        p.key = fmt::format("block.{}{}{}", b.name, p.key.empty() ? "" : ".", p.key);
        problems_.push_back(std::move(p));
      }
    }
  }

  void add_copies(const scene::Block& b, const Polyhedron& body) {
    int serial = 0;
    for (const auto& [c, rotation] : release_places(*b.release, body, world_->scene, terrain_ ? &*terrain_ : nullptr, occupied_))
      push(make_block(fmt::format("{}-{}", b.name, ++serial), body, b.material, b.deformable), c, rotation, b.velocity, b.spin);
  }

  /// Keys that the scene format has and this version cannot honour: an error each, never a silent drop.
  void refuse_what_is_missing() {
    const scene::Scene& s = world_->scene;
    const auto missing = [&](const std::string& key, const std::string& value, const std::string& remedy) {
      problem(key, value, "is not there yet in this version", remedy);
    };
    if (s.simulation.method == scene::Simulation::Method::dda1988) return;   // its plan says what it leaves out
    const int n = s.laws.materials;
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) {
        const ContactLaw& law = s.laws(i, j);
        const std::string key = fmt::format("interface.{}/{}.", s.materials[static_cast<std::size_t>(i)].name, s.materials[static_cast<std::size_t>(j)].name);
        const bool deforms = s.coupling.scheme == scene::Coupling::Scheme::two_way &&
                             std::any_of(s.structures.begin(), s.structures.end(), [&](const StructureSpec& q) { return q.material == i || q.material == j; });
        if (law.rolling_resistance > 0 && deforms)
          missing(key + "rolling_resistance", fmt::format("{:g}", law.rolling_resistance), "leave it out where a block meets a deformable structure");
      }
  }

  /// Blocks in the order of their names, whatever the scene's: sums and searches then go the same way however the blocks are listed.
  void sort_blocks() {
    const std::size_t n = model_.blocks.size();
    std::vector<int> sorted(n);
    std::iota(sorted.begin(), sorted.end(), 0);
    std::sort(sorted.begin(), sorted.end(), [&](int a, int b) { return natural_less(model_.blocks[static_cast<std::size_t>(a)].name, model_.blocks[static_cast<std::size_t>(b)].name); });
    std::vector<int>& place = world_->place;
    place.resize(n);
    dda::Model model{.blocks = {}, .gravity = model_.gravity};
    dda::State state;
    for (const int from : sorted) {
      const auto k = static_cast<std::size_t>(from);
      place[k] = static_cast<int>(model.blocks.size());
      model.blocks.push_back(std::move(model_.blocks[k]));
      const dda::State& s = state_.blocks;
      state.c.push_back(s.c[k]);
      state.v.push_back(s.v[k]);
      state.w.push_back(s.w[k]);
      state.q.push_back(s.q[k]);
      state.eps.push_back(s.eps[k]);
      state.eps_rate.push_back(s.eps_rate[k]);
    }
    world_->order = std::move(sorted);
    model_ = std::move(model);
    state_.blocks = std::move(state);
    for (coupling::Bond& b : env_.bonds) std::tie(b.a, b.b) = std::minmax({place[static_cast<std::size_t>(b.a)], place[static_cast<std::size_t>(b.b)]});
    std::sort(env_.bonds.begin(), env_.bonds.end(), [](const coupling::Bond& x, const coupling::Bond& y) { return std::tie(x.a, x.b, x.joint) < std::tie(y.a, y.b, y.joint); });
  }

  /// What the curved laws need beyond their own keys: elastic moduli for Hertz, a stiffness for crushing.
  void complete_laws() {
    const scene::Scene& s = world_->scene;
    const int n = env_.laws.materials;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        ContactLaw& law = env_.laws.law[static_cast<std::size_t>(i * n + j)];
        const scene::Material &a = s.materials[static_cast<std::size_t>(i)], &b = s.materials[static_cast<std::size_t>(j)];
        const std::string key = fmt::format("interface.{}/{}.contact_law", a.name, b.name);
        if (law.kind == ContactLaw::Kind::hertz) {
          const double soft = (a.young > 0 ? (1 - a.poisson * a.poisson) / a.young : 0) + (b.young > 0 ? (1 - b.poisson * b.poisson) / b.young : 0);
          if (!(soft > 0) && i <= j) problem(key, "hertz", "needs Young's modulus of at least one of the two materials", "give material.young (a material without it counts as rigid)");
          if (soft > 0) law.normal_stiffness = 4.0 / 3.0 / soft * std::sqrt(law.hertz_radius);
        }
        if (law.kind == ContactLaw::Kind::hertz || law.kind == ContactLaw::Kind::table) {
          if (law.chosen) law.shear_stiffness = 0;   // Coulomb friction without a shear spring, unless one is given
          law.stiffness = ContactLaw::Stiffness::per_contact;
          law.chosen = false;
        }
        if (law.kind == ContactLaw::Kind::crushing && law.stiffness == ContactLaw::Stiffness::hard && i <= j)
          problem(key, "crushing", "a contact that crushes must be elastic before it does", "give the interface a normal_stiffness, or the materials Young's moduli");
      }
  }

  void add_rock_mass() {
    const auto& mass = world_->scene.rock_mass;
    if (!mass) return;
    geometry::CutResult cut;
    try {
      if (!mass->blocks.empty()) return add_block_system(*mass);
      cut = geometry::cut(cut_spec(*mass));
    } catch (const InputError& e) {
      add_problems(e.problems());
      return;
    }
    for (const Problem& w : cut.warnings) world_->scene.warnings.push_back(w);
    const int first = static_cast<int>(model_.blocks.size());
    int serial = 0;
    for (geometry::CutBlock& b : cut.blocks)
      push(make_block(fmt::format("{}{}", mass->block_prefix, ++serial), std::move(b.body), mass->material, mass->deformable), b.centroid,
           Mat3::Identity(), Vec3::Zero(), Vec3::Zero());
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
        env_.bonds.push_back({first + i.a, first + i.b, i.joint, i.shear * i.bonded_area / i.area, i.tension * i.bonded_area / i.area});
    world_->notes.push_back(fmt::format("Rock mass: {} blocks cut from {:.6g} m^3, {} slivers merged, {} rock bridges.", cut.blocks.size(),
                                        cut.region_volume, cut.merged, env_.bonds.size()));
  }

  void add_block_system(const scene::RockMass& mass) {
    double volume = 0;
    std::vector<geometry::NamedBlock> blocks = geometry::read_block_system(mass.blocks);
    for (geometry::NamedBlock& b : blocks) {
      volume += b.volume;
      push(make_block(b.name, std::move(b.body), mass.material, mass.deformable), b.centroid, Mat3::Identity(), Vec3::Zero(), Vec3::Zero());
    }
    world_->notes.push_back(fmt::format("Rock mass: {} blocks of {:.6g} m^3, read from {}.", blocks.size(), volume, mass.blocks));
  }

  void add_terrain() {
    try {
      terrain_ = load_ground(world_->scene.site);
    } catch (const InputError& e) {
      add_problems(e.problems());
      return;
    }
    if (!terrain_) return;
    for (const Problem& w : terrain_->warnings) world_->scene.warnings.push_back(w);
    env_.terrain = std::make_unique<contact::SurfaceIndex>(terrain_->surface);
    if (terrain_->decimation_reached > 0)
      world_->notes.push_back(fmt::format("Terrain: {} of {} triangles are kept, within {:.3g} m of the given height everywhere.", terrain_->surface.triangles.size(),
                                          terrain_->triangles_read, terrain_->decimation_reached));
  }

  /// A block that moves starts outside of the solid, which is all that lies below the terrain.
  void check_buried(std::size_t i) {
    const Vec3& c = state_.blocks.c[i];
    const double above = env_.terrain->height(c.x(), c.y());
    if (model_.blocks[i].ndof() == 0 || terrain_->surface.two_sided || !(c.z() < above)) return;
    problem(fmt::format("block.{}.position", model_.blocks[i].name), fmt::format("[{:g}, {:g}, {:g}]", c.x(), c.y(), c.z()),
            fmt::format("its centroid lies {:.6g} m below the terrain, which is solid", above - c.z()), "raise it above the terrain, or set site.two_sided for a sheet that has nothing below");
  }

  void check_ground() {
    if (!terrain_) return;
    const Box3 box = env_.terrain->bounds();
    const Eigen::AlignedBox2d limits(Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>()));
    for (std::size_t i = 0; i < single_blocks_; ++i) check_buried(i);
    for (std::size_t i = 0; i < model_.blocks.size(); ++i)
      for (Problem& p : ground_problems(model_.blocks[i].name, state_.blocks.c[i], *terrain_, limits, !world_->scene.planes.empty(), env_.terrain->height(state_.blocks.c[i].x(), state_.blocks.c[i].y()))) {
        p.file = world_->scene.file;
        (p.severity == Problem::Severity::error ? problems_ : world_->scene.warnings).push_back(std::move(p));
      }
  }

  /// Where a structure's reports go; what begins with "warning: " is one, "; " before what to do.
  Report report_of(const std::string& name) {
    return [world = world_.get(), name](const std::string& line) {
      constexpr std::string_view mark = "warning: ";
      if (!line.starts_with(mark)) return world->report(line);
      Problem p;
      p.file = world->scene.file;
      p.key = "structure." + name;
      const std::size_t end = line.find("; ");
      p.rule = line.substr(mark.size(), end - mark.size());
      if (end != std::string::npos) p.remedy = line.substr(end + 2);
      p.severity = Problem::Severity::warning;
      world->scene.warnings.push_back(std::move(p));
    };
  }

  void add_structures() {
    for (StructureSpec spec : world_->scene.structures) {
      coupling::StructurePart part;
      part.material = spec.material;
      part.fixed_surface = world_->scene.coupling.scheme != scene::Coupling::Scheme::two_way;
      part.one_way = world_->scene.coupling.scheme == scene::Coupling::Scheme::one_way;
      // The index lives as long as the world does, this builder does not.
      if (terrain_) spec.ground = [ground = env_.terrain.get()](double x, double y) { return ground->height(x, y); };
      try {
        part.structure = load_structure(spec, model_.gravity, report_of(spec.name));
      } catch (const InputError& e) {
        for (Problem p : e.problems()) {
          if (p.file.empty()) p.file = world_->scene.file;
          if (p.key.rfind("structure", 0) != 0) p.key = fmt::format("structure.{}{}{}", spec.name, p.key.empty() ? "" : ".", p.key);
          problems_.push_back(std::move(p));
        }
        continue;
      }
      part.index = part.fixed_surface ? std::make_unique<contact::SurfaceIndex>(part.structure->surface()) : coupling::moving_index(part.structure->surface());
      check_probes(spec, part.index->bounds());
      const std::vector<Member> members = part.structure->members();
      if (terrain_)
        add_warnings(footing_problems(spec, members, [&](double x, double y) { return ground_height(env_.terrain.get(), world_->scene.planes, x, y); }));
      env_.structures.push_back(std::move(part));
    }
  }

  /// The nearest point of the structure is followed, but not one of another place altogether.
  void check_probes(const StructureSpec& spec, const Box3& bounds) {
    const double size = bounds.sizes().norm();
    for (const StructureSpec::Probe& p : spec.probes)
      if (const double d = bounds.exteriorDistance(p.at); d > 0.1 * size)
        problem(fmt::format("structure.{}.probe.{}.at", spec.name, p.name), fmt::format("[{:g}, {:g}, {:g}]", p.at.x(), p.at.y(), p.at.z()),
                fmt::format("lies {:.3g} m from the structure, which spans x {:.6g} to {:.6g}, y {:.6g} to {:.6g}, z {:.6g} to {:.6g}", d, bounds.min().x(), bounds.max().x(), bounds.min().y(), bounds.max().y(),
                            bounds.min().z(), bounds.max().z()),
                "give a point of the structure in scene coordinates");
  }

  /// Structures with a law between their materials may touch: nodes of the finer skin against faces of the coarser one.
  void pair_structures() {
    const auto& parts = env_.structures;
    for (int i = 0; i < static_cast<int>(parts.size()); ++i)
      for (int j = i + 1; j < static_cast<int>(parts.size()); ++j) {
        const coupling::StructurePart &a = parts[static_cast<std::size_t>(i)], &b = parts[static_cast<std::size_t>(j)];
        if (a.fixed_surface || b.fixed_surface) continue;
        const auto& known = world_->scene.law_pairs;
        if (std::find(known.begin(), known.end(), std::pair(std::min(a.material, b.material), std::max(a.material, b.material))) == known.end()) {
          world_->notes.push_back(fmt::format("Structures {} and {}: no [[interface]] of their materials, they do not touch each other.", world_->scene.structures[static_cast<std::size_t>(i)].name, world_->scene.structures[static_cast<std::size_t>(j)].name));
          continue;
        }
        const double edge_a = coupling::face_edge(a.index->surface()), edge_b = coupling::face_edge(b.index->surface());
        const bool first_finer = edge_a < edge_b * (1 - 1e-9) || (edge_a <= edge_b * (1 + 1e-9) && a.index->bounds().volume() < b.index->bounds().volume());
        env_.touching_structures.push_back(first_finer ? std::pair(j, i) : std::pair(i, j));
      }
  }

  /// A block far smaller than the cell faces it strikes presses on one face: what happens below the cell size is not resolved.
  void warn_of_small_blocks() {
    constexpr double ratio = 0.5;   // least thickness of a block over the edge of a cell
    for (std::size_t q = 0; q < env_.structures.size(); ++q) {
      const double edge = coupling::face_edge(env_.structures[q].structure->surface());
      int small = 0;
      const dda::Model::Block* least = nullptr;
      for (const dda::Model::Block& b : model_.blocks) {
        if (b.ndof() == 0 || 2 * b.shape->inradius >= ratio * edge) continue;
        ++small;
        if (!least || b.shape->inradius < least->shape->inradius) least = &b;
      }
      if (!least) continue;
      Problem p;
      p.file = world_->scene.file;
      p.key = fmt::format("structure.{}.cell_size", world_->scene.structures[q].name);
      p.value = fmt::format("{:.4g} m", edge);
      p.rule = fmt::format("{} block{} thinner than {:g} of a cell face, {} with {:.3g} m the thinnest: its force spreads over a whole face, so that local "
                           "stress, damage and indentation come out too small; force and momentum hold", small, small == 1 ? " is" : "s are", ratio, least->name, 2 * least->shape->inradius);
      p.remedy = fmt::format("take cells of {:.2g} m or less where such blocks strike, or accept it", 2 * least->shape->inradius / ratio);
      p.severity = Problem::Severity::warning;
      world_->scene.warnings.push_back(std::move(p));
    }
  }

  void fill_header() {
    RunHeader& h = world_->header;
    const scene::Scene& s = world_->scene;
    h.title = s.title;
    h.duration = s.simulation.duration;
    if (s.site) {
      h.crs = s.site->crs.empty() && terrain_ ? terrain_->crs : s.site->crs;
      h.map_origin = s.site->origin;
    }
    for (const int k : world_->place) {
      const dda::Model::Block& b = world_->system->model().blocks[static_cast<std::size_t>(k)];
      const scene::Material& m = s.materials[static_cast<std::size_t>(b.material)];
      h.blocks.push_back({b.name, b.mass, b.volume, b.fixed, false, *b.shape, m.young, m.young > 0 ? m.poisson : 0, -1});
    }
    if (terrain_) h.terrain = terrain_->surface;
    h.planes = s.planes;
    for (std::size_t i = 0; i < s.structures.size(); ++i) {
      RunHeader::StructureInfo info;
      info.name = s.structures[i].name;
      for (const auto& p : s.structures[i].probes) {
        info.probes.push_back(p.name);
        info.probe_at.push_back(p.at);
      }
      const coupling::StructurePart& part = world_->system->environment().structures[i];
      info.plan = part.structure->plan();
      if (!part.fixed_surface) info.members = part.structure->members();
      describe_section(s.structures[i], *part.structure, info);
      for (const scene::Block& b : s.blocks) {
        const ContactLaw::Kind kind = s.laws(b.material, s.structures[i].material).kind;
        info.cushion = info.cushion || kind == ContactLaw::Kind::crushing || kind == ContactLaw::Kind::table;
      }
      info.poisson = s.structures[i].poisson;
      info.f_cm = s.structures[i].f_cm;
      info.loaded = !s.structures[i].loads.empty();
      h.structures.push_back(std::move(info));
    }
    for (const scene::Material& m : s.materials) h.materials.push_back(m.name);
  }

  std::unique_ptr<World> world_;
  dda::Model model_;
  coupling::SystemState state_;
  coupling::Environment env_;
  std::optional<geometry::Terrain> terrain_;
  std::set<std::string> names_;
  std::size_t single_blocks_ = 0;   // of the scene's [[block]]s; the rock mass comes after them
  Occupied occupied_;   // by blocks of release areas
  std::vector<Problem> problems_;
};

}  // namespace

std::unique_ptr<World> build(scene::Scene scene, Report report) { return Builder(std::move(scene), std::move(report)).build(); }

}  // namespace talus::sim
