/// The scene as plain validated structs: every default filled in, SI, absolute paths. `read_scene` is the
/// only way in.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "contact/geometry/surface.hpp"
#include "contact/laws/law.hpp"
#include "contact/structures/structure.hpp"
#include "core/error.hpp"
#include "core/types.hpp"
#include "scene/document.hpp"

namespace talus::scene {

struct Simulation {
  double duration = 10;  // [s]
  bool until_rest = false;
  Vec3 gravity{0, 0, -9.81};
  std::optional<double> accuracy;  // relative to block size; default 1e-3 if neither is given
  std::optional<double> step;      // fixed step [s]
  enum class Method { talus, dda1988 };
  Method method = Method::talus;
  int threads = 0;            // 0: all
  bool sleeping = true;       // key simulation.sleeping
  std::string initial_state;  // path of a previous results.h5, or empty
  double min_step = 1e-9;     // [s]
};

struct Material {
  std::string name;
  double density = 0;  // [kg/m^3]
  double young = 0;    // [Pa]; 0: rigid
  double poisson = 0.25;
  double f_cm = 0;  // [Pa]; > 0: concrete
  double tensile_strength = 0, fracture_energy = 0;
  struct Roughness {
    double amplitude = 0, length = 1;
    std::uint32_t seed = 1;
  };                                   // [m], [m]
  std::optional<Roughness> roughness;  // of ground
  bool declared =
      true;  // false: named by a terrain or plane and an interface only, no [[material]] of its own
  /// Young's modulus as given, else that of concrete of the strength f_cm, 21.5 GPa (f_cm / 10 MPa)^(1/3)
  /// [fib Model Code 2010, eq. 5.1-20, quartzite aggregate]; 0: rigid [Pa].
  double modulus() const { return young > 0 || !(f_cm > 0) ? young : 21.5e9 * std::cbrt(f_cm / 10e6); }
};

/// E* of two half-spaces, 1/E* = sum (1 - nu^2) / E; a material without a modulus does not give [hertz1882].
/// 0 if neither has one [Pa].
double hertz_modulus(const Material& a, const Material& b);

/// Site: terrain file and its treatment; the mesh itself is built by geometry.
struct Site {
  std::string terrain;  // absolute path; empty: none
  int material = 0;
  bool two_sided = false;
  double decimation_error = 0;  // [m], 0: none
  double widen = 0;             // the border is drawn out by this length [m]
  std::optional<Box3> crop;     // in scene coordinates
  std::string crs;
  Vec3 origin = Vec3::Zero();  // map coordinates of the scene origin (subtracted from the terrain)
  struct MaterialArea {
    std::string polygon_file, raster_file;
    double value;
    int material;
    std::string part{}, mesh_file{};
  };              // polygon, cells of the raster with the value, part of the mesh, or a mesh of its own
  char up = 'z';  // axis of mesh files that points up
  struct Rough {
    int material;
    Material::Roughness surface;
  };
  std::vector<Rough> roughness;  // below the mesh, by material
  std::vector<MaterialArea> material_areas;
  std::string breaklines;  // absolute path; empty: none
  struct Face {
    double dip, length;
  };                                    // [rad], [m]
  std::vector<Face> faces;              // a slope in words, in place of a terrain file
  Vec3 crest = Vec3::Zero();            // middle of its upper edge
  double dip_direction = 0, width = 0;  // [rad], [m]
  bool given() const {
    return !terrain.empty() || !breaklines.empty() || !faces.empty() ||
           std::any_of(material_areas.begin(), material_areas.end(),
                       [](const MaterialArea& a) { return !a.mesh_file.empty(); });
  }
};

struct Shape {
  std::string kind =
      "box";  // box, tetrahedron, dodecahedron, icosahedron, sphere, EOTA111, EOTA221, convex, file
  Vec3 size = Vec3::Zero();  // full extents; zero: not given
  double diameter = 0;
  int longitudes = 0, latitudes = 0;
  std::vector<Vec3> vertices;   // convex
  std::string file;             // absolute path
  double volume = 0, mass = 0;  // > 0: scales the shape
  unsigned seed = 0;            // random rocks
  Vec3 aspect = Vec3::Ones();
};

/// Copies of a block that start at random places of an area.
struct Release {
  std::string polygon;  // absolute path of the GeoJSON, map coordinates
  int count = 1;
  double height = 0;  // of the lowest point above the highest ground below the block [m]
  unsigned seed = 1;
  bool turn = true;  // random orientation
  std::optional<Eigen::Vector2d>
      at;  // the one place in plan, scene coordinates: the block keeps its name and orientation
};

struct Block {
  std::string name;
  int material = 0;
  Shape shape;
  std::optional<Vec3> position;  // absent only for shape.kind == "file" and with a release
  std::optional<Release> release;
  Mat3 rotation = Mat3::Identity();
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  bool fixed = false;
  std::vector<Vec3> fixed_points;
  bool deformable = false;
};

struct JointSet {
  std::string name;
  double dip_direction = 0, dip = 0;  // [rad]
  double spacing = 0;                 // [m]
  std::optional<Vec3> origin;         // one plane passes through it
  double persistence = 1;
  double fisher = 0;                              // concentration; 0: no scatter
  std::string spacing_distribution = "constant";  // constant, exponential, normal, lognormal
  double spacing_deviation = 0;
  unsigned seed = 1;
  double bond_tension = 0, bond_shear = 0;  // rock bridges [Pa]
  std::optional<double> friction, cohesion,
      tension;  // of its faces: tan(phi), [Pa], [Pa]; absent: the interface's
};
struct Joint {
  std::string name;
  double dip_direction = 0, dip = 0;
  Vec3 through = Vec3::Zero();
  double radius = 0;          // 0: unbounded
  std::vector<Vec3> polygon;  // bounded by a polygon instead
  double bond_tension = 0,
         bond_shear = 0;  // strength of the rock bridge beyond its border [Pa]; 0: it does not break
};
struct RockMass {
  std::string blocks;  // absolute path of a block system that is cut already; empty: cut
  std::string region;  // absolute path; empty: box
  std::optional<Box3> box;
  std::string slip_surface;   // absolute path; empty: none
  bool from_terrain = false;  // cut out of the terrain, which keeps a hollow of material `bed_material`
  int material = 0, bed_material = 0;
  std::vector<JointSet> joint_sets;
  std::vector<Joint> joints;
  double least_volume = 0;  // merge slivers below [m^3]
  bool deformable = false;
  std::string block_prefix = "R";
};

/// A line in plan at which crossings are recorded.
struct Line {
  std::string name;
  std::vector<std::vector<Eigen::Vector2d>>
      parts;         // scene coordinates, each two points or more; empty: to be read from `file`
  std::string file;  // absolute path of the GeoJSON, map coordinates
};

/// A variable of an ensemble.
struct Vary {
  enum class Kind { lognormal, normal, uniform, power_law, list, table, rotation, release };
  std::string key;  // as --set takes it
  Kind kind = Kind::uniform;
  std::array<double, 3> parameters{};  // as the scene gives them, SI
  std::string unit;                    // SI unit that drawn numbers are written with; empty: bare
  std::vector<std::string> list;       // values as TOML
  std::vector<double> table;
  std::optional<double> min, max;
  int like = -1;  // an earlier variable whose draw is taken
};

struct Ensemble {
  enum class Design { random, sobol, factorial };
  struct Precision {
    std::string line, quantity;
    double percentile = 95, within = 0.1;
  };
  long members = 0;  // 0: not given
  std::optional<Precision> precision;
  std::uint32_t seed = 1;
  long step_limit = 200000;
  Design design = Design::random;
  std::vector<Vary> vary;
  double map_cell = 2;           // [m]
  double releases_per_year = 0;  // 0: not given
};

struct Coupling {
  enum class Scheme { two_way, one_way, rigid };
  Scheme scheme = Scheme::two_way;
  bool strict = false;  // audit = "strict"
  int exchanges_per_rise = 20;
  bool fragments = true;
};

struct Output {
  double interval = 0.05;          // fields [s]
  double history_interval = 0.01;  // [s]
  int checkpoint_steps = 0;        // 0: chosen
  bool report = true;
};

/// One prescribed impact of `talus impact`, if the scene has an [impact] table: a block of the given shape
/// that flies at `velocity` and touches the structure at `point` first.
struct Impact {
  int structure = 0;  // index into Scene::structures
  int material = 0;
  Shape shape;
  Vec3 point = Vec3::Zero();     // on or near the structure's surface [m]
  Vec3 velocity = Vec3::Zero();  // [m/s]
  Vec3 spin = Vec3::Zero();      // [rad/s]
  Mat3 rotation = Mat3::Identity();
  double clearance = 0.01;  // gap along the velocity at t = 0 [m]
  bool deformable = false;
  std::string trajectory;  // which row of which file it is; empty: given in the scene
};

struct Scene {
  int schema = 1;
  std::string title;
  std::string file;  // absolute path of the scene file
  Simulation simulation;
  std::optional<Site> site;
  std::vector<Plane> planes;
  std::vector<Material> materials;
  ContactLaws laws;
  std::vector<std::pair<int, int>> law_pairs;  // pairs that can meet; `laws` holds nothing for the others
  std::vector<Block> blocks;
  std::optional<RockMass> rock_mass;
  std::vector<StructureSpec> structures;
  Coupling coupling;
  Output output;
  std::optional<Impact> impact;
  std::vector<Line> lines;
  std::optional<Ensemble> ensemble;
  std::vector<std::pair<std::string, std::string>>
      files;                       // every file that was named: absolute path, SHA-256
  std::vector<std::string> notes;  // what was chosen for the user, one line per fact
  std::vector<Problem> warnings;
  std::map<std::string, Where>
      places;  // of tables and keys that the file has, by their names in messages: "block.B1.position"
  bool prescribed_impact = false;  // made by talus impact from its [impact]
  std::string resolved_json;       // every default filled in, absolute paths with hashes
};

/// The scene as scene.resolved.json: what read_scene turns back into the same scene, bit for bit.
std::string resolved_json(const Scene& scene);

/// Where the scene says what a message's key names, or the nearest table above it; null: nowhere.
const Where* place_of(const Scene& scene, const std::string& key);

/// `--set KEY=VALUE` of the command line.
using Overrides = std::vector<std::pair<std::string, std::string>>;

/// What a scene is read for. The blow of [impact] leaves out blocks, planes and a rock mass that stands by
/// itself, and asks for nothing that they need.
enum class Purpose { run, impact };

/// Reads TOML (or scene.resolved.json) and validates everything at once. Throws InputError with all problems.
Scene read_scene(const std::string& path, const Overrides& overrides = {}, Purpose purpose = Purpose::run);
/// A scene of which many others are made that differ in some of their keys. The file is parsed once; files
/// that the first scene named are not hashed again.
class Template {
 public:
  /// Throws InputError for what is no TOML, for overrides that fit nowhere, and for mistakes in [ensemble]
  /// and [[line]].
  Template(const std::string& path, const Overrides& overrides);
  const Ensemble* ensemble() const { return ensemble_ ? &*ensemble_ : nullptr; }
  const std::string& file() const { return path_; }
  /// The scene without [ensemble] and with `values` set. Throws InputError with all problems.
  Scene scene(const Overrides& values) const;
  /// The same as the text of a scene file with absolute paths.
  std::string toml(const Overrides& values) const;
  /// All of it, [ensemble] included and overrides applied, with absolute paths.
  std::string whole_toml() const;
  /// Files that every scene names, with their hashes: those of the first.
  void adopt_files(const Scene& first) { files_ = first.files; }

 private:
  Node changed(const Overrides& values) const;
  std::string path_;
  std::string directory() const;
  Node root_, whole_;  // without [ensemble], with it
  std::optional<Ensemble> ensemble_;
  std::vector<std::pair<std::string, std::string>> files_;
};

/// The same from text; `path` names the place that relative paths start from and that messages show.
Scene read_scene_text(const std::string& text, const std::string& path, const Overrides& overrides = {});

}  // namespace talus::scene
