#include "io/files.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "helpers/place.hpp"

namespace talus::io {
namespace {

// Members take hours, and so may a run: neither gives way to results of another kind in its directory.
TEST(Files, AnEnsembleIsReplacedByAnEnsembleAlone) {
  const test::Place place;
  EXPECT_NO_THROW(check_directory(place.path() / "new", Results::run));
  std::ofstream(place.path() / marker_name) << "x";
  std::filesystem::create_directory(place.path() / "journal");  // not finished
  EXPECT_THROW(check_directory(place.path(), Results::run), InputError);
  EXPECT_THROW(check_directory(place.path(), Results::other), InputError);
  EXPECT_NO_THROW(check_directory(place.path(), Results::ensemble));
  std::filesystem::remove(place.path() / "journal");
  std::ofstream(place.path() / "ensemble.h5") << "x";
  EXPECT_THROW((void)claim_directory(place.path(), Results::run), InputError);
  EXPECT_TRUE(std::filesystem::exists(place.path() / "ensemble.h5"));
  (void)claim_directory(place.path(), Results::ensemble);
  EXPECT_FALSE(std::filesystem::exists(place.path() / "ensemble.h5"));
}

TEST(Files, ARunIsReplacedByARunAlone) {
  for (const char* left : {"results.h5", "journal.bin", "checkpoint.h5"}) {
    const test::Place place;
    for (const auto& name : {std::string(marker_name), std::string("summary.json"), std::string(left)})
      std::ofstream(place.path() / name) << "x";
    EXPECT_THROW(check_directory(place.path(), Results::ensemble), InputError) << left;
    EXPECT_THROW((void)claim_directory(place.path(), Results::other), InputError) << left;
    EXPECT_TRUE(std::filesystem::exists(place.path() / left));
    EXPECT_NO_THROW(check_directory(place.path(), Results::run));
  }
}

}  // namespace
}  // namespace talus::io
