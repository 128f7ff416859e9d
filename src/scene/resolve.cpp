#include <algorithm>
#include <nlohmann/json.hpp>

#include "contact/structures/refinable.hpp"
#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

using Json = nlohmann::ordered_json;

Json vec(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }
Json list(const std::vector<Vec3>& points) {
  Json out = Json::array();
  for (const Vec3& p : points) out.push_back(vec(p));
  return out;
}
Json pairs(const std::vector<std::pair<double, double>>& rows) {
  Json out = Json::array();
  for (const auto& [a, b] : rows) out.push_back(Json::array({a, b}));
  return out;
}
Json box(const Box3& b) { return {{"min", vec(b.min())}, {"max", vec(b.max())}}; }
Json rotation(const Mat3& r) {
  return {{"matrix", Json::array({vec(r.row(0)), vec(r.row(1)), vec(r.row(2))})}};
}

void put_shape(Json& out, const Shape& s) {
  out["shape"] = s.kind;
  if (s.kind == "file") out["file"] = s.file;
  if (s.kind == "convex") out["vertices"] = list(s.vertices);
  if (!s.size.isZero(0)) out["size"] = vec(s.size);
  if (s.diameter > 0) out["diameter"] = s.diameter;
  out["longitudes"] = s.longitudes;
  out["latitudes"] = s.latitudes;
  if (s.volume > 0) out["volume"] = s.volume;
  if (s.mass > 0) out["mass"] = s.mass;
  out["seed"] = s.seed;
  out["aspect"] = vec(s.aspect);
}

Json simulation(const Simulation& s) {
  Json out;
  out["duration"] = s.duration;
  out["until"] = s.until_rest ? "rest" : "duration";
  out["gravity"] = vec(s.gravity);
  if (s.accuracy) out["accuracy"] = *s.accuracy;
  if (s.step) out["step"] = *s.step;
  out["min_step"] = s.min_step;
  out["method"] = s.method == Simulation::Method::talus ? "talus" : "dda-1988";
  out["threads"] = s.threads;
  out["sleeping"] = s.sleeping;
  if (!s.initial_state.empty()) out["initial_state"] = s.initial_state;
  return out;
}

Json interface(const Scene& scene, int a, int b) {
  const ContactLaw& law = scene.laws(a, b);
  Json out;
  out["between"] = {scene.materials[static_cast<std::size_t>(a)].name,
                    scene.materials[static_cast<std::size_t>(b)].name};
  out["friction"] = law.friction;
  out["cohesion"] = law.cohesion;
  out["tension"] = law.tension;
  // The unit says which of the two springs is meant; its factor is one, so no bit changes.
  const std::string unit = law.stiffness == ContactLaw::Stiffness::per_contact ? " N/m" : " Pa/m";
  if (law.stiffness == ContactLaw::Stiffness::hard)
    out["normal_stiffness"] = "hard";
  else {
    out["normal_stiffness"] = exact_text(law.normal_stiffness) + unit;
    out["shear_stiffness"] = exact_text(law.shear_stiffness) + unit;
  }
  out["normal_stiffness_chosen"] = law.chosen;
  if (law.changes_with_way())
    out["slip_friction"] = {
        {"most", law.friction_most}, {"length", law.friction_way}, {"recovery", law.friction_recovery}};
  if (law.vegetation_drag > 0)
    out["vegetation"] = {{"height", law.vegetation_height}, {"drag", law.vegetation_drag}};
  if (law.restitution) out["restitution"] = *law.restitution;
  if (law.restitution_half_speed > 0) out["restitution_half_speed"] = law.restitution_half_speed;
  if (law.restitution_tangential) out["restitution_tangential"] = *law.restitution_tangential;
  out["rolling_resistance"] = law.rolling_resistance;
  out["drilling_resistance"] = law.drilling_resistance;
  out["damping_ratio"] = law.damping_ratio;
  switch (law.kind) {
    case ContactLaw::Kind::linear: out["contact_law"] = "linear"; break;
    case ContactLaw::Kind::hertz:
      out["contact_law"] = {{"kind", "hertz"}, {"radius", law.hertz_radius}};
      break;
    case ContactLaw::Kind::crushing:
      out["contact_law"] = {{"kind", "crushing"},
                            {"pressure", law.crushing_pressure},
                            {"gradient", law.yield_gradient},
                            {"ploughing", law.ploughing_pressure},
                            {"ploughing_density", law.ploughing_density}};
      if (law.yield_thickness > 0) out["contact_law"]["thickness"] = law.yield_thickness;
      break;
    case ContactLaw::Kind::table:
      out["contact_law"] = {{"kind", "table"}, {"points", pairs(law.table)}};
      break;
  }
  return out;
}

Json rock_mass(const RockMass& mass, const std::string& material, const std::string& bed_material) {
  Json out;
  if (!mass.blocks.empty()) {
    out["blocks"] = mass.blocks;
    out["material"] = material;
    out["deformable"] = mass.deformable;
    return out;
  }
  if (!mass.region.empty()) out["region"] = mass.region;
  if (mass.box) out["box"] = box(*mass.box);
  if (!mass.slip_surface.empty()) out["slip_surface"] = mass.slip_surface;
  if (mass.from_terrain) out["from_terrain"] = true, out["bed_material"] = bed_material;
  out["material"] = material;
  out["deformable"] = mass.deformable;
  out["least_volume"] = mass.least_volume;
  out["prefix"] = mass.block_prefix;
  for (const JointSet& s : mass.joint_sets) {
    Json set;
    set["name"] = s.name;
    set["dip_direction"] = s.dip_direction;
    set["dip"] = s.dip;
    set["spacing"] = s.spacing;
    if (s.origin) set["origin"] = vec(*s.origin);
    set["persistence"] = s.persistence;
    set["fisher"] = s.fisher;
    set["spacing_distribution"] = s.spacing_distribution;
    set["spacing_deviation"] = s.spacing_deviation;
    set["seed"] = s.seed;
    set["bond_tension"] = s.bond_tension;
    set["bond_shear"] = s.bond_shear;
    if (s.friction) set["friction"] = *s.friction;
    if (s.cohesion) set["cohesion"] = *s.cohesion;
    if (s.tension) set["tension"] = *s.tension;
    out["joint_set"].push_back(set);
  }
  for (const Joint& j : mass.joints) {
    Json joint;
    joint["name"] = j.name;
    joint["dip_direction"] = j.dip_direction;
    joint["dip"] = j.dip;
    joint["through"] = vec(j.through);
    if (j.radius > 0) joint["radius"] = j.radius;
    if (!j.polygon.empty()) joint["polygon"] = list(j.polygon);
    joint["bond_tension"] = j.bond_tension;
    joint["bond_shear"] = j.bond_shear;
    out["joint"].push_back(joint);
  }
  return out;
}

Json structure(const StructureSpec& s, const std::string& material) {
  // The reader says "centred" for a mesh that has a position.
  const bool placed = s.kind != "mesh" || std::any_of(s.parameters.begin(), s.parameters.end(),
                                                      [](const auto& p) { return p.first == "centred"; });
  Json out;
  out["name"] = s.name;
  out["kind"] = s.kind;
  out["material"] = material;
  if (s.kind == "column") {
    out["base"] = vec(s.position);
    out["height"] = s.size.z();
    out["section"] = s.section;
    if (s.section == "round")
      out["diameter"] = s.size.x();
    else
      out["section_size"] = Json::array({s.size.x(), s.size.y()});
    if (s.section == "hollow") out["wall_thickness"] = s.wall_thickness;
  } else if (placed) {
    out["position"] = vec(s.position);
  }
  if (s.kind == "box") out["size"] = vec(s.size);
  if (s.kind == "viaduct") {
    out["section"] = s.section;
    if (s.section == "hollow") out["wall_thickness"] = s.wall_thickness;
  }
  if (!s.file.empty()) out["file"] = s.file;
  if (placed) out["orientation"] = rotation(s.rotation);
  if (s.cell_size > 0) out["cell_size"] = s.cell_size;
  if (s.cells[0] > 0) out["cells"] = s.cells;
  const bool local = std::any_of(s.parameters.begin(), s.parameters.end(),
                                 [](const auto& p) { return p.first == "local_refinement"; });
  for (const auto& zone : s.refinements)
    out["refine"].push_back({{"region", box(zone.region)}, {"cell_size", zone.cell_size}, {"local", local}});
  if (const ImpactRefinement asked = impact_refinement(s); asked.cell_size > 0) {
    Json zone{{"where", "impact"}, {"cell_size", asked.cell_size}};
    if (asked.reach > 0) zone["reach"] = asked.reach;
    out["refine"].push_back(zone);
  }
  out["support"] = Json::array();
  for (const auto& support : s.supports) {
    Json one;
    if (!support.face.empty())
      one["face"] = support.face;
    else if (!support.group.empty())
      one["group"] = support.group;
    else
      one["region"] = box(support.region);
    std::string held;
    for (std::size_t i = 0; i < 3; ++i)
      if (support.held[i]) held += "xyz"[i];
    one["held"] = held;
    out["support"].push_back(one);
  }
  out["preload"] = s.gravity_preload ? "gravity" : "none";
  out["damage"] = s.damage;
  out["rate_effect"] = s.rate_effect;
  out["erosion"] = s.erosion;
  out["aggregate"] = s.aggregate;
  if (!s.rebar_file.empty()) out["rebar"] = s.rebar_file;
  out["bond"] = s.bond;
  for (const auto& rule : s.rebar_rules)
    out["rebar"].push_back({{"kind", rule.kind},
                            {"part", rule.part},
                            {"bars", rule.bars},
                            {"diameter", rule.diameter},
                            {"cover", rule.cover},
                            {"spacing", rule.spacing},
                            {"yield", rule.yield},
                            {"prestress", rule.prestress},
                            {"ultimate_strain", rule.ultimate_strain}});
  out["damping_ratio"] = s.damping_ratio;
  out["integrator"] = s.integrator;
  out["critical_step_fraction"] = s.critical_step_fraction;
  out["initial_velocity"] = vec(s.initial_velocity);
  for (const auto& probe : s.probes) out["probe"].push_back({{"name", probe.name}, {"at", vec(probe.at)}});
  for (const auto& load : s.loads)
    out["load"].push_back(
        {{"region", box(load.region)}, {"traction", vec(load.traction)}, {"history", pairs(load.history)}});
  if (!s.parameters.empty()) {
    Json parameters = Json::object();
    for (const auto& [name, value] : s.parameters)
      if (name != "centred" && name != "local_refinement" && name != ImpactRefinement::size_key &&
          name != ImpactRefinement::reach_key)
        parameters[name] = value;
    out["parameters"] = parameters;
  }
  return out;
}

}  // namespace

std::string resolved_json(const Scene& scene) {
  const auto material = [&](int index) { return scene.materials[static_cast<std::size_t>(index)].name; };
  Json out;
  out["schema"] = scene.schema;
  out["title"] = scene.title;
  Json header;
  header["version"] = TALUS_VERSION;
  header["scene"] = scene.file;
  for (const auto& [path, hash] : scene.files) header["file"].push_back({{"path", path}, {"sha256", hash}});
  header["note"] = scene.notes;
  out["resolved"] = header;
  out["simulation"] = simulation(scene.simulation);
  if (scene.site) {
    const Site& s = *scene.site;
    Json site;
    if (!s.terrain.empty()) site["terrain"] = s.terrain;
    if (!s.breaklines.empty()) site["breaklines"] = s.breaklines;
    if (!s.faces.empty()) {
      site["crest"] = vec(s.crest);
      site["dip_direction"] = s.dip_direction;
      site["width"] = s.width;
    }
    for (const auto& face : s.faces) site["face"].push_back({{"dip", face.dip}, {"length", face.length}});
    site["material"] = material(s.material);
    site["up"] = std::string(1, s.up);
    site["two_sided"] = s.two_sided;
    site["decimation"] = s.decimation_error;
    site["widen"] = s.widen;
    if (s.crop) site["crop"] = box(*s.crop);
    site["crs"] = s.crs;
    site["origin"] = vec(s.origin);
    for (const auto& area : s.material_areas) {
      Json one;
      if (!area.polygon_file.empty()) one["polygon"] = area.polygon_file;
      if (!area.part.empty()) one["part"] = area.part;
      if (!area.mesh_file.empty()) one["mesh"] = area.mesh_file;
      if (!area.raster_file.empty()) one["raster"] = area.raster_file, one["value"] = area.value;
      one["material"] = material(area.material);
      site["area"].push_back(one);
    }
    out["site"] = site;
  }
  for (const Plane& p : scene.planes)
    out["plane"].push_back(
        {{"point", vec(p.point)}, {"normal", vec(p.normal)}, {"material", material(p.material)}});
  for (const Material& m : scene.materials) {
    if (!m.declared) continue;
    Json one;
    one["name"] = m.name;
    if (m.density > 0) one["density"] = m.density;
    if (m.young > 0) one["young"] = m.young;
    if (m.young > 0 || m.f_cm > 0) one["poisson"] = m.poisson;  // a rigid material has no use for it
    if (m.f_cm > 0) one["f_cm"] = m.f_cm;
    if (m.tensile_strength > 0) one["tensile_strength"] = m.tensile_strength;
    if (m.fracture_energy > 0) one["fracture_energy"] = m.fracture_energy;
    if (m.roughness)
      one["roughness"] = {{"amplitude", m.roughness->amplitude},
                          {"length", m.roughness->length},
                          {"seed", m.roughness->seed}};
    out["material"].push_back(one);
  }
  for (const auto& [a, b] : scene.law_pairs) out["interface"].push_back(interface(scene, a, b));
  for (const Block& b : scene.blocks) {
    Json block;
    block["name"] = b.name;
    block["material"] = material(b.material);
    put_shape(block, b.shape);
    if (b.position) {
      block["position"] = vec(*b.position);
      block["orientation"] = rotation(b.rotation);
    }
    block["velocity"] = vec(b.velocity);
    block["spin"] = vec(b.spin);
    if (b.release)
      block["release"] = {{"polygon", b.release->polygon},
                          {"count", b.release->count},
                          {"height", b.release->height},
                          {"seed", b.release->seed},
                          {"turn", b.release->turn}};
    if (b.release && b.release->at) {
      block["release"]["at"] = {b.release->at->x(), b.release->at->y()};
      block["orientation"] = rotation(b.rotation);
    }
    if (!b.release) block["fixed"] = b.fixed;
    if (!b.fixed_points.empty()) block["fixed_points"] = list(b.fixed_points);
    if (scene.simulation.method == Simulation::Method::talus) block["deformable"] = b.deformable;
    out["block"].push_back(block);
  }
  if (scene.rock_mass)
    out["rock_mass"] = rock_mass(*scene.rock_mass, material(scene.rock_mass->material),
                                 material(scene.rock_mass->bed_material));
  for (const StructureSpec& s : scene.structures)
    out["structure"].push_back(structure(s, material(s.material)));
  if (scene.impact) {
    const Impact& i = *scene.impact;
    Json impact;
    impact["structure"] = scene.structures[static_cast<std::size_t>(i.structure)].name;
    impact["material"] = material(i.material);
    put_shape(impact, i.shape);
    impact["orientation"] = rotation(i.rotation);
    impact["velocity"] = vec(i.velocity);
    impact["spin"] = vec(i.spin);
    impact["point"] = vec(i.point);
    impact["clearance"] = i.clearance;
    impact["deformable"] = i.deformable;
    out["impact"] = impact;
  }
  for (const Line& line : scene.lines) {
    Json one = {{"name", line.name}};
    if (!line.file.empty())
      one["file"] = line.file;
    else
      for (const Eigen::Vector2d& p : line.parts.front()) one["points"].push_back({p.x(), p.y()});
    out["line"].push_back(one);
  }
  if (!scene.structures.empty()) {
    const Coupling& c = scene.coupling;
    out["coupling"] = {{"scheme", c.scheme == Coupling::Scheme::two_way   ? "two-way"
                                  : c.scheme == Coupling::Scheme::one_way ? "one-way"
                                                                          : "rigid"},
                       {"audit", c.strict ? "strict" : "report"},
                       {"exchanges_per_rise", c.exchanges_per_rise},
                       {"fragments", c.fragments}};
  }
  out["output"] = {{"interval", scene.output.interval},
                   {"history_interval", scene.output.history_interval},
                   {"checkpoint_steps", scene.output.checkpoint_steps},
                   {"report", scene.output.report}};
  return out.dump(2) + "\n";
}

}  // namespace talus::scene
