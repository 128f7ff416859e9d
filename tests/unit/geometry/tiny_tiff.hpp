/// GeoTIFFs of a few cells, tag by tag, as other programs write them [TIFF 6.0, 1992; OGC GeoTIFF 1.1].
#pragma once
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace talus::geometry {

struct TinyTiff {
  int columns = 3, rows = 3, bands = 1;
  std::vector<double> values;       // rows x columns x bands, north first
  bool bytes = false;               // 8 bits a value, else double
  bool sign = false;                // of bytes
  int photometric = 1;              // 1 grey, 2 RGB, 3 palette
  bool alpha = false;               // the last band is one
  std::string nodata, metadata;     // tags 42113, 42112
  int crs = 0;                      // EPSG code of a projected system
  int vertical = 0;                 // EPSG code of a system of heights
  int linear_unit = 0;              // EPSG code of the unit in plan
  int vertical_unit = 0;            // EPSG code of the unit of heights, without a system of them
  double scale_z = 0;               // third number of the pixel's size
  bool sparse = false;              // the last row is a strip that was never written
  std::vector<unsigned char> mask;  // a second image, 0: no data
  bool second_page = false;         // the same once more, as an image of its own
  double west = 1000, north = 2030, cell = 10;

  void write(const std::string& path) const {
    std::string out("II\x2A\0\0\0\0\0", 8);
    std::uint32_t link = 4;  // where the place of the next directory is to stand
    const auto put = [&](std::uint32_t at, std::uint32_t x) { std::memcpy(out.data() + at, &x, 4); };
    const auto directory = [&](const std::map<int, std::pair<int, std::string>>& tags) {
      std::map<int, std::uint32_t> place;
      for (const auto& [tag, entry] : tags)
        if (entry.second.size() > 4) {
          if (out.size() % 2) out += '\0';
          place[tag] = static_cast<std::uint32_t>(out.size());
          out += entry.second;
        }
      if (out.size() % 2) out += '\0';
      put(link, static_cast<std::uint32_t>(out.size()));
      const auto short_text = [](std::size_t x) {
        return std::string({static_cast<char>(x & 255), static_cast<char>(x >> 8)});
      };
      out += short_text(tags.size());
      for (const auto& [tag, entry] : tags) {
        static const int size[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
        out += short_text(static_cast<std::size_t>(tag)) + short_text(static_cast<std::size_t>(entry.first));
        std::string field(8, '\0');
        const auto count =
            static_cast<std::uint32_t>(entry.second.size() / static_cast<std::size_t>(size[entry.first]));
        std::memcpy(field.data(), &count, 4);
        if (place.count(tag))
          std::memcpy(field.data() + 4, &place[tag], 4);
        else
          std::memcpy(field.data() + 4, entry.second.data(), entry.second.size());
        out += field;
      }
      link = static_cast<std::uint32_t>(out.size());
      out += std::string(4, '\0');
    };
    const auto shorts = [](const std::vector<int>& list) {
      std::string s;
      for (const int x : list)
        s += std::string({static_cast<char>(x & 255), static_cast<char>((x >> 8) & 255)});
      return std::pair(3, s);
    };
    const auto longs = [](std::uint32_t x) {
      std::string s(4, '\0');
      std::memcpy(s.data(), &x, 4);
      return std::pair(4, s);
    };
    const auto doubles = [](const std::vector<double>& list) {
      std::string s(8 * list.size(), '\0');
      std::memcpy(s.data(), list.data(), s.size());
      return std::pair(12, s);
    };
    const auto text = [](const std::string& t) { return std::pair(2, t + '\0'); };

    std::string pixels;
    for (const double v : values) {
      if (bytes)
        pixels += static_cast<char>(static_cast<int>(v));
      else
        pixels += std::string(reinterpret_cast<const char*>(&v), 8);
    }
    const auto begin = static_cast<std::uint32_t>(out.size());
    out += pixels;
    std::map<int, std::pair<int, std::string>> tags{
        {256, longs(static_cast<std::uint32_t>(columns))},
        {257, longs(static_cast<std::uint32_t>(rows))},
        {258, shorts(std::vector<int>(static_cast<std::size_t>(bands), bytes ? 8 : 64))},
        {259, shorts({1})},
        {262, shorts({photometric})},
        {273, longs(begin)},
        {277, shorts({bands})},
        {278, longs(static_cast<std::uint32_t>(rows))},
        {279, longs(static_cast<std::uint32_t>(pixels.size()))},
        {284, shorts({1})},
        {339, shorts(std::vector<int>(static_cast<std::size_t>(bands), bytes ? sign ? 2 : 1 : 3))},
        {33550, doubles({cell, cell, scale_z})},
        {33922, doubles({0, 0, 0, west, north, 0})}};
    if (alpha) tags[338] = shorts({2});
    if (photometric == 3) tags[320] = shorts(std::vector<int>(768, 77));
    if (!nodata.empty()) tags[42113] = text(nodata);
    if (!metadata.empty()) tags[42112] = text(metadata);
    if (sparse) {  // a strip a row
      std::string begins, counts;
      for (int i = 0; i < rows; ++i) {
        const auto row = static_cast<std::uint32_t>(pixels.size()) / static_cast<std::uint32_t>(rows);
        const bool there = i + 1 < rows;
        begins += longs(there ? begin + row * static_cast<std::uint32_t>(i) : 0).second;
        counts += longs(there ? row : 0).second;
      }
      tags[273] = {4, begins}, tags[279] = {4, counts}, tags[278] = longs(1);
    }
    std::vector<int> keys{1, 1, 0, crs ? 3 : 2, 1024, 0, 1, crs ? 1 : 32767, 1025,
                          0, 1, 1};  // four numbers each
    if (crs) keys.insert(keys.end(), {3072, 0, 1, crs});
    if (linear_unit) keys[3] += 1, keys.insert(keys.end(), {3076, 0, 1, linear_unit});
    if (vertical) keys[3] += 1, keys.insert(keys.end(), {4096, 0, 1, vertical});
    if (vertical_unit) keys[3] += 1, keys.insert(keys.end(), {4099, 0, 1, vertical_unit});
    tags[34735] = shorts(keys);
    directory(tags);
    if (second_page) directory(tags);
    if (!mask.empty()) {
      const auto at = static_cast<std::uint32_t>(out.size());
      out += std::string(mask.begin(), mask.end());
      directory({{254, longs(4)},
                 {256, longs(static_cast<std::uint32_t>(columns))},
                 {257, longs(static_cast<std::uint32_t>(rows))},
                 {258, shorts({8})},
                 {259, shorts({1})},
                 {262, shorts({4})},
                 {273, longs(at)},
                 {277, shorts({1})},
                 {278, longs(static_cast<std::uint32_t>(rows))},
                 {279, longs(static_cast<std::uint32_t>(mask.size()))},
                 {284, shorts({1})}});
    }
    std::ofstream(path, std::ios::binary) << out;
  }
};

}  // namespace talus::geometry
