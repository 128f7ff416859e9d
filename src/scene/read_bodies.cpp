#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.hpp"
#include "scene/reading.hpp"

namespace talus::scene {
namespace {

Mat3 rotation_of(Quat q) {
  q.normalize();
  return q.toRotationMatrix();
}

Vec3 plane_normal(double dip_direction, double dip) {
  return {std::sin(dip) * std::sin(dip_direction), std::sin(dip) * std::cos(dip_direction), std::cos(dip)};
}

/// Whether two sides of a polygon in the plane of normal n cross, or touch where they are not neighbours.
bool crosses_itself(const std::vector<Vec3>& p, const Vec3& n) {
  const std::size_t count = p.size();
  const auto turn = [&](const Vec3& a, const Vec3& b, const Vec3& c) { return n.dot((b - a).cross(c - a)); };
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = i + 2; j < count; ++j) {
      if (i == 0 && j + 1 == count) continue;
      const Vec3 &a = p[i], &b = p[i + 1], &c = p[j], &d = p[(j + 1) % count];
      if (turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0) return true;
    }
  return false;
}

/// Unit vectors come back from scene.resolved.json with their bits kept: what is unit to rounding is not
/// divided again.
Vec3 unit(const Vec3& v) { return std::abs(v.squaredNorm() - 1) > 1e-14 ? v.stableNormalized() : v; }

bool deformable(const View& view, const Scene& scene, int material, bool fixed) {
  const bool soft = !scene.materials.empty() && scene.materials[static_cast<std::size_t>(material)].young > 0;
  const bool always = scene.simulation.method == Simulation::Method::dda1988;
  const auto given = view.maybe_flag("deformable");
  if ((given.value_or(false) || (always && !fixed)) && !soft && view.get("material"))
    view.problem(
        given.value_or(false) ? "deformable" : "material",
        always ? "blocks of method \"dda-1988\" always deform, and the material has no young"
               : "a deformable block needs a material with young",
        "add young (and poisson) to the material" + std::string(always ? "" : ", or set deformable = false"));
  if (always && given && !*given)
    view.problem("deformable",
                 "has no effect: blocks of method \"dda-1988\" always have 12 degrees of freedom",
                 "remove it", Problem::Severity::warning);
  if (always) return true;
  return given.value_or(soft);
}

}  // namespace

void read_materials(Reading& in, const View& root) {
  std::map<std::string, int> taken;
  for (const View& view : root.tables("material")) {
    Material m;
    m.name = in.name(view, "name", "", taken);
    m.f_cm =
        view.has("f_cm") && !view.get("f_cm") ? 30e6 : view.number("f_cm");  // a bad one is reported once
    m.density = view.has("density") && !view.get("density")
                    ? 2500
                    : view.maybe("density").value_or(m.f_cm > 0 ? 2450 : 0);
    m.young = view.has("young") && !view.get("young") ? 30e9 : view.number("young");
    m.poisson = view.maybe("poisson").value_or(m.f_cm > 0 ? 0.2 : 0.25);
    m.tensile_strength = view.number("tensile_strength");
    m.fracture_energy = view.number("fracture_energy");
    if (const auto rough = view.table("roughness"))
      m.roughness = Material::Roughness{rough->number("amplitude"), rough->number("length"),
                                        static_cast<std::uint32_t>(rough->integer("seed"))};
    in.material_index.emplace(m.name, static_cast<int>(in.scene.materials.size()));
    in.scene.materials.push_back(m);
  }
  for (const View& view : root.tables("interface"))
    for (const std::string& name : view.texts("between")) {
      if (name == "*")
        in.interface_wildcard = true;
      else if (in.material_index.count(name) == 0)
        in.interface_name.emplace(name, 0);
    }
}

namespace {

/// A slope of plane faces from its crest downwards.
void read_slope(const View& view, Site& site) {
  for (const View& face : view.tables("face"))
    site.faces.push_back({face.number("dip"), face.number("length")});
  if (site.faces.empty()) {
    for (const char* key : {"crest", "dip_direction", "width"})
      if (view.has(key)) view.problem(key, "only a slope of [[site.face]] has it", "add faces, or remove it");
    return;
  }
  for (const char* key : {"terrain", "breaklines"})
    if (view.has(key))
      view.problem("face", fmt::format("the terrain is given by {} already", key), "give one of them");
  view.missing("dip_direction");
  view.missing("width");
  site.crest = view.vector("crest");
  site.dip_direction = view.number("dip_direction");
  site.width = view.number("width");
}

}  // namespace

void read_site(Reading& in, const View& root) {
  if (const auto view = root.table("site")) {
    Site site;
    site.terrain = in.file(*view, "terrain");
    site.breaklines = in.file(*view, "breaklines");
    read_slope(*view, site);
    const auto areas = view->tables("area");
    const bool in_parts =
        std::any_of(areas.begin(), areas.end(), [](const View& area) { return area.has("mesh"); });
    if (!view->has("terrain") && !view->has("breaklines") && site.faces.empty() && !in_parts)
      view->missing("terrain", "or breaklines, face, or area.mesh");
    site.up = view->text("up").empty() ? 'z' : view->text("up").front();
    site.material = in.material(*view, "material", true);
    site.two_sided = view->flag("two_sided");
    site.decimation_error = view->number("decimation");
    site.widen = view->number("widen");
    site.crs = view->text("crs");
    site.origin = view->vector("origin");
    if (const auto crop = view->table("crop")) {
      Vec3 low = crop->vector("min"), high = crop->vector("max");
      if (std::isnan(low.z())) low.z() = -1e9;
      if (std::isnan(high.z())) high.z() = 1e9;
      if (crop->get("min") && crop->get("max") && !(low.array() < high.array()).all())
        crop->problem("max", "must be greater than min in every direction", "swap the corners");
      site.crop = Box3(low, high);
    }
    for (const View& area : areas) {
      const bool by_raster = area.has("raster");
      const int ways = area.has("polygon") + by_raster + area.has("part") + area.has("mesh");
      if (ways > 1)
        area.problem(by_raster          ? "raster"
                     : area.has("part") ? "part"
                                        : "mesh",
                     "the area is given twice", "give one of polygon, raster and value, part, mesh");
      if (by_raster)
        area.missing("value", "the class of ground meant");
      else if (ways == 0)
        area.missing("polygon", "or raster and value, part, mesh");
      if (!by_raster && area.has("value"))
        area.problem("value", "only a raster has classes", "remove it, or give a raster");
      if (area.has("part") && !view->has("terrain"))
        area.problem("part", "there is no terrain file that it could be a part of", "give site.terrain");
      site.material_areas.push_back({in.file(area, "polygon"), in.file(area, "raster"), area.number("value"),
                                     in.material(area, "material", true), area.text("part"),
                                     in.file(area, "mesh")});
    }
    for (std::size_t m = 0; m < in.scene.materials.size(); ++m)
      if (in.scene.materials[m].roughness)
        site.roughness.push_back({static_cast<int>(m), *in.scene.materials[m].roughness});
    in.scene.site = site;
  }
  for (const View& view : root.tables("plane")) {
    Plane plane;
    plane.point = view.vector("point");
    plane.material = in.material(view, "material", true);
    const bool dips = view.has("dip_direction") || view.has("dip");
    if (view.has("normal") && dips)
      view.problem("normal", "the plane is given twice", "give normal, or dip_direction and dip");
    else if (dips) {
      view.missing("dip_direction");
      view.missing("dip");
      plane.normal = unit(plane_normal(view.number("dip_direction"), view.number("dip")));
    } else {
      view.missing("normal", "or dip_direction and dip");
      const auto normal = view.maybe_vector("normal");
      if (normal && !(normal->stableNorm() > 0))
        view.problem("normal", "must not be zero", "give the outward direction, e.g. [0, 0, 1]");
      else if (normal)
        plane.normal = unit(*normal);
    }
    in.scene.planes.push_back(plane);
  }
}

Mat3 read_orientation(const View& view) {
  const auto given = view.table("orientation");
  if (!given) return Mat3::Identity();
  const bool quaternion = given->has("quaternion"), vector = given->has("rotation_vector"),
             dips = given->has("dip_direction") || given->has("dip"), matrix = given->has("matrix");
  if (quaternion + vector + dips + matrix != 1) {
    view.problem("orientation", "must have exactly one form",
                 "give quaternion, or rotation_vector, or dip_direction and dip");
    return Mat3::Identity();
  }
  if (matrix) {
    const std::vector<Vec3> rows = given->vectors("matrix");
    if (!given->get("matrix")) return Mat3::Identity();
    Mat3 r = Mat3::Identity();
    if (rows.size() == 3) r << rows[0].transpose(), rows[1].transpose(), rows[2].transpose();
    if (rows.size() != 3 || !(r.transpose() * r).isIdentity(1e-9) || r.determinant() < 0) {
      given->problem("matrix", "must be a rotation: three orthogonal rows of length one, right-handed",
                     "give a quaternion instead");
      return Mat3::Identity();
    }
    return r;
  }
  if (quaternion) {
    const Node* node = given->get("quaternion");
    if (!node) return Mat3::Identity();
    std::string why;
    const auto q = [&](std::size_t i) {
      return quantity_of(node->items[i], dimension::number, why).value_or(0);
    };
    const Quat value(q(0), q(1), q(2), q(3));
    const double norm = value.coeffs().stableNorm();
    if (!(norm > 0)) {
      given->problem("quaternion", "must not be zero", "write [1, 0, 0, 0] for no rotation");
      return Mat3::Identity();
    }
    return rotation_of(Quat(value.coeffs() / norm));
  }
  if (vector) {
    const Vec3 v = given->vector("rotation_vector");
    const double angle = v.stableNorm();
    return angle > 0 ? rotation_of(Quat(Eigen::AngleAxisd(angle, v / angle))) : Mat3::Identity().eval();
  }
  given->missing("dip_direction");
  given->missing("dip");
  const double a = given->number("dip_direction"), d = given->number("dip");
  Mat3 axes;
  axes.col(0) = Vec3(std::cos(d) * std::sin(a), std::cos(d) * std::cos(a), -std::sin(d));
  axes.col(2) = plane_normal(a, d);
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

bool read_joint_orientation(const View& view, double& dip_direction, double& dip) {
  const bool parts = view.has("dip_direction") || view.has("dip");
  if (view.has("orientation") && parts) {
    view.problem("orientation", "the orientation is given twice",
                 "give orientation, or dip_direction and dip");
    return false;
  }
  if (parts) {
    view.missing("dip_direction");
    view.missing("dip");
    dip_direction = view.number("dip_direction");
    dip = view.number("dip");
    return view.get("dip_direction") && view.get("dip");
  }
  view.missing("orientation");
  if (!view.get("orientation")) return false;
  const std::string text = view.text("orientation");
  const auto slash = text.find('/');
  std::string error;
  const double degree = std::numbers::pi / 180;
  dip_direction = parse_quantity(text.substr(0, slash), error)->value * degree;
  dip = parse_quantity(text.substr(slash + 1), error)->value * degree;
  return true;
}

double shape_size(const Shape& shape, double density) {
  if (shape.volume > 0) return std::cbrt(shape.volume);
  if (shape.mass > 0 && density > 0) return std::cbrt(shape.mass / density);
  if (shape.size.x() > 0) return std::cbrt(shape.size.prod());
  if (shape.diameter > 0) return shape.diameter;
  if (!shape.vertices.empty()) {
    Box3 box;
    for (const Vec3& v : shape.vertices) box.extend(v);
    return std::cbrt(box.sizes().prod());
  }
  return 0;
}

Shape read_shape(Reading& in, const View& view, bool scaled_elsewhere) {
  Shape s;
  s.size = view.vector("size");
  s.diameter = view.number("diameter");
  s.longitudes = static_cast<int>(view.integer("longitudes"));
  s.latitudes = static_cast<int>(view.integer("latitudes"));
  s.vertices = view.vectors("vertices");
  s.volume = view.number("volume");
  s.mass = view.number("mass");
  s.seed = static_cast<unsigned>(view.integer("seed"));
  s.aspect = view.vector("aspect");
  s.file = in.file(view, "file");
  if (view.has("shape") && !view.get("shape")) return s;
  if (!view.has("shape") && !view.has("file")) {
    view.missing("shape");
    return s;
  }
  s.kind = view.has("shape") ? view.text("shape") : "file";
  const bool scaled = view.has("volume") || view.has("mass") || scaled_elsewhere;
  if (view.has("volume") && view.has("mass"))
    view.problem("mass", "volume and mass both scale the shape", "give one of them");
  if (s.kind == "file")
    view.missing("file");
  else if (view.has("file"))
    view.problem("file", fmt::format("the block is a {} already", s.kind), "remove shape, or file");
  if (s.kind == "convex") {
    view.missing("vertices");
    if (view.get("vertices") && s.vertices.size() < 4)
      view.problem("vertices", "a block has at least 4 vertices", "add the missing ones");
  } else if (view.has("vertices")) {
    view.problem("vertices", "only shape = \"convex\" has vertices",
                 "remove them, or write shape = \"convex\"");
  }
  if (s.kind.compare(0, 6, "random") == 0 && !scaled)
    view.missing("volume", "a random shape is scaled to its volume or mass");
  const bool measured = scaled || view.has("size") || (s.kind == "sphere" && view.has("diameter"));
  if (s.kind == "box" && !scaled) {
    view.missing("size");
    if (view.has("diameter")) view.problem("diameter", "a box has no diameter", "give size");
  } else if (s.kind != "convex" && s.kind != "file" && s.kind.compare(0, 6, "random") != 0 && !measured) {
    view.missing(s.kind == "sphere" ? "diameter" : "size", "or volume or mass");
  }
  if (s.kind != "sphere" && s.kind != "box" && view.has("diameter"))
    view.problem("diameter", "only a sphere has a diameter", "give size, volume or mass");
  if (s.kind == "sphere" && view.has("diameter") && view.has("size"))
    view.problem("size", "the sphere has a diameter already", "give one of them");
  if (s.kind == "box" && scaled && s.size.isZero()) s.size = Vec3::Ones();
  return s;
}

namespace {
void need_density(const View& view, const Reading& in, int material) {
  const Scene& scene = in.scene;
  if (!in.has_material(view, "material")) return;
  const Material& m = scene.materials[static_cast<std::size_t>(material)];
  if (!(m.density > 0))
    view.problem("material",
                 fmt::format("the material \"{}\" has no density, and a block is made of it", m.name),
                 "add density to the [[material]], e.g. density = 2500");
}
}  // namespace

namespace {

/// Where copies of a block start: at random within polygons, above the ground.
std::optional<Release> read_release(Reading& in, const View& block) {
  const auto view = block.table("release");
  if (!view) return std::nullopt;
  for (const char* key : {"position", "orientation", "fixed", "fixed_points"})
    if (block.has(key) && !(view->has("at") && std::string_view(key) == "orientation"))
      block.problem(key, "a block with a release area has none of its own", "remove it, or release");
  Release r;
  r.polygon = in.file(*view, "polygon");
  r.count = static_cast<int>(view->integer("count"));
  r.height = view->number("height");
  r.seed = static_cast<unsigned>(view->integer("seed"));
  r.turn = view->flag("turn");
  if (const Node* at = view->get("at"); at && at->kind == Node::Kind::array) {
    r.at = vector_of(*at, dimension::length).head<2>();
    if (r.count > 1) view->problem("count", "one place takes one block", "leave count out");
  }
  if (!in.scene.site && in.scene.planes.empty())
    view->problem("polygon", "there is no ground to release above", "add [site] or a [[plane]]");
  return r;
}

}  // namespace

void read_blocks(Reading& in, const View& root) {
  std::map<std::string, int> taken;
  int place = 0;
  for (const View& view : root.tables("block")) {
    Block b;
    b.name = in.name(view, "name", fmt::format("B{}", ++place), taken);
    b.material = in.material(view, "material");
    need_density(view, in, b.material);
    b.shape = read_shape(in, view);
    b.position = view.maybe_vector("position");
    b.release = read_release(in, view);
    if (b.shape.kind != "file" && !b.release) view.missing("position", "or release");
    b.rotation = read_orientation(view);
    b.velocity = view.vector("velocity");
    b.spin = view.vector("spin");
    b.fixed = view.flag("fixed");
    b.fixed_points = view.vectors("fixed_points");
    b.deformable = deformable(view, in.scene, b.material, b.fixed);
    if (b.fixed && (!b.velocity.isZero(0) || !b.spin.isZero(0)))
      view.problem("fixed", "a fixed block has no velocity and no spin", "remove them, or fixed");
    if (b.fixed && !b.fixed_points.empty())
      view.problem("fixed_points", "the whole block is fixed already", "remove fixed, or fixed_points");
    if (b.shape.kind == "file" && !b.position && view.has("orientation"))
      view.problem("orientation", "a mesh without position lies where its file says",
                   "add a position, or remove the orientation");
    in.scene.blocks.push_back(std::move(b));
  }
}

void read_rock_mass(Reading& in, const View& root) {
  const auto view = root.table("rock_mass");
  if (!view) return;
  RockMass mass;
  mass.region = in.file(*view, "region");
  if (const auto box = view->table("box")) {
    const Vec3 low = box->vector("min"), high = box->vector("max");
    if (box->get("min") && box->get("max") && !(low.array() < high.array()).all())
      box->problem("max", "must be greater than min in every direction", "swap the corners");
    mass.box = Box3(low, high);
  }
  mass.blocks = in.file(*view, "blocks");
  if (view->has("region") && view->has("box"))
    view->problem("box", "the region is given twice", "give region, or box");
  if (view->has("blocks")) {
    for (const char* key : {"region", "box", "slip_surface", "from_terrain", "bed_material", "joint_set",
                            "joint", "least_volume", "prefix"})
      if (view->has(key)) view->problem(key, "the blocks are cut already", "remove it, or blocks");
  } else if (!view->has("box") && !view->has("slip_surface")) {
    view->missing("region", "or box, slip_surface or blocks");
  }
  mass.material = in.material(*view, "material");
  mass.slip_surface = in.file(*view, "slip_surface");
  mass.from_terrain = view->has("from_terrain") ? view->flag("from_terrain") : view->has("slip_surface");
  mass.bed_material = view->has("bed_material") ? in.material(*view, "bed_material") : mass.material;
  if (view->has("slip_surface") && !mass.from_terrain)
    view->problem("from_terrain", "a slip surface bounds what is cut out of the terrain",
                  "remove from_terrain, or slip_surface");
  if (view->has("bed_material") && !mass.from_terrain)
    view->problem("bed_material", "has no effect: the rock mass is not cut out of the terrain",
                  "add from_terrain = true, or remove it");
  if (mass.from_terrain && (!in.scene.site || !in.scene.site->given()))
    view->problem(view->has("slip_surface") ? "slip_surface" : "from_terrain",
                  "the scene has no terrain that the rock mass could be cut out of", "add [site]");
  need_density(*view, in, mass.material);
  mass.deformable = deformable(*view, in.scene, mass.material, false);
  mass.least_volume = view->number("least_volume");
  std::map<std::string, int> prefix, names;
  mass.block_prefix = in.name(*view, "prefix", "R", prefix);
  int place = 0;
  for (const View& at : view->tables("joint_set")) {
    JointSet set;
    set.name = in.name(at, "name", fmt::format("J{}", ++place), names);
    read_joint_orientation(at, set.dip_direction, set.dip);
    set.spacing = at.number("spacing");
    set.origin = at.maybe_vector("origin");
    set.persistence = at.number("persistence");
    set.fisher = at.number("fisher");
    set.spacing_distribution = at.text("spacing_distribution");
    set.spacing_deviation = at.number("spacing_deviation");
    if ((set.spacing_distribution == "normal" || set.spacing_distribution == "lognormal") &&
        at.get("spacing_distribution"))
      at.missing("spacing_deviation", fmt::format("the {} distribution needs it", set.spacing_distribution));
    else if (set.spacing_deviation > 0 && (at.get("spacing_distribution") || !at.has("spacing_distribution")))
      at.problem("spacing_deviation",
                 fmt::format("has no effect with spacing_distribution = \"{}\"", set.spacing_distribution),
                 "remove it, or write \"normal\" or \"lognormal\"");
    set.seed = static_cast<unsigned>(at.integer("seed"));
    set.bond_tension = at.number("bond_tension");
    set.bond_shear = at.number("bond_shear");
    if (set.persistence == 1 && (set.bond_tension > 0 || set.bond_shear > 0))
      at.problem(at.has("bond_tension") ? "bond_tension" : "bond_shear",
                 "a set with persistence 1 has no rock bridges",
                 "give persistence below 1, or remove the bond");
    if (const Node* friction = at.get("friction")) set.friction = friction_coefficient(*friction);
    set.cohesion = at.maybe("cohesion");
    set.tension = at.maybe("tension");
    mass.joint_sets.push_back(std::move(set));
  }
  place = 0;
  for (const View& at : view->tables("joint")) {
    Joint joint;
    joint.name = in.name(at, "name", fmt::format("K{}", ++place), names);
    read_joint_orientation(at, joint.dip_direction, joint.dip);
    joint.through = at.vector("through");
    joint.radius = at.number("radius");
    joint.polygon = at.vectors("polygon");
    joint.bond_tension = at.number("bond_tension");
    joint.bond_shear = at.number("bond_shear");
    if ((joint.bond_tension > 0 || joint.bond_shear > 0) && !at.has("radius") && !at.has("polygon"))
      at.problem(at.has("bond_tension") ? "bond_tension" : "bond_shear",
                 "an unbounded joint has no rock bridge", "give radius or polygon, or remove the bond");
    if (at.has("radius") && at.has("polygon"))
      at.problem("polygon", "the joint is bounded twice", "give radius, or polygon");
    if (at.get("polygon") && joint.polygon.size() < 3)
      at.problem("polygon", "a polygon has at least 3 corners", "add the missing ones");
    const Vec3 normal = plane_normal(joint.dip_direction, joint.dip);
    for (const Vec3& corner : joint.polygon)
      if (std::abs(normal.dot(corner - joint.through)) > 1e-6 * (1 + (corner - joint.through).norm())) {
        at.problem("polygon", "every corner must lie in the plane of the joint",
                   "correct the corners, the orientation or through");
        break;
      }
    if (at.get("polygon") && joint.polygon.size() >= 3 && crosses_itself(joint.polygon, normal))
      at.problem("polygon", "its sides cross", "give the corners in order around it");
    mass.joints.push_back(std::move(joint));
  }
  in.scene.rock_mass = std::move(mass);
}

}  // namespace talus::scene
