#include "io/checksum.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace talus::io {
namespace {

// Slicing by eight: table k advances the register by k further zero bytes, so that eight bytes cost eight
// look-ups.
using Tables = std::array<std::array<std::uint64_t, 256>, 8>;

constexpr Tables make_tables() {
  Tables t{};
  for (unsigned i = 0; i < 256; ++i) {
    std::uint64_t r = i;
    for (int bit = 0; bit < 8; ++bit) r = (r >> 1) ^ ((r & 1) ? 0xC96C5795D7870F42ULL : 0);
    t[0][i] = r;
  }
  for (unsigned i = 0; i < 256; ++i)
    for (std::size_t k = 1; k < 8; ++k) t[k][i] = t[0][t[k - 1][i] & 0xff] ^ (t[k - 1][i] >> 8);
  return t;
}

constexpr Tables tables = make_tables();
static_assert(std::endian::native == std::endian::little);

}  // namespace

std::uint64_t crc64(std::string_view bytes, std::uint64_t previous) {
  std::uint64_t r = ~previous;
  const char* p = bytes.data();
  std::size_t n = bytes.size();
  for (; n >= 8; n -= 8, p += 8) {
    std::uint64_t w;
    std::memcpy(&w, p, 8);
    w ^= r;
    r = 0;
    for (unsigned k = 0; k < 8; ++k) r ^= tables[7 - k][(w >> (8 * k)) & 0xff];
  }
  for (; n > 0; --n, ++p) r = tables[0][(r ^ static_cast<unsigned char>(*p)) & 0xff] ^ (r >> 8);
  return ~r;
}

}  // namespace talus::io
