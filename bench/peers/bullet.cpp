/// Bullet on a comparison scene: sequential impulses, no damping, no sleeping, friction of the pair as given.
#include <btBulletDynamicsCommon.h>

#include <memory>

#include "driver.hpp"

namespace {

btVector3 vector(const peers::Vector& v) { return {v[0], v[1], v[2]}; }

class World {
 public:
  World(const peers::Scene& scene, int iterations) {
    world_.setGravity(btVector3(0, 0, -9.81));
    world_.getSolverInfo().m_numIterations = iterations;
    for (const auto& t : scene.triangles) mesh_.addTriangle(vector(t[0]), vector(t[1]), vector(t[2]), true);
    ground_shape_ = std::make_unique<btBvhTriangleMeshShape>(&mesh_, true);
    ground_shape_->setMargin(0);
    add(0, btTransform::getIdentity(), ground_shape_.get(), btVector3(0, 0, 0))->setFriction(1);
    if (scene.hull.empty()) {
      shape_ = std::make_unique<btBoxShape>(vector(scene.box) / 2);
    } else {
      auto hull = std::make_unique<btConvexHullShape>();
      for (const auto& x : scene.hull) hull->addPoint(vector(x), false);
      hull->recalcLocalAabb();
      hull->initializePolyhedralFeatures();
      shape_ = std::move(hull);
    }
    for (const auto& b : scene.bodies) {
      btTransform at(btQuaternion(b.orientation[1], b.orientation[2], b.orientation[3], b.orientation[0]),
                     vector(b.position));
      btRigidBody* body = add(scene.mass, at, shape_.get(), vector(scene.inertia));
      body->setFriction(scene.friction);
      body->setLinearVelocity(btVector3(b.speed, 0, 0));
      moving_.push_back(body);
    }
  }
  ~World() {
    for (auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  void step(double h) { world_.stepSimulation(h, 0, h); }
  double contacts() const {
    int count = 0;
    for (int i = 0; i < dispatcher_.getNumManifolds(); ++i)
      count += dispatcher_.getManifoldByIndexInternal(i)->getNumContacts();
    return count;
  }
  peers::Row row(std::size_t i) const {
    const btRigidBody& b = *moving_[i];
    const btVector3 x = b.getWorldTransform().getOrigin(), v = b.getLinearVelocity(),
                    w = b.getAngularVelocity();
    const btQuaternion q = b.getWorldTransform().getRotation();
    return {x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
  }

 private:
  btRigidBody* add(btScalar mass, const btTransform& at, btCollisionShape* shape, const btVector3& inertia) {
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform = at;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setRestitution(0);
    bodies_.back()->setDamping(0, 0);
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(bodies_.back().get());
    return bodies_.back().get();
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_, &solver_, &configuration_};
  btTriangleMesh mesh_{true, false};
  std::unique_ptr<btBvhTriangleMeshShape> ground_shape_;
  std::unique_ptr<btCollisionShape> shape_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<btRigidBody*> moving_;
};

}  // namespace

int main(int count, char** text) { return peers::run<World>(count, text); }
