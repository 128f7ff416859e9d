/// A thin layer over the serial HDF5 C library: typed arrays by path, row-wise writing, attributes. No HDF5
/// type leaves this header. Failures to read throw InputError naming file and dataset; failures to write
/// throw WriteError.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace talus::io {

using Dims = std::vector<std::size_t>;

/// An array read back; row-major.
template <class T>
struct Array {
  Dims dims;
  std::vector<T> values;
  std::size_t rows() const { return dims.empty() ? 0 : dims[0]; }
  /// Values per row.
  std::size_t stride() const {
    std::size_t n = 1;
    for (std::size_t k = 1; k < dims.size(); ++k) n *= dims[k];
    return n;
  }
};

class Hdf5File {
 public:
  /// `user_block` bytes (0, or a power of two of at least 512) are left free at the start of the file.
  static Hdf5File create(const std::filesystem::path& path, std::size_t user_block = 0);
  static Hdf5File open(const std::filesystem::path& path);
  Hdf5File(Hdf5File&& other) noexcept;
  Hdf5File& operator=(Hdf5File&&) = delete;
  ~Hdf5File();
  void close();  // throws WriteError if what was written cannot be stored

  // Writing. Groups on the way are created.
  /// What hardly shrinks is quicker kept `plain` than deflated.
  enum class Packing { deflated, plain };
  template <class T>  // double, float, std::int64_t, std::int32_t, std::uint8_t
  void write(const std::string& path, std::span<const T> values, const Dims& dims,
             const std::string& unit = {}, const std::string& description = {},
             Packing packing = Packing::deflated);
  /// The same in parts of whole rows, which `parts` gives one after the other.
  template <class T>
  void write_parts(const std::string& path, const Dims& dims,
                   const std::function<void(const std::function<void(std::span<const T>)>&)>& parts,
                   const std::string& unit, const std::string& description,
                   Packing packing = Packing::deflated);
  void write(const std::string& path, const std::vector<std::string>& texts,
             const std::string& description = {});
  void attribute(const std::string& path, const std::string& name, const std::string& text);
  void attribute(const std::string& path, const std::string& name, double value);
  void attribute(const std::string& path, const std::string& name, std::int64_t value);
  void group(const std::string& path);
  void hard_link(const std::string& existing, const std::string& alias);
  /// Creates an array of doubles to be filled by write_rows; what is never written reads as NaN.
  void create_rows(const std::string& path, const Dims& dims, const std::string& unit,
                   const std::string& description, Packing packing = Packing::deflated);
  void create_rows_int(const std::string& path, const Dims& dims, const std::string& description);
  template <class T>  // double, std::int64_t
  void write_rows(const std::string& path, std::size_t first, std::size_t rows, const T* values);

  // Reading.
  bool exists(const std::string& path) const;
  bool is_group(const std::string& path) const;
  bool is_text(const std::string& path) const;
  bool is_integer(const std::string& path) const;
  std::vector<std::string> list(const std::string& group) const;  // sorted by name
  Dims dims(const std::string& path) const;
  template <class T>
  Array<T> read(const std::string& path) const;
  template <class T>
  Array<T> read_rows(const std::string& path, std::size_t first, std::size_t rows) const;
  std::vector<std::string> read_texts(const std::string& path) const;
  std::string text_attribute(const std::string& path, const std::string& name) const;  // empty if absent

 private:
  Hdf5File(std::filesystem::path path, std::int64_t id, bool writing);
  std::filesystem::path path_;
  std::int64_t id_ = -1;
  bool writing_ = false;
};

}  // namespace talus::io
