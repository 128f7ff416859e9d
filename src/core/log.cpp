#include "core/log.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>

#include "core/error.hpp"
#include "core/units.hpp"

namespace talus {
namespace {

/// Length of the valid UTF-8 sequence at i, 0 if there is none.
std::size_t sequence_length(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t j) { return static_cast<unsigned char>(text[j]); };
  const unsigned char c = byte(i);
  std::size_t n = 0;
  unsigned code = 0, least = 0;
  if (c < 0x80) return 1;
  if (c >= 0xc2 && c <= 0xdf) {
    n = 2;
    code = c & 0x1fU;
    least = 0x80;
  } else if ((c & 0xf0) == 0xe0) {
    n = 3;
    code = c & 0x0fU;
    least = 0x800;
  } else if (c >= 0xf0 && c <= 0xf4) {
    n = 4;
    code = c & 0x07U;
    least = 0x10000;
  } else
    return 0;
  if (i + n > text.size()) return 0;
  for (std::size_t j = 1; j < n; ++j) {
    if ((byte(i + j) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i + j) & 0x3fU);
  }
  if (code < least || code > 0x10ffff || (code >= 0xd800 && code <= 0xdfff)) return 0;
  return n;
}

}  // namespace

std::string json_quoted(std::string_view text) {
  std::string out = "\"";
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
      ++i;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
      ++i;
    } else if (const std::size_t n = sequence_length(text, i); n > 0) {
      out += text.substr(i, n);
      i += n;
    } else {
      out += "\xef\xbf\xbd";
      ++i;
    }
  }
  return out + '"';
}

JsonLog::JsonLog(const std::string& path, bool append) {
  file_.reset(std::fopen(path.c_str(), append ? "a" : "w"));
  if (file_) return;
  Problem problem;
  problem.file = path;
  problem.rule = fmt::format("the log cannot be written: {}", std::strerror(errno));
  problem.remedy = "choose a directory that can be written with -o";
  throw InputError(problem);
}

void JsonLog::write(Level level, std::string_view event, std::initializer_list<Field> fields) {
  if (!file_) return;
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto milliseconds = now.time_since_epoch().count() % 1000;
  std::string line = fmt::format("{{\"time\":\"{:%Y-%m-%dT%H:%M:%S}.{:03d}Z\",\"level\":\"{}\",\"event\":{}",
                                 fmt::gmtime(std::chrono::system_clock::to_time_t(now)), milliseconds,
                                 level == Level::info      ? "info"
                                 : level == Level::warning ? "warning"
                                                           : "error",
                                 json_quoted(event));
  for (const auto& [name, value] : fields) {
    line += "," + json_quoted(name) + ":";
    if (const bool* b = std::get_if<bool>(&value))
      line += *b ? "true" : "false";
    else if (const long* n = std::get_if<long>(&value))
      line += fmt::format("{}", *n);
    else if (const double* d = std::get_if<double>(&value))
      line += std::isfinite(*d) ? exact_text(*d) : "null";
    else
      line += json_quoted(std::get<std::string>(value));
  }
  line += "}\n";
  const std::lock_guard lock(mutex_);
  std::fwrite(line.data(), 1, line.size(), file_.get());
  std::fflush(file_.get());
}

}  // namespace talus
