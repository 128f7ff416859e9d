/// CRC-64 (ECMA-182 polynomial, reflected: "CRC-64/XZ") of bytes. Guards journals and checkpoints against
/// damage, not forgery.
#pragma once
#include <cstdint>
#include <string_view>

namespace talus::io {

std::uint64_t crc64(std::string_view bytes, std::uint64_t previous = 0);

}  // namespace talus::io
