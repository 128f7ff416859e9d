#include <gtest/gtest.h>

#include "core/error.hpp"
#include "helpers/place.hpp"
#include "io/final_state.hpp"

using namespace talus;

namespace {

sim::FinalState sample_state() {
  sim::FinalState s;
  s.blocks["B 1"] = {Vec3(1, 2, 3),        Vec3(4, 5, 6),    Vec3(7, 8, 9), Quat(0.5, 0.5, 0.5, 0.5),
                     Vec6::Constant(1e-3), Vec6::Constant(2)};
  s.structures["wall"] = {
      {Vec3(1, 0, 0), Vec3(0, 1, 0)}, {3, 1, 4, 1, 5}, {{{Box3(Vec3(1, 2, 3), Vec3(4, 5, 6)), 0.1}, 7e3}}};
  s.bodies = {{"block B 1", -5}, {"structure wall", std::int64_t{1} << 62}};
  sim::FinalState::Contact c{0, 1, {}};
  c.memory.feature = ~std::uint64_t{0};
  c.memory.force = Vec3(1, -2, 3);
  c.memory.offset = 1e-9;
  c.memory.normal = Vec3(0, 0, -1);
  c.memory.broken = true;
  s.contacts = {c, c};
  s.contacts[1].memory.glued = true, s.contacts[1].memory.broken = false;
  return s;
}

void write(const std::filesystem::path& path, const sim::FinalState& s) {
  io::Hdf5File file = io::Hdf5File::create(path);
  io::write_final_state(file, s);
  file.close();
}

}  // namespace

TEST(FinalState, ComesBackBitForBit) {
  const test::Place scratch;
  write(scratch.path() / "a.h5", sample_state());
  const sim::FinalState s = io::read_final_state(scratch.path() / "a.h5");
  EXPECT_EQ(s.blocks.at("B 1").w, Vec3(7, 8, 9));
  EXPECT_EQ(s.structures.at("wall").history, sample_state().structures.at("wall").history);
  ASSERT_EQ(s.structures.at("wall").halved.size(), 1U);
  const auto& [zone, energy] = s.structures.at("wall").halved[0];
  EXPECT_EQ(zone.region.min(), Vec3(1, 2, 3));
  EXPECT_EQ(zone.region.max(), Vec3(4, 5, 6));
  EXPECT_EQ(zone.cell_size, 0.1);
  EXPECT_EQ(energy, 7e3);
  EXPECT_EQ(s.bodies, sample_state().bodies);
  ASSERT_EQ(s.contacts.size(), 2U);
  const coupling::ContactMemory &m = s.contacts[0].memory, expected = sample_state().contacts[0].memory;
  EXPECT_EQ(s.contacts[0].partner, 1);
  EXPECT_EQ(m.feature, expected.feature);
  EXPECT_EQ(m.force, expected.force);
  EXPECT_EQ(m.offset, expected.offset);
  EXPECT_EQ(m.normal, expected.normal);
  EXPECT_TRUE(m.broken && !m.glued);
  EXPECT_TRUE(s.contacts[1].memory.glued && !s.contacts[1].memory.broken);
}

TEST(FinalState, WithoutContactsAsWell) {
  const test::Place scratch;
  write(scratch.path() / "a.h5", {});
  EXPECT_TRUE(io::read_final_state(scratch.path() / "a.h5").contacts.empty());
}

TEST(FinalState, BodiesThatAreNotInTheListAreRefused) {
  const test::Place scratch;
  sim::FinalState s = sample_state();
  s.contacts[1].partner = 2;
  write(scratch.path() / "a.h5", s);
  EXPECT_THROW((void)io::read_final_state(scratch.path() / "a.h5"), InputError);
}
