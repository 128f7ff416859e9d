#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.hpp"
#include "helpers/place.hpp"
#include "io/checkpoint.hpp"
#include "io/files.hpp"

using namespace talus;
using talus::test::Place;

namespace {

io::Checkpoint sample_checkpoint() {
  io::Checkpoint c;
  c.scene_hash = "0123456789abcdef";
  c.version = "1.2.3";
  for (int i = 0; i < 5000; ++i) c.numbers["blocks.position"].push_back(std::sin(i) * 1e5);
  c.numbers["odd"] = {std::nextafter(1.0, 2.0), -0.0, 5e-324, std::numeric_limits<double>::infinity()};
  c.numbers["empty"] = {};
  c.numbers["structure/P2"] = {1, 2, 3};
  c.integers["step"] = {std::numeric_limits<std::int64_t>::max(), -1};
  return c;
}

std::string message_of(const std::filesystem::path& path, const std::string& hash,
                       const std::string& version) {
  try {
    (void)io::load_checkpoint(path, hash, version);
  } catch (const InputError& e) { return e.what(); }
  return "";
}

}  // namespace

TEST(Checkpoint, ComesBackBitForBit) {
  const Place scratch;
  const io::Checkpoint c = sample_checkpoint();
  io::save_checkpoint(scratch.path() / "c.h5", c);
  const io::Checkpoint back = io::load_checkpoint(scratch.path() / "c.h5", c.scene_hash, c.version);
  EXPECT_EQ(back.integers, c.integers);
  ASSERT_EQ(back.numbers.size(), c.numbers.size());
  for (const auto& [name, values] : c.numbers) {
    const auto& v = back.numbers.at(name);
    ASSERT_EQ(v.size(), values.size()) << name;
    EXPECT_EQ(0, values.empty() ? 0 : std::memcmp(v.data(), values.data(), values.size() * sizeof(double)))
        << name;
  }
}

TEST(Checkpoint, SaysWhyItRefuses) {
  const Place scratch;
  const auto path = scratch.path() / "c.h5";
  EXPECT_NE(message_of(path, "x", "1.2.3").find("there is no checkpoint"), std::string::npos);
  io::save_checkpoint(path, sample_checkpoint());
  EXPECT_NE(message_of(path, "another", "1.2.3").find("another scene"), std::string::npos);
  EXPECT_NE(
      message_of(path, "0123456789abcdef", "2.0.0").find("written by version 1.2.3, this is version 2.0.0"),
      std::string::npos);
  io::write_file(path, "not a checkpoint at all, but long enough to hold the guard");
  EXPECT_NE(message_of(path, "x", "1.2.3").find("is no checkpoint"), std::string::npos);
}

TEST(Checkpoint, EveryDamageIsNoticed) {
  const Place scratch;
  const auto path = scratch.path() / "c.h5";
  io::save_checkpoint(path, sample_checkpoint());
  const std::string whole = io::read_file(path);
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 211) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    io::write_file(path, damaged, false);
    const std::string text = message_of(path, "0123456789abcdef", "1.2.3");
    // Bytes 24 to 511 are padding that nothing reads.
    if (at < 24 || at >= 512) { EXPECT_FALSE(text.empty()) << at; }
  }
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{10}, std::size_t{512}, whole.size() / 2, whole.size() - 1}) {
    io::write_file(path, std::string_view(whole).substr(0, size), false);
    EXPECT_FALSE(message_of(path, "0123456789abcdef", "1.2.3").empty()) << size;
  }
}
