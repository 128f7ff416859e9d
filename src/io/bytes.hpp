/// Values to bytes and back, little-endian as in memory, for the journal. A reader that runs past its end
/// throws std::out_of_range, which build_results() turns into InputError.
#pragma once
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/types.hpp"

namespace talus::io {

class ByteWriter {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    raw(&value, sizeof(T));
  }
  void put(const Vec3& v) { raw(v.data(), 3 * sizeof(double)); }
  void put(std::string_view text) {
    put(static_cast<std::uint64_t>(text.size()));
    raw(text.data(), text.size());
  }
  void put(const std::string& text) { put(std::string_view(text)); }
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint64_t>(values.size()));
    if constexpr (std::is_arithmetic_v<T>)
      raw(values.data(), values.size() * sizeof(T));
    else
      for (const T& v : values) put(v);
  }
  void raw(const void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  const std::string& bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  std::string bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  void get(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    raw(&value, sizeof(T));
  }
  void get(bool& flag) { flag = take<std::uint8_t>() != 0; }  // a bool that is neither 0 nor 1 is undefined
  void get(Vec3& v) { raw(v.data(), 3 * sizeof(double)); }
  void get(std::string& text) {
    text.resize(count(1));
    raw(text.data(), text.size());
  }
  template <class T>
  void get(std::vector<T>& values) {
    values.resize(count(1));
    if constexpr (std::is_arithmetic_v<T>)
      raw(values.data(), values.size() * sizeof(T));
    else
      for (T& v : values) get(v);
  }
  template <class T>
  T take() {
    T value{};
    get(value);
    return value;
  }
  void raw(void* data, std::size_t size) {
    if (size > bytes_.size() - at_) throw std::out_of_range("record ends early");
    if (size > 0) std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  // A damaged count must not lead to a huge allocation: no element is smaller than a byte.
  std::size_t count(std::size_t least) {
    const auto n = take<std::uint64_t>();
    if (n > (bytes_.size() - at_) / least) throw std::out_of_range("count beyond the record");
    return static_cast<std::size_t>(n);
  }
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace talus::io
