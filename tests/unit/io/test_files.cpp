#include "io/files.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "helpers/place.hpp"

namespace talus::io {
namespace {

// Members take hours; a run of the same scene would have its results in the same directory by default.
TEST(Files, AnEnsembleIsNotReplacedByARun) {
  const test::Place place;
  EXPECT_NO_THROW(spare_ensemble(place.path() / "new"));
  for (const char* finished : {"summary.json", "results.h5", "journal.bin"})
    std::ofstream(place.path() / finished) << "x";
  EXPECT_NO_THROW(spare_ensemble(place.path()));
  std::filesystem::create_directory(place.path() / "journal");  // not finished
  EXPECT_THROW(spare_ensemble(place.path()), InputError);
  std::filesystem::remove(place.path() / "journal");
  std::ofstream(place.path() / "ensemble.h5") << "x";
  EXPECT_THROW(spare_ensemble(place.path()), InputError);
}

}  // namespace
}  // namespace talus::io
