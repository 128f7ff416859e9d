// A journal whose checksums are right and whose records are not: the input is a list of (kind + 16 tag,
// length, payload), of which a journal is made, so that the fuzzer reaches behind the checksum. Even choices
// go through the decoders alone, odd ones to results.h5.
#include <cstring>

#include "fuzz_input.hpp"
#include "io/files.hpp"
#include "io/journal.hpp"
#include "io/results.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace talus;
  const fuzz::Input input(data, size);
  const std::filesystem::path journal = fuzz::directory() / "journal.bin";
  fuzz::read_or_refuse([&] {
    try {
      if (input.choice % 4 == 3) {  // raw bytes: the reader stops where they stop making sense
        fuzz::file("journal.bin", input.bytes);
      } else {
        io::JournalWriter writer(journal, 0);
        for (std::string_view rest = input.bytes; rest.size() >= 3;) {
          std::uint16_t length = 0;
          std::memcpy(&length, rest.data() + 1, 2);
          const auto kind = static_cast<io::RecordKind>(static_cast<unsigned char>(rest[0]) % 16);
          const auto tag = static_cast<unsigned char>(rest[0]) / 16U;
          rest.remove_prefix(3);
          const std::string_view payload = rest.substr(0, length);
          writer.append(kind, payload, tag);
          rest.remove_prefix(payload.size());
        }
      }
      (void)io::build_results(fuzz::directory());
    } catch (const io::WriteError&) {  // an extent that HDF5 refuses
    }
  });
  return 0;
}
