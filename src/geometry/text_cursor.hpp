/// Fast reading of numbers and words from a text held in memory (private to the mesh readers). Line and
/// column are counted only when a message needs them.
#pragma once
#include <charconv>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/error.hpp"

namespace talus::geometry {

class TextCursor {
 public:
  TextCursor(std::string_view text, std::string name)
      : begin_(text.data()), p_(text.data()), end_(text.data() + text.size()), name_(std::move(name)) {}

  void skip_space() {
    while (p_ < end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r' || *p_ == '\n')) ++p_;
  }
  /// Blanks within the line only.
  void skip_blank() {
    while (p_ < end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r')) ++p_;
  }
  void skip_to_blank() {
    while (p_<end_&& static_cast<unsigned char>(*p_)> ' ') ++p_;
  }
  void skip_back_to_blank() {
    while (p_ > begin_ && static_cast<unsigned char>(p_[-1]) > ' ') --p_;
  }
  bool at_end() {
    skip_space();
    return p_ >= end_;
  }
  bool at_line_end() {
    skip_blank();
    return p_ >= end_ || *p_ == '\n' || *p_ == '#';
  }
  std::string_view word() {
    skip_space();
    const char* b = p_;
    while (p_<end_&& static_cast<unsigned char>(*p_)> ' ') ++p_;
    return {b, static_cast<std::size_t>(p_ - b)};
  }
  std::string_view rest_of_line() {
    skip_blank();
    const char* b = p_;
    while (p_ < end_ && *p_ != '\n') ++p_;
    const char* e = p_;
    if (p_ < end_) ++p_;
    while (e > b && static_cast<unsigned char>(e[-1]) <= ' ') --e;
    return {b, static_cast<std::size_t>(e - b)};
  }
  /// Comments from # to the end of the line, and white space.
  void skip_comments() {
    for (skip_space(); p_ < end_ && *p_ == '#'; skip_space()) rest_of_line();
  }
  template <class T>
  T number(const char* what) {
    skip_space();
    if (p_ < end_ && *p_ == '+') ++p_;
    T x{};
    const auto [next, status] = std::from_chars(p_, end_, x);
    if (status != std::errc{}) fail(what, "must be a number");
    // Where the rest of a line does not count, what follows the comma would be lost without a word.
    if (std::is_floating_point_v<T> && next < end_ && *next == ',')
      fail(what, "has a decimal comma; mesh files have decimal points",
           "replace the commas by points: sed 's/,/./g'");
    // Nor is "100.000.0" the number before its second point. A slash keeps the indices of OBJ apart.
    if (next<end_&& static_cast<unsigned char>(*next)> ' ' && *next != '#' &&
        (std::is_floating_point_v<T> || *next != '/'))
      fail(what, "must be a number that ends at a blank");
    p_ = next;
    return x;
  }
  /// For formats that say how many numbers there are.
  void expect_end(const char* what) {
    skip_comments();
    if (!at_end()) fail(what, "goes on after all that the header counts", "correct the counts, or the file");
  }
  const char* position() const { return p_; }
  void position(const char* p) { p_ = p; }
  const char* end() const { return end_; }

  [[noreturn]] void fail(const std::string& key, const std::string& rule,
                         const std::string& remedy = "correct the file") {
    const char* line_begin = begin_;
    int line = 1;
    for (const char* c = begin_; c < p_ && c < end_; ++c)
      if (*c == '\n') ++line, line_begin = c + 1;
    const char* e = p_;
    while (e<end_&& static_cast<unsigned char>(*e)> ' ' && e - p_ < 40) ++e;
    throw InputError(Problem{.file = name_,
                             .line = line,
                             .column = static_cast<int>(p_ - line_begin) + 1,
                             .key = key,
                             .value = std::string(p_, e),
                             .rule = rule,
                             .remedy = remedy});
  }

 private:
  const char *begin_, *p_, *end_;
  std::string name_;
};

}  // namespace talus::geometry
