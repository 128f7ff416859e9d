#include "core/text_file.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>

#include "core/error.hpp"

namespace talus {
namespace {

[[noreturn]] void refuse(const std::string& name, std::string rule, std::string remedy) {
  Problem p;
  p.file = name;
  p.key = "file";
  p.rule = std::move(rule);
  p.remedy = std::move(remedy);
  throw InputError(std::move(p));
}

bool begins(const std::string& bytes, std::string_view mark) {
  return bytes.compare(0, mark.size(), mark) == 0;
}

using namespace std::string_view_literals;
constexpr std::string_view utf8_mark = "\xEF\xBB\xBF"sv, little_mark = "\xFF\xFE"sv, big_mark = "\xFE\xFF"sv,
                           little_32_mark = "\xFF\xFE\0\0"sv, big_32_mark = "\0\0\xFE\xFF"sv;

void append(std::string& out, std::uint32_t c) {
  if (c < 0x80) {
    out += static_cast<char>(c);
  } else if (c < 0x800) {
    out += static_cast<char>(0xC0 | (c >> 6));
    out += static_cast<char>(0x80 | (c & 0x3F));
  } else if (c < 0x10000) {
    out += static_cast<char>(0xE0 | (c >> 12));
    out += static_cast<char>(0x80 | ((c >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (c & 0x3F));
  } else {
    out += static_cast<char>(0xF0 | (c >> 18));
    out += static_cast<char>(0x80 | ((c >> 12) & 0x3F));
    out += static_cast<char>(0x80 | ((c >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (c & 0x3F));
  }
}

std::string from_utf16(const std::string& bytes, std::size_t first, bool little, const std::string& name) {
  const char* const remedy = "save it as UTF-8";
  if ((bytes.size() - first) % 2 != 0) refuse(name, "is UTF-16 text that is cut short", remedy);
  const auto unit = [&](std::size_t i) {
    const auto a = static_cast<unsigned char>(bytes[i]), b = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<std::uint32_t>(little ? a | (b << 8) : (a << 8) | b);
  };
  std::string out;
  out.reserve(bytes.size() / 2);
  for (std::size_t i = first; i < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size() && unit(i + 2) >= 0xDC00 && unit(i + 2) < 0xE000) {
      c = 0x10000 + ((c - 0xD800) << 10) + (unit(i + 2) - 0xDC00);
      i += 2;
    } else if (c >= 0xD800 && c < 0xE000) {
      refuse(name, "is UTF-16 text that is damaged", remedy);
    }
    append(out, c);
  }
  return out;
}

/// Characters below 256 alone, as numbers and keys are: every other byte is zero.
bool looks_like_utf16(const std::string& bytes, std::size_t zero) {
  constexpr std::size_t seen = 64;
  const std::size_t n = std::min(bytes.size(), seen) / 2 * 2;
  if (n < 4) return false;
  for (std::size_t i = 0; i < n; ++i)
    if ((bytes[i] == 0) != (i % 2 == zero)) return false;
  return true;
}

}  // namespace

std::string read_bytes(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  std::string bytes;
  if (file && std::fseek(file.get(), 0, SEEK_END) == 0) {
    const long size = std::ftell(file.get());
    std::rewind(file.get());
    if (size >= 0 && size < (1l << 40)) {
      bytes.resize(static_cast<std::size_t>(size));
      if (std::fread(bytes.data(), 1, bytes.size(), file.get()) == bytes.size()) return bytes;
    }
  }
  refuse(path, "cannot be read", "check the path; one in a scene file is relative to that file");
}

bool has_byte_order_mark(const std::string& bytes) {
  return begins(bytes, utf8_mark) || begins(bytes, little_mark) || begins(bytes, big_mark) ||
         begins(bytes, big_32_mark);
}

std::string as_utf8(std::string bytes, const std::string& name) {
  if (begins(bytes, little_32_mark) || begins(bytes, big_32_mark))
    refuse(name, "is UTF-32 text", "save it as UTF-8");
  if (begins(bytes, utf8_mark))
    bytes.erase(0, utf8_mark.size());
  else if (begins(bytes, little_mark))
    bytes = from_utf16(bytes, 2, true, name);
  else if (begins(bytes, big_mark))
    bytes = from_utf16(bytes, 2, false, name);
  else if (looks_like_utf16(bytes, 1))
    bytes = from_utf16(bytes, 0, true, name);
  else if (looks_like_utf16(bytes, 0))
    bytes = from_utf16(bytes, 0, false, name);
  if (bytes.find('\r') != std::string::npos && bytes.find('\n') == std::string::npos)
    std::replace(bytes.begin(), bytes.end(), '\r', '\n');
  return bytes;
}

void write_bytes(const std::string& path, std::string_view bytes) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  const bool good = file && std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  if ((file && std::fclose(file) != 0) || !good) refuse(path, "cannot be written", "check the directory");
}

std::string read_text(const std::string& path) { return as_utf8(read_bytes(path), path); }

}  // namespace talus
