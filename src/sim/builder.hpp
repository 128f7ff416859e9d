/// From a scene to the world of its run. Internal to sim: others call build() of world.hpp.
///
/// Everything that exists comes from here, in the order of build(): ground, blocks, rock mass, laws,
/// structures. Problems are collected, so that a user sees all of them at once.
#pragma once
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "contact/geometry/shape_pool.hpp"
#include "core/error.hpp"
#include "geometry/terrain.hpp"
#include "sim/ground.hpp"
#include "sim/held_points.hpp"
#include "sim/shared.hpp"
#include "sim/world.hpp"

namespace talus::sim {

class Builder {
 public:
  /// `shared`: what other worlds have in common with this one; null: nothing.
  Builder(scene::Scene scene, Report report, Shared* shared);
  /// Throws InputError with every problem found. To be called once.
  std::unique_ptr<World> build();

 private:
  void problem(std::string key, std::string value, std::string rule, std::string remedy);
  /// Where the scene's file says it, if it does.
  void locate(Problem& p) const;
  /// Throws InputError with all that was found, warnings too, in the order of the file.
  [[noreturn]] void fail();
  void add_problems(const std::vector<Problem>& found);
  void add_warnings(const std::vector<Problem>& found);

  // Ground (build_ground.cpp)
  void add_terrain();
  /// What blocks touch of the terrain: the surface, and the walls in which the ground ends.
  void index_terrain();
  void check_span();
  void check_size(std::size_t i);
  /// A block that moves starts outside of the solid, which is all that lies below the terrain.
  void check_buried(std::size_t i);
  void check_buried_mass();  // the same of the rock mass, as one fault
  void check_release_areas();
  void check_ground();

  // Blocks (build_blocks.cpp)
  void push(dda::Model::Block b, const Vec3& c, const Mat3& rotation, const Vec3& v, const Vec3& w);
  dda::Model::Block make_block(const std::string& name, Polyhedron shape, int material, bool deformable);
  void add_block(const scene::Block& b);
  void check_held(const dda::Model::Block& b, const Vec3& c, const Mat3& rotation, const Vec3& x);
  /// Velocity and spin with which a held block starts: as given, or the nearest that leave its points at
  /// rest, with a warning.
  RigidMotion held_start(const dda::Model::Block& b, const Mat3& rotation, const RigidMotion& given);
  void add_copies(const scene::Block& b, const Polyhedron& body);
  void add_rock_mass();
  void add_block_system(const scene::RockMass& mass);

  // Laws of contact (build_laws.cpp)
  /// Keys that the scene format has and this version cannot honour: an error each, never a silent drop.
  void refuse_what_is_missing();
  /// What the curved laws need beyond their own keys: elastic moduli for Hertz, a stiffness for crushing.
  void complete_laws();
  /// Springs that a block's own weight presses by more than a tenth of its inradius are an error, by more
  /// than a hundredth a warning. Springs on which a block swings faster than the shortest step are an error.
  void check_stiffness();
  void check_too_stiff(const ContactLaw& law, int i, int j);
  Problem problem_of(const ContactLaw& law, int i, int j) const;

  // Structures (build_structures.cpp)
  /// Where a structure's reports go; what begins with "warning: " is one, "; " before what to do.
  Report report_of(const std::string& name);
  void add_structures();
  void warn_of_unused_loads(const StructureSpec& spec);
  /// The nearest point of the structure is followed, but not one of another place altogether.
  void warn_of_no_strikes(const StructureSpec& spec);
  void check_probes(const StructureSpec& spec, const Box3& bounds);
  /// Structures with a law between their materials may touch: nodes of the finer surface against faces of the
  /// coarser one.
  void pair_structures();
  void pair_grounds();
  void warn_of_sudden_weight();
  /// A block far smaller than the cell faces it strikes presses on one face: what happens below the cell size
  /// is not resolved.
  void warn_of_small_blocks();

  /// Blocks in the order of their names, whatever the scene's: sums and searches then go the same way however
  /// the blocks are listed.
  void sort_blocks();
  void fill_header();

  std::unique_ptr<World> world_;
  dda::Model model_;
  coupling::SystemState state_;
  coupling::Environment env_;
  Shared* shared_ = nullptr;
  std::shared_ptr<const geometry::Terrain> terrain_;
  bool ground_failed_ = false;  // there is a terrain, and it cannot be read
  std::set<std::string> names_;
  std::size_t single_blocks_ = 0;  // of the scene's [[block]]s; the rock mass comes after them
  Occupied occupied_;              // by blocks of release areas
  ShapePool shapes_;               // of all blocks so far
  std::vector<Problem> problems_;
};

}  // namespace talus::sim
