/// What the blocks can touch, apart from each other: planes, terrain, structures. Null parts cost nothing.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/geometry/surface.hpp"
#include "contact/laws/law.hpp"
#include "contact/structures/structure.hpp"

namespace talus::coupling {

/// What a block, or a node of a structure, may touch.
struct Partner {
  enum class Kind : std::uint8_t { block, plane, terrain, structure };
  Kind kind = Kind::block;
  int index = 0;
  bool operator==(const Partner&) const = default;
  std::uint64_t id() const {
    return (static_cast<std::uint64_t>(kind) << 32) | static_cast<std::uint32_t>(index);
  }
};

/// A structure in the coupled step. `fixed_surface`: schemes "rigid" and "one-way", its undeformed skin is a
/// fixed obstacle. `one_way`: what the blocks did to that obstacle is put on the structure afterwards. A
/// fixed surface of scheme "rigid" never changes, and may be that of several worlds.
struct StructurePart {
  std::shared_ptr<Structure> structure;
  std::shared_ptr<contact::SurfaceIndex> index;
  int material = 0;
  bool fixed_surface = false;
  bool one_way = false;
  bool stepped() const { return !fixed_surface || one_way; }
  bool lagging_index = false;  // skin moved since the last refit
  /// What its index was left focused on by an island of structures alone, from one stretch to the next; none
  /// if `between` is negative.
  struct Followed {
    double between = -1;                  // within this distance of the partners' skins [m],
    double path = 0;                      // which have moved by no more than this since then [m]
    std::uint64_t revision = 0;           // of its own skin
    std::vector<std::uint64_t> partners;  // Partner::id() of structures and grounds, ascending
  } followed;
  std::vector<int> grounds;    // of Environment::grounds, that its nodes meet: there is a law between them
  double touch_stiffness = 0;  // extra normal compliance is 1 / this [N/m]; 0: none
};

/// What is fixed, as nodes of structures meet it (ground.hpp): a plane, the terrain, or a block without
/// degrees of freedom.
struct Ground {
  Partner partner;
  std::shared_ptr<const contact::SurfaceIndex> faces;  // null: a plane
};

/// A rock bridge between two blocks across one joint: strengths spread over the shared area, lost for good
/// where they are exceeded.
struct Bond {
  int a = 0, b = 0;                  // blocks, a < b
  int joint = 0;                     // as in Polyhedron::face_joint_set
  double cohesion = 0, tension = 0;  // added to the law's [Pa]
};

/// The index of a skin that moves. Its faces are the elements' from the start, so that it depends on the skin
/// as it is and not on whether it has moved before: a restart finds the same contacts.
inline std::unique_ptr<contact::SurfaceIndex> moving_index(const TriangleSurface& skin) {
  auto index = std::make_unique<contact::SurfaceIndex>(skin);
  index->refit(skin);
  return index;
}

struct Environment {
  std::vector<Plane> planes;
  std::shared_ptr<const contact::SurfaceIndex> terrain;  // null: none; may be that of several worlds
  ContactLaws laws;
  /// At structures of scheme "one-way": restitution of springs by dashpots, as at those that move, so that
  /// the force recorded there has the duration that the spring gives it.
  ContactLaws one_way_laws;
  const ContactLaws& laws_at(const Partner& a) const {
    return a.kind == Partner::Kind::structure && structures[static_cast<std::size_t>(a.index)].one_way
               ? one_way_laws
               : laws;
  }
  std::vector<std::optional<ContactLaw>> joint_laws;  // by joint of the rock mass; empty: the materials' law
  std::vector<Bond> bonds;                            // sorted by (a, b, joint)
  double bond_stretch = 0;  // by which bonds on springs may part before they break [m]
  std::vector<StructurePart> structures;
  std::vector<std::pair<int, int>>
      touching_structures;      // pairs with a law between them, the finer skin second
  std::vector<Ground> grounds;  // empty where no structure is stepped
};

/// Cumulative work since the start [J], dissipation positive. Each term is added where the loss happens.
struct Ledger {
  double friction_work = 0;           // - tangential impulse . mean slip velocity
  double damping_work = 0;            // restitution losses of impacts and viscous damping
  double yield_work = 0;              // crushed out of ground and cushions whose laws harden or end
  double ploughing_work = 0;          // against the ground in the way
  double vegetation_work = 0;         // drag of what grows on the ground
  double algorithmic = 0;             // drift projection, implicit contact, position corrections
  double contact = 0;                 // energy now stored in contact springs (not cumulative)
  double structure_contact_work = 0;  // work of contact impulses on structures
  double blocks_contact_work = 0;     // work of the same impulses on blocks
  double dissipated() const {
    return friction_work + damping_work + yield_work + ploughing_work + vegetation_work + algorithmic;
  }
  Ledger& operator+=(const Ledger& o) {
    friction_work += o.friction_work;
    damping_work += o.damping_work;
    yield_work += o.yield_work;
    ploughing_work += o.ploughing_work;
    vegetation_work += o.vegetation_work;
    algorithmic += o.algorithmic;
    contact += o.contact;
    structure_contact_work += o.structure_contact_work;
    blocks_contact_work += o.blocks_contact_work;
    return *this;
  }
};

/// Where a face was bonded at one of its corners, in the axes of its bodies: the same points of both for as
/// long as the bond holds, whatever features a search finds there. Of bonds on structures that deform it is
/// not known.
struct BondedAt {
  Vec3 point_a = Vec3::Zero(), point_b = Vec3::Zero();  // [m]
  Vec3 normal = Vec3::Zero();                           // out of A, in its axes
  double area = 0;                                      // 0: not known [m^2]
  int face_a = -1, face_b = -1;                         // of the material, and of the joint
};

/// What a contact remembers between steps: warm start and shear spring. Plain data, part of the state.
struct ContactMemory {
  std::uint64_t partner = 0;  // kind and index of body A
  std::uint64_t feature = 0;
  Vec3 force = Vec3::Zero();          // mean force of the last step, world [N]
  Vec3 shear = Vec3::Zero();          // elastic tangential displacement of B against A, world [m]
  double normal_energy = 0;           // stored in the normal spring; after a leapfrog's step the mean of both
                                      // its ends [J]
  double end_energy = 0;              // the same at the indentation where the next step starts from [J]
  Vec3 shear_way = Vec3::Zero();      // by which the last step stretched it, world [m]
  double shear_energy = 0;            // stored in the shear spring [J]
  double crushed = 0;                 // indentation lost for good [m]
  double indentation = 0;             // of the normal spring, where the next step starts from [m]
  double offset = 0;                  // gap that it acts on less the geometric one [m]
  double stiffness = 0;               // of the spring [N/m]
  Vec3 corner_normal = Vec3::Zero();  // in the axes of the block whose corner it is, of its cell; 0: none
  double lasted = 0;                  // length of the last step, where it was a leapfrog's; else 0 [s]
  Vec3 place = Vec3::Zero();          // where, world [m]
  Vec3 normal = Vec3::Zero();         // out of the partner
  bool broken = false;                // cohesion and tension lost
  bool glued = false;                 // it has been closed since the start: it holds in tension too
  BondedAt bonded{};
};

/// Feature under which a block remembers how deep it was born inside a partner, in `indentation`: pieces of a
/// structure start where they come off. No contact of the pair counts what lies above; it shrinks as the two
/// part.
constexpr std::uint64_t born_inside = ~std::uint64_t{0};

/// Per block B, its contacts, sorted by (partner, feature).
using ContactHistory = std::vector<std::vector<ContactMemory>>;

}  // namespace talus::coupling
