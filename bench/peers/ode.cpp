/// ODE on a comparison scene of boxes: QuickStep, no sleeping, friction pyramid in proportion to the normal
/// force.
#include <ode/ode.h>

#include "driver.hpp"

namespace {

class World {
 public:
  World(const peers::Scene& scene, int iterations) : friction_(scene.friction) {
    if (!scene.hull.empty())
      throw std::runtime_error("ODE has no contact of a convex hull with a triangle mesh");
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateMaskAll);
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    joints_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, 0, 0, -9.81);
    dWorldSetQuickStepNumIterations(world_, iterations);
    for (const auto& t : scene.triangles)
      for (const auto& x : t) {
        index_.push_back(static_cast<dTriIndex>(index_.size()));
        vertices_.insert(vertices_.end(), x.begin(), x.end());
      }
    mesh_ = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildDouble(mesh_, vertices_.data(), 3 * sizeof(double), static_cast<int>(index_.size()),
                                index_.data(), static_cast<int>(index_.size()), 3 * sizeof(dTriIndex));
    dCreateTriMesh(space_, mesh_, nullptr, nullptr, nullptr);
    for (const auto& b : scene.bodies) {
      dMass mass;
      dMassSetBoxTotal(&mass, scene.mass, scene.box[0], scene.box[1], scene.box[2]);
      dBodyID body = dBodyCreate(world_);
      dBodySetMass(body, &mass);
      dGeomSetBody(dCreateBox(space_, scene.box[0], scene.box[1], scene.box[2]), body);
      dBodySetPosition(body, b.position[0], b.position[1], b.position[2]);
      const dQuaternion q = {b.orientation[0], b.orientation[1], b.orientation[2], b.orientation[3]};
      dBodySetQuaternion(body, q);
      dBodySetLinearVel(body, b.speed, 0, 0);
      dBodySetAutoDisableFlag(body, 0);
      bodies_.push_back(body);
    }
  }
  void step(double h) {
    contacts_ = 0;
    dSpaceCollide(space_, this,
                  [](void* self, dGeomID a, dGeomID b) { static_cast<World*>(self)->meet(a, b); });
    dWorldQuickStep(world_, h);
    dJointGroupEmpty(joints_);
  }
  double contacts() const { return contacts_; }
  peers::Row row(std::size_t i) const {
    dBodyID b = bodies_[i];
    const dReal *x = dBodyGetPosition(b), *q = dBodyGetQuaternion(b), *v = dBodyGetLinearVel(b),
                *w = dBodyGetAngularVel(b);
    return {x[0], x[1], x[2], q[0], q[1], q[2], q[3], v[0], v[1], v[2], w[0], w[1], w[2]};
  }

 private:
  void meet(dGeomID a, dGeomID b) {
    dBodyID first = dGeomGetBody(a), second = dGeomGetBody(b);
    if (first == nullptr && second == nullptr) return;
    std::array<dContact, 16> contact{};
    const int count = dCollide(a, b, static_cast<int>(contact.size()), &contact[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      contact[static_cast<std::size_t>(i)].surface.mode = dContactApprox1;
      contact[static_cast<std::size_t>(i)].surface.mu = friction_;
      dJointAttach(dJointCreateContact(world_, joints_, &contact[static_cast<std::size_t>(i)]), first,
                   second);
    }
    contacts_ += count;
  }

  double friction_;
  int contacts_ = 0;
  dWorldID world_ = nullptr;
  dSpaceID space_ = nullptr;
  dJointGroupID joints_ = nullptr;
  dTriMeshDataID mesh_ = nullptr;
  std::vector<double> vertices_;
  std::vector<dTriIndex> index_;
  std::vector<dBodyID> bodies_;
};

}  // namespace

int main(int count, char** text) { return peers::run<World>(count, text); }
