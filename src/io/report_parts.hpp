/// What report.cpp gathers: decimation, rasters, filters. Internal to io; declared here for the tests.
#pragma once
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/types.hpp"
#include "io/ground_raster.hpp"
#include "io/hdf5_file.hpp"

namespace talus::io {

/// Arrays one after the other, each at a multiple of 8 bytes, with an index of offset, type and shape.
class Blob {
 public:
  template <class T>
  void add(const std::string& name, const std::vector<T>& values, const Dims& dims) {
    while (bytes_.size() % 8 != 0) bytes_.push_back('\0');
    index_[name] = {{"offset", bytes_.size()}, {"type", type<T>()}, {"dims", dims}};
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  const std::string& bytes() const { return bytes_; }
  const nlohmann::json& index() const { return index_; }

 private:
  template <class T>
  static const char* type() {
    if constexpr (std::is_same_v<T, float>)
      return "f32";
    else if constexpr (std::is_same_v<T, double>)
      return "f64";
    else if constexpr (std::is_same_v<T, std::int16_t>)
      return "i16";
    else if constexpr (std::is_same_v<T, std::uint16_t>)
      return "u16";
    else if constexpr (std::is_same_v<T, std::uint8_t>)
      return "u8";
    else
      return "u32";
  }
  std::string bytes_;
  nlohmann::json index_ = nlohmann::json::object();
};

/// Rows of a dataset in ascending order, read many at a time: a row alone would inflate its whole chunk.
/// Refuses rows of another width.
class RowReader {
 public:
  RowReader(const Hdf5File& file, std::string path, std::size_t width)
      : file_(file), path_(std::move(path)), width_(width) {}
  /// Row k; valid until the next call.
  std::span<const double> row(std::size_t k);

 private:
  const Hdf5File& file_;
  std::string path_;
  std::size_t width_, first_ = 0;
  Array<double> held_;
};

/// Time intervals that deserve more frames, s.
using Windows = std::vector<std::pair<double, double>>;

/// At most `budget` indices of `time`, ascending, first and last included; a third of them inside the
/// windows.
std::vector<std::size_t> pick_frames(std::span<const double> time, std::size_t budget,
                                     const Windows& windows);

/// Indices that keep the minimum and maximum of every series in each of about budget / 2 / series intervals.
std::vector<std::size_t> pick_extremes(std::size_t n, const std::vector<std::span<const double>>& series,
                                       std::size_t budget);

/// Triangles with vertices merged on a grid: fine within `region`, coarse outside, coarser until at most
/// `budget` remain. No cracks arise, since a vertex goes to the same place in every triangle.
Mesh decimate(const Mesh& mesh, const Box3& region, std::size_t budget);

/// Outer quadrilaterals of hexahedra: faces that belong to one cell only, and that cell.
struct Skin {
  std::vector<std::array<int, 4>> quads;
  std::vector<int> cell;
};
Skin skin(std::span<const std::int32_t> hexes);

std::string base64(std::string_view bytes);

}  // namespace talus::io
