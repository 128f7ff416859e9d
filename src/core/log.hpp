/// A log as JSON lines: one object a line with `time` (UTC, ISO 8601), `level`, `event`, and the fields
/// given.
#pragma once
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace talus {

/// Text with the quotes and escapes of JSON. Bytes that are no UTF-8 become U+FFFD.
std::string json_quoted(std::string_view text);

class JsonLog {
 public:
  using Value = std::variant<bool, long, double, std::string>;
  using Field = std::pair<std::string_view, Value>;
  enum class Level { info, warning, error };

  JsonLog() = default;                                             // drops everything
  explicit JsonLog(const std::string& path, bool append = false);  // throws InputError if it cannot be opened

  void write(Level level, std::string_view event, std::initializer_list<Field> fields = {});
  void info(std::string_view event, std::initializer_list<Field> fields = {}) {
    write(Level::info, event, fields);
  }
  void warning(std::string_view event, std::initializer_list<Field> fields = {}) {
    write(Level::warning, event, fields);
  }
  void error(std::string_view event, std::initializer_list<Field> fields = {}) {
    write(Level::error, event, fields);
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
  std::mutex mutex_;
};

}  // namespace talus
