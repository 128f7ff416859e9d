#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "helpers/place.hpp"
#include "io/journal.hpp"
#include "io/results.hpp"

namespace fs = std::filesystem;
using namespace talus;
using talus::test::Place;

/// A corpus of an older format is refused at its header, and the fuzzer never gets behind it.
TEST(Journal, TheWholeOneOfTheFuzzersCorpusIsOfThePresentFormat) {
  std::ifstream in(fs::path(TALUS_SOURCE_DIR) / "tests/fuzz/corpus/journal/whole", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  ASSERT_FALSE(bytes.empty());
  const Place scratch;
  {
    io::JournalWriter writer(scratch.path() / "journal.bin", 0);
    for (std::string_view rest = std::string_view(bytes).substr(1);
         rest.size() >= 3;) {  // as tests/fuzz/fuzz_journal.cpp takes it apart
      std::uint16_t length = 0;
      std::memcpy(&length, rest.data() + 1, 2);
      const auto kind = static_cast<unsigned char>(rest[0]);
      writer.append(static_cast<io::RecordKind>(kind % 16), rest.substr(3, length), kind / 16U);
      rest.remove_prefix(3U + length);
    }
  }
  const io::BuiltResults built = io::build_results(scratch.path());
  EXPECT_GT(built.rows, 0U);
  EXPECT_GT(built.fields, 0U);
}
