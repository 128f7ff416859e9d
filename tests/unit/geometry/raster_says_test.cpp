// What a raster says of itself is heeded, refused or warned of.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "geometry/raster.hpp"
#include "geometry/terrain.hpp"
#include "tiny_tiff.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

struct File {
  explicit File(const std::string& name)
      : path((std::filesystem::temp_directory_path() /
              ("talus_says_" + std::to_string(::getpid()) + "_" + name))
                 .string()) {}
  File(const std::string& name, const std::string& text) : File(name) {
    std::ofstream(path, std::ios::binary) << text;
  }
  ~File() { std::filesystem::remove(path); }
  std::string path;
};

TinyTiff tiff(std::vector<double> values) {
  TinyTiff t;
  t.values = std::move(values);
  return t;
}

const std::vector<double> heights{501, 502, 503, 504, 505, 506, 507, 508, 509};

Terrain terrain_of(const TinyTiff& t) {
  const File file("t.tif");
  t.write(file.path);
  TerrainOptions o;
  o.origin = Vec3(1000, 2000, 0);
  return load_terrain(file.path, o);
}

/// The rule of the error, or empty.
std::string refusal(const TinyTiff& t) {
  try {
    terrain_of(t);
  } catch (const InputError& e) { return e.problems()[0].rule; }
  return {};
}

bool warned(const Terrain& t, const std::string& part) {
  return std::any_of(t.warnings.begin(), t.warnings.end(),
                     [&](const Problem& p) { return p.str().find(part) != std::string::npos; });
}

double north_west(const Terrain& t) {
  for (const Vec3& v : t.surface.vertices)
    if (std::abs(v.x() - 5) < 1e-9 && std::abs(v.y() - 25) < 1e-9) return v.z();
  return std::nan("");
}

std::string item(const std::string& name, const std::string& value) {
  return "<Item name=\"" + name + "\" sample=\"0\" role=\"" + name + "\">" + value + "</Item>";
}

}  // namespace

// Neither a carriage return nor a zero makes text of bytes.
TEST(RasterSays, BytesOfATiffAreReadAsTheyAre) {
  std::vector<double> z = heights;
  const std::uint64_t bits = 0x407F500D00000000;  // 501.003..., with the byte of a carriage return
  std::memcpy(z.data(), &bits, sizeof bits);
  const File file("cr.tif");
  tiff(z).write(file.path);
  std::ifstream in(file.path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  ASSERT_EQ(bytes.find('\n'), std::string::npos);
  ASSERT_LT(bytes.find('\r'), 24u);
  EXPECT_EQ(read_raster(file.path).values, z);
}

TEST(RasterSays, ScaleAndOffsetAreApplied) {
  TinyTiff t = tiff({10, 20, 30, 40, 50, 60, 70, 80, 90});
  t.metadata = "<GDALMetadata>" + item("scale", "0.1") + item("offset", "500") + "</GDALMetadata>";
  EXPECT_NEAR(north_west(terrain_of(t)), 501, 1e-9);
  t.bytes = true;
  const Terrain of_bytes = terrain_of(t);
  EXPECT_NEAR(north_west(of_bytes), 501, 1e-9);
  EXPECT_FALSE(warned(of_bytes, "8 bits"));
}

TEST(RasterSays, BytesMayHaveASign) {
  TinyTiff t = tiff({-20, -10, 0, 10, 20, 30, 40, -1, -128});
  t.bytes = true, t.sign = true, t.nodata = "-128";
  const Terrain ground = terrain_of(t);
  EXPECT_EQ(north_west(ground), -20);
  EXPECT_EQ(ground.surface.vertices.size(), 8u);
}

TEST(RasterSays, NodataIsAStoredValueNotAScaledOne) {
  TinyTiff t = tiff({10, 20, 30, 40, 50, 60, 70, 80, 0});
  t.nodata = "0";
  t.metadata = "<GDALMetadata>" + item("offset", "500") + "</GDALMetadata>";
  EXPECT_EQ(terrain_of(t).surface.vertices.size(), 8u);
}

TEST(RasterSays, HeightsInFeetAreConverted) {
  for (const auto& [unit, metres] : {std::pair<std::string, double>{"ft", 0.3048},
                                     {"US survey foot", 1200.0 / 3937},
                                     {"foot", 0.3048},
                                     {"cm", 0.01}}) {
    TinyTiff t = tiff(heights);
    t.metadata = "<GDALMetadata>" + item("unittype", unit) + "</GDALMetadata>";
    const Terrain terrain = terrain_of(t);
    EXPECT_NEAR(north_west(terrain), 501 * metres, 1e-9) << unit;
    EXPECT_TRUE(warned(terrain, "converted to metres")) << unit;
  }
  TinyTiff metres = tiff(heights);
  metres.metadata = "<GDALMetadata>" + item("unittype", "metre") + "</GDALMetadata>";
  EXPECT_TRUE(terrain_of(metres).warnings.empty());
  metres.metadata = "<GDALMetadata>" + item("unittype", "mSv") + "</GDALMetadata>";
  EXPECT_TRUE(warned(terrain_of(metres), "no length that is known"));
}

TEST(RasterSays, AUnitThatOnlyAFreeTextNamesIsWarnedOf) {
  const auto said = [](const std::string& name, const std::string& text) {
    TinyTiff t = tiff(heights);
    t.metadata = "<GDALMetadata><Item name=\"" + name + "\">" + text + "</Item></GDALMetadata>";
    return warned(terrain_of(t), "names a unit other than metres");
  };
  for (const char* text :
       {"Bare earth, heights in US feet", "z: ft", "Vertical datum NAVD88 (ftUS), metres in plan"})
    EXPECT_TRUE(said("remarks", text)) << text;
  for (const char* text :
       {"Bare earth, heights in metres", "1-foot contours", "accuracy 0.3 ft, points in class 2", "foothills",
        "tiles of 2 km, rounded to 10 cm"})
    EXPECT_FALSE(said("remarks", text)) << text;
}

TEST(RasterSays, APlanInFeetIsRefused) {
  TinyTiff t = tiff(heights);
  t.crs = 2263;  // New York Long Island, US survey feet
  EXPECT_NE(refusal(t).find("unit of its coordinates in plan"), std::string::npos) << refusal(t);
  t.crs = 25832;
  EXPECT_EQ(refusal(t), "");
}

TEST(RasterSays, HeightsInFeetByTheCoordinateSystemAreConverted) {
  TinyTiff t = tiff(heights);
  t.crs = 25832;
  t.vertical = 6360;  // NAVD88 in US survey feet
  const Terrain terrain = terrain_of(t);
  EXPECT_TRUE(warned(terrain, "converted to metres"))
      << (terrain.warnings.empty() ? "silent" : terrain.warnings[0].str());
  EXPECT_NEAR(north_west(terrain), 501 * 1200.0 / 3937, 1e-9);
}

TEST(RasterSays, MasksAndAlphaAreHoles) {
  TinyTiff masked = tiff(heights);
  masked.mask = {255, 255, 255, 255, 255, 255, 255, 255, 0};
  EXPECT_EQ(terrain_of(masked).surface.vertices.size(), 8u);
  TinyTiff alpha =
      tiff({501, 255, 502, 255, 503, 255, 504, 255, 505, 255, 506, 255, 507, 255, 508, 255, 0, 0});
  alpha.bands = 2;
  alpha.alpha = true;
  const Terrain t = terrain_of(alpha);
  EXPECT_EQ(t.surface.vertices.size(), 8u);
  EXPECT_FALSE(warned(t, "bands"));
  EXPECT_TRUE(warned(t, "masked"));
}

TEST(RasterSays, PicturesAreNoHeights) {
  TinyTiff rgb = tiff(std::vector<double>(27, 100));
  rgb.bands = 3, rgb.bytes = true, rgb.photometric = 2;
  EXPECT_NE(refusal(rgb).find("is a picture"), std::string::npos);
  TinyTiff palette = tiff(std::vector<double>(9, 4));
  palette.bytes = true, palette.photometric = 3;
  EXPECT_NE(refusal(palette).find("table of colours"), std::string::npos);
  TinyTiff shade = tiff({1, 2, 3, 4, 5, 6, 7, 8, 9});
  shade.bytes = true;
  EXPECT_TRUE(warned(terrain_of(shade), "8 bits"));
  TinyTiff two = tiff(std::vector<double>(18, 100));
  two.bands = 2;
  EXPECT_TRUE(warned(terrain_of(two), "2 bands"));
}

/// Classes of ground come with a palette as a rule.
TEST(RasterSays, APaletteMayHoldClasses) {
  const File file("classes.tif");
  TinyTiff t = tiff(std::vector<double>(9, 4));
  t.bytes = true, t.photometric = 3;
  t.write(file.path);
  EXPECT_EQ(read_raster(file.path).values[0], 4);
}

TEST(RasterSays, DialectsOfTextGridsAreOne) {
  const std::string head =
                        "ncols 3\nnrows 3\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n",
                    rows = "1 2 3\n4 5 6\n7 8 9\n";
  const auto vertices = [](const std::string& text) {
    const File file("g.asc", text);
    return load_terrain(file.path).surface.vertices;
  };
  const auto expected = vertices(head + rows);
  EXPECT_EQ(vertices("\xEF\xBB\xBF" + head + rows), expected);
  EXPECT_EQ(vertices("ncols 3\r\nnrows 3\r\nxllcorner 100\r\nyllcenter 205\r\ncellsize 10\r\n" + rows),
            expected);
  EXPECT_EQ(
      vertices("NROWS 3\nNCOLS 3\nXLLCENTER 105\nYLLCORNER 200\nCELLSIZE 10\nNODATA_VALUE -9999\n" + rows),
      expected);
  for (const bool little : {true, false}) {
    std::string wide = little ? "\xFF\xFE" : "\xFE\xFF";
    for (const char c : head + rows) wide += little ? std::string({c, '\0'}) : std::string({'\0', c});
    EXPECT_EQ(vertices(wide), expected) << little;
    EXPECT_EQ(vertices(wide.substr(2)), expected) << little;  // without a mark
  }
  // A corner without data, as numerical libraries write it.
  EXPECT_EQ(vertices(head + "nan 2 3\n4 5 6\n7 8 9\n"), vertices(head + "-9999 2 3\n4 5 6\n7 8 9\n"));
  std::string mac = head + rows;
  std::replace(mac.begin(), mac.end(), '\n', '\r');
  EXPECT_EQ(vertices(mac), expected);
}

TEST(RasterSays, AnIncompleteHeaderIsNamed) {
  const auto value = [](const std::string& text) -> std::string {
    const File file("g.asc", text);
    try {
      load_terrain(file.path);
    } catch (const InputError& e) { return e.problems()[0].value; }
    return "none";
  };
  EXPECT_EQ(value("ncols 2\nnrows 2\nxllcorner 0\ncellsize 1\n1 2\n3 4\n"), "yllcorner or yllcenter");
  EXPECT_EQ(value("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\n1 2\n3 4\n"), "cellsize");
  const std::string place = "xllcorner 0\nyllcorner 0\ncellsize 1\n";
  EXPECT_EQ(value("ncols 2\nnrows 3\n" + place + "1 2 3\n4 5 6\n"), "ncols 2, nrows 3");
  EXPECT_EQ(value("ncols 2\nnrows 2\nxllcorner 0\nxllcenter 0.5\nyllcorner 0\ncellsize 1\n1 2\n3 4\n"),
            "xllcorner and xllcenter");
  EXPECT_EQ(value("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1 m\n1 2\n3 4\n"), "m");
  EXPECT_EQ(value("ncols: 2\nnrows: 2\n" + place + "1 2\n3 4\n"), "ncols:");
}

TEST(RasterSays, PointsInRowsKeepTheirDecimals) {
  const auto rule = [](const std::string& text) -> std::string {
    const File file("p.csv", text);
    try {
      const auto vertices = load_terrain(file.path).surface.vertices;
      return std::to_string(vertices.size()) + " up to " + std::to_string(vertices.back().z());
    } catch (const InputError& e) { return e.problems()[0].rule; }
  };
  const std::string cut = "a row of 4 numbers between commas, and 3 are expected";
  EXPECT_NE(rule("0,1,500,5\n1,1,501,5\n0,0,502,5\n1,0,503,5\n").find(cut), std::string::npos);
  EXPECT_NE(rule("x,y,z\n0,1,500,5\n1,1,501,5\n0,0,502,5\n1,0,503,5\n").find(cut), std::string::npos);
  EXPECT_EQ(rule("x,y,z,class\n0,1,500,5\n1,1,501,5\n0,0,502,5\n1,0,503,5\n"), "4 up to 501.000000");
  EXPECT_EQ(rule("x;y;z\n0;1;500,5\n1;1;501,5\n0;0;502,5\n1;0;503,5\n"), "4 up to 501.500000");
}

TEST(RasterSays, PointsInRowsAreThoseOfAGrid) {
  const auto rule = [](double stagger, double step, bool shuffled) -> std::string {
    std::string text;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const int k = shuffled ? (5 * j + 3 * i) % 8 : j;
        text += std::to_string(step * k + stagger * (i % 2)) + " " + std::to_string(step * i) + " " +
                std::to_string(i + k) + "\n";
      }
    const File file("p.xyz", text);
    try {
      return std::to_string(load_terrain(file.path).surface.vertices.size());
    } catch (const InputError& e) { return e.problems()[0].rule + "; " + e.problems()[0].remedy; }
  };
  EXPECT_EQ(rule(0, 5, false), "64");
  EXPECT_EQ(rule(0, 4.997678230579, false), "64");
  EXPECT_NE(rule(0.7, 5, false).find("beside the nodes of a grid of 5.1 x 5 m"), std::string::npos)
      << rule(0.7, 5, false);
  EXPECT_NE(rule(2.5, 5, false).find("the points are those of no regular grid"), std::string::npos);
  EXPECT_NE(rule(0, 5, true).find("gdal_grid"), std::string::npos) << rule(0, 5, true);
  EXPECT_EQ(rule(0, 5, true).find("(XYZ) are read"), std::string::npos) << rule(0, 5, true);
}

TEST(RasterSays, AFormatThatIsNotReadIsNamed) {
  const auto rule = [](const std::string& text) -> std::string {
    const File file("g.grd", text);
    try {
      load_terrain(file.path);
    } catch (const InputError& e) { return e.problems()[0].rule; }
    return {};
  };
  EXPECT_NE(rule("DSAA\n2 2\n0 1\n0 1\n1 4\n1 2\n3 4\n").find("Golden Software ASCII Grid"),
            std::string::npos);
  EXPECT_NE(rule("north: 2\nsouth: 0\n").find("of no format that is known"), std::string::npos);
}

TEST(RasterSays, HeightsBeyondAnyTerrainAreWarnedOf) {
  EXPECT_TRUE(warned(terrain_of(tiff({9501, 9502, 9503, 9504, 9505, 9506, 9507, 9508, 9509})),
                     "in feet they would be"));
  std::string text = "ncols 20\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j)
      text += std::to_string(100 + 3.28 * 0.8 * i) + (j == 19 ? "\n" : " ");  // 39 deg, heights in feet
  const File file("steep.asc", text);
  EXPECT_TRUE(warned(load_terrain(file.path), "different units"));
  EXPECT_TRUE(warned(load_terrain(file.path), "in feet they would be 30.48 to 45.6761 m"));
  std::string mm = "ncols 20\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) mm += std::to_string(800000 + 700 * i) + (j == 19 ? "\n" : " ");
  const File millimetres("mm.asc", mm);
  EXPECT_TRUE(warned(load_terrain(millimetres.path), "no ground on Earth is that high in metres"));
  EXPECT_TRUE(warned(load_terrain(millimetres.path),
                     "in millimetres they would be 800 to 813.3 m, half of the cells steeper than 35 deg"));
}

TEST(RasterSays, PiecesThatNodataCutsOffAreNamed) {
  const File file(
      "islands.asc",
      "ncols 5\nnrows 2\nxllcenter 100\nyllcenter 0\ncellsize 1\nNODATA_value -9\n1 1 -9 1 1\n1 1 -9 1 1\n");
  EXPECT_TRUE(warned(load_terrain(file.path), "2 pieces"));
  EXPECT_TRUE(warned(load_terrain(file.path), "x = 103, y = 0"));
}

TEST(RasterSays, NothingIsSaidOfWhatTheCropLeavesOut) {
  std::string text = "ncols 12\nnrows 12\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n";
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      text += (i == 1 && j == 1   ? "-9999"
               : i == 2 && j == 9 ? "400"
                                  : "5") +
              std::string(j == 11 ? "\n" : " ");
  const File file("spike.asc", text);
  EXPECT_TRUE(warned(load_terrain(file.path), "stands out") && warned(load_terrain(file.path), "NODATA"));
  TerrainOptions o;
  o.crop = Box3(Vec3(2, 0, 0), Vec3(9, 5, 0));
  EXPECT_TRUE(load_terrain(file.path, o).warnings.empty());
}

namespace {

std::string text_grid(int n, const std::string& hole) {
  std::string text = "ncols " + std::to_string(n) + "\nnrows " + std::to_string(n) +
                     "\nxllcorner 0\nyllcorner 0\ncellsize 5\n";
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      text += (i > 3 && i < 7 && j > 3 && j < 7 ? hole : std::to_string(500 + i + 2 * j)) +
              std::string(j == n - 1 ? "\n" : " ");
  return text;
}

std::string rule_of(const std::string& text) {
  const File file("g.asc", text);
  try {
    load_terrain(file.path);
  } catch (const InputError& e) { return e.problems()[0].str(); }
  return {};
}

}  // namespace

TEST(RasterSays, NodesWithoutDataThatTheFileDoesNotNameAreRefused) {
  for (const char* hole : {"-9999", "-99999", "-32768", "9999", "65535"})
    EXPECT_NE(rule_of(text_grid(12, hole)).find("stands for nodes without data"), std::string::npos) << hole;
  const File zeros("z.asc", text_grid(12, "0"));
  EXPECT_TRUE(warned(load_terrain(zeros.path), "stands for nodes without data"));
  // Low ground is ground, whatever its number; named, a hole is a hole.
  const File sea("sea.asc", text_grid(12, "460"));
  EXPECT_FALSE(warned(load_terrain(sea.path), "without data"));
  const File named("n.asc", "NODATA_value -9999\n" + text_grid(12, "-9999"));
  EXPECT_EQ(load_terrain(named.path).surface.vertices.size(), 144u - 9u);
  // A scaled band stores another number than it means.
  TinyTiff t = tiff({10, 20, 30, 40, 50, 60, 70, -32768, 90});
  t.metadata = "<GDALMetadata>" + item("scale", "0.1") + item("offset", "500") + "</GDALMetadata>";
  EXPECT_NE(refusal(t).find("stands for nodes without data"), std::string::npos) << refusal(t);
}

TEST(RasterSays, AScaleThatLeavesNoHeightIsRefused) {
  for (const char* scale : {"0", "nan"}) {
    TinyTiff t = tiff(heights);
    t.metadata = "<GDALMetadata>" + item("scale", scale) + "</GDALMetadata>";
    EXPECT_NE(refusal(t).find("no height is left"), std::string::npos) << scale << ": " << refusal(t);
  }
}

TEST(RasterSays, DepthsBecomeHeights) {
  TinyTiff t = tiff(heights);
  t.crs = 25832;
  t.vertical = 5715;  // depth below mean sea level
  const Terrain terrain = terrain_of(t);
  EXPECT_TRUE(warned(terrain, "grow downwards"));
  EXPECT_NEAR(north_west(terrain), -501, 1e-9);
}

// A grid that is written says nothing of units: what it holds is in metres, as other readers take it.
TEST(RasterSays, GridsAreConvertedWithTheirUnits) {
  TinyTiff t = tiff(heights);
  t.crs = 25832;
  const File in("in.tif"), asc("out.asc"), tif("out.tif");
  const auto converted = [&](const std::string& out) {
    std::vector<Problem> warnings;
    t.write(in.path);
    convert_raster(in.path, out, warnings);
    EXPECT_EQ(warnings.empty(), t.vertical_unit == 0 && t.vertical == 0 && t.metadata.empty());
    return read_raster(out).values[0];
  };
  for (const std::string& out : {asc.path, tif.path}) {
    t.vertical_unit = t.vertical = 0, t.metadata.clear();
    EXPECT_NEAR(converted(out), 501, 1e-9);
    t.vertical_unit = 9002;
    EXPECT_NEAR(converted(out), 501 * 0.3048, 1e-9);
    t.vertical_unit = 0, t.vertical = 5715;
    EXPECT_NEAR(converted(out), -501, 1e-9);
    t.vertical = 0, t.metadata = "<GDALMetadata>" + item("unittype", "mSv") + "</GDALMetadata>";
    EXPECT_NEAR(converted(out), 501, 1e-9);
  }
  std::filesystem::remove(asc.path.substr(0, asc.path.size() - 3) + "prj");
}

TEST(RasterSays, AUnitInPlanCountsWithoutTheRestOfTheSystem) {
  TinyTiff t = tiff(heights);
  t.crs = 32767;  // a system of the user's own, which the file does not describe
  t.linear_unit = 9003;
  EXPECT_NE(refusal(t).find("unit of its coordinates in plan"), std::string::npos) << refusal(t);
  t.linear_unit = 9001;
  EXPECT_EQ(refusal(t), "");
}

TEST(RasterSays, AProjectionBesideATextGridIsReadInAnyEncoding) {
  const std::string feet =
      "PROJCS[\"own\",GEOGCS[\"GCS\",DATUM[\"D_North_American_1983\",SPHEROID[\"GRS_1980\",6378137.0,298.257]"
      "],"
      "PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
      "PARAMETER[\"Central_Meridian\",9],UNIT[\"Foot_US\",0.3048006096012192]]";
  const File grid("p.asc", text_grid(5, "500"));
  const std::string beside = grid.path.substr(0, grid.path.size() - 4) + ".prj";
  const auto put = [&](const std::string& text) { std::ofstream(beside, std::ios::binary) << text; };
  const auto said = [&]() -> std::string {
    try {
      for (const Problem& p : load_terrain(grid.path).warnings) return p.str();
    } catch (const InputError& e) { return e.problems()[0].str(); }
    return {};
  };
  EXPECT_EQ(said(), "");
  std::string wide = "\xFF\xFE";
  for (const char c : feet) wide += std::string({c, '\0'});
  for (const std::string& text : {feet, "\xEF\xBB\xBF" + feet, wide}) {
    put(text);
    EXPECT_NE(said().find("unit of its coordinates in plan"), std::string::npos) << said();
  }
  put("Projection UTM\nZone 12\nDatum NAD27\nZunits FEET\nUnits METERS\nSpheroid CLARKE1866\nParameters\n");
  EXPECT_NE(said().find("converted to metres, times 0.3048"), std::string::npos) << said();
  put("Projection UTM\nZone 12\nDatum NAD27\nZunits NO\nUnits METERS\nSpheroid CLARKE1866\nParameters\n");
  EXPECT_EQ(said(), "");
  std::filesystem::remove(beside);
}

TEST(RasterSays, PointsInRowsMayHaveAByteOrderMark) {
  std::string text;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      text += std::to_string(5 * j) + " " + std::to_string(15 - 5 * i) + " " + std::to_string(i + j) + "\n";
  const File plain("p.xyz", text), marked("m.xyz", "\xEF\xBB\xBF" + text);
  EXPECT_EQ(load_terrain(marked.path).surface.vertices, load_terrain(plain.path).surface.vertices);
}

TEST(RasterSays, AnEmptyFileIsCalledEmpty) { EXPECT_NE(rule_of("").find("is empty"), std::string::npos); }

TEST(RasterSays, ACloudOfPointsIsCalledOne) {
  EXPECT_NE(rule_of("LASF" + std::string(300, '\1')).find("is a cloud of points (LAS, LAZ), no grid"),
            std::string::npos);
}

TEST(RasterSays, StripsThatWereNeverWrittenAreHoles) {
  TinyTiff t = tiff(heights);
  t.sparse = true;
  const Terrain terrain = terrain_of(t);
  EXPECT_EQ(terrain.surface.vertices.size(), 6u);
  EXPECT_TRUE(warned(terrain, "3 of 9 nodes"));
}

TEST(RasterSays, FurtherImagesOfAFileAreNamed) {
  TinyTiff t = tiff(heights);
  EXPECT_FALSE(warned(terrain_of(t), "images"));
  t.second_page = true;
  EXPECT_TRUE(warned(terrain_of(t), "2 images"));
}

TEST(RasterSays, AThirdScaleOfThePixelIsNamed) {
  TinyTiff t = tiff(heights);
  t.scale_z = 1;
  EXPECT_TRUE(terrain_of(t).warnings.empty());
  t.scale_z = 0.1;
  EXPECT_TRUE(warned(terrain_of(t), "scale of heights of 0.1"));
}

TEST(RasterSays, AUnitOfHeightsCountsWithoutASystemOfThem) {
  TinyTiff t = tiff(heights);
  t.crs = 25832;
  t.vertical_unit = 9002;
  const Terrain terrain = terrain_of(t);
  EXPECT_NEAR(north_west(terrain), 501 * 0.3048, 1e-9);
  EXPECT_TRUE(warned(terrain, "converted to metres"));
  t.vertical_unit = 9001;
  EXPECT_TRUE(terrain_of(t).warnings.empty());
}

TEST(RasterSays, TheUnitOfTheThirdAxisCounts) {
  const File file("axes.tif");
  tiff(heights).write(file.path);
  const std::string length = "LENGTHUNIT[&quot;metre&quot;,1]",
                    angle = "ANGLEUNIT[&quot;degree&quot;,0.0174532925199433]";
  const auto put = [&](const std::string& axis) {
    std::ofstream(file.path + ".aux.xml")
        << "<PAMDataset><SRS>PROJCRS[&quot;own&quot;,BASEGEOGCRS[&quot;own&quot;,DATUM[&quot;own&quot;,"
           "ELLIPSOID[&quot;GRS 1980&quot;,6378137,298.257222101," +
               length + "]],PRIMEM[&quot;Greenwich&quot;,0," + angle +
               "]],CONVERSION[&quot;own&quot;,METHOD[&quot;Transverse "
               "Mercator&quot;,ID[&quot;EPSG&quot;,9807]],"
               "PARAMETER[&quot;Latitude of natural origin&quot;,0," +
               angle + "],PARAMETER[&quot;Longitude of natural origin&quot;,9," + angle +
               "],PARAMETER[&quot;Scale factor at natural origin&quot;,1,SCALEUNIT[&quot;unity&quot;,1]],"
               "PARAMETER[&quot;False easting&quot;,0," +
               length + "],PARAMETER[&quot;False northing&quot;,0," + length +
               "]],CS[Cartesian,3],AXIS[&quot;(E)&quot;,east,ORDER[1]," + length +
               "],AXIS[&quot;(N)&quot;,north,ORDER[2]," + length +
               "],AXIS[&quot;ellipsoidal height (h)&quot;,up,ORDER[3]," + axis + "]]</SRS></PAMDataset>";
  };
  TerrainOptions o;
  o.origin = Vec3(1000, 2000, 0);
  put("LENGTHUNIT[&quot;foot&quot;,0.3048]");
  const Terrain feet = load_terrain(file.path, o);
  EXPECT_NEAR(north_west(feet), 501 * 0.3048, 1e-9);
  EXPECT_TRUE(warned(feet, "converted to metres"));
  put(length);
  const Terrain metres = load_terrain(file.path, o);
  EXPECT_NEAR(north_west(metres), 501, 1e-9);
  EXPECT_TRUE(metres.warnings.empty());
  std::filesystem::remove(file.path + ".aux.xml");
}

TEST(RasterSays, WhatStandsBesideAFileCountsWhateverItsKind) {
  const std::string feet =
      "PROJCS[\"own\",GEOGCS[\"GCS\",DATUM[\"D_North_American_1983\",SPHEROID[\"GRS_1980\",6378137.0,298.257]"
      "],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
      "PARAMETER[\"Central_Meridian\",9],UNIT[\"Foot_US\",0.3048006096012192]]";
  std::string points;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      points += std::to_string(5 * j) + " " + std::to_string(15 - 5 * i) + " " + std::to_string(i + j) + "\n";
  const File image("side.tif"), rows("rows.xyz", points);
  tiff(heights).write(image.path);
  for (const File* file : {&image, &rows}) {
    const File beside(file == &image ? "side.prj" : "rows.prj", feet);
    try {
      load_terrain(file->path);
      ADD_FAILURE() << file->path;
    } catch (const InputError& e) {
      EXPECT_NE(e.problems()[0].rule.find("unit of its coordinates in plan"), std::string::npos) << e.what();
    }
  }
  TinyTiff own = tiff(heights);  // what the file itself says goes before
  own.crs = 25832;
  own.write(image.path);
  const File beside("side.prj", feet);
  EXPECT_TRUE(load_terrain(image.path).warnings.empty());
  // A text in another encoding is read from memory, and what stands beside it stands beside it still.
  const File grid("m.asc", "\xEF\xBB\xBF" + text_grid(5, "500")),
      unit("m.asc.aux.xml",
           "<PAMDataset><PAMRasterBand band=\"1\"><UnitType>ft</UnitType></PAMRasterBand></PAMDataset>");
  EXPECT_TRUE(warned(load_terrain(grid.path), "converted to metres, times 0.3048"));
}

TEST(RasterSays, ClassesAreNoHeights) {
  const File file("classes_of_ground.tif"), aux("classes_of_ground.tif.aux.xml");
  tiff({1, 2, 3, 1, 2, 3, 1, 2, 3}).write(file.path);
  const auto rule = [&](const std::string& band) -> std::string {
    std::ofstream(aux.path) << "<PAMDataset><PAMRasterBand band=\"1\">" + band +
                                   "</PAMRasterBand></PAMDataset>";
    try {
      load_terrain(file.path);
    } catch (const InputError& e) { return e.problems()[0].rule; }
    return "none";
  };
  EXPECT_EQ(rule(""), "none");
  EXPECT_NE(rule("<CategoryNames><Category>rock</Category><Category>forest</Category></CategoryNames>")
                .find("names of classes"),
            std::string::npos);
  const std::string columns =
      "<GDALRasterAttributeTable><FieldDefn index=\"0\"><Name>Value</Name><Type>0</Type><Usage>5</Usage>"
      "</FieldDefn><FieldDefn index=\"1\"><Name>Class</Name><Type>2</Type><Usage>2</Usage></FieldDefn>";
  EXPECT_NE(rule(columns + "<Row index=\"0\"><F>1</F><F>rock</F></Row></GDALRasterAttributeTable>")
                .find("names of classes"),
            std::string::npos);
  EXPECT_EQ(rule(columns + "<Row index=\"0\"><F>1</F><F></F></Row></GDALRasterAttributeTable>"), "none");
}

TEST(RasterSays, WhatABandIsCalledCounts) {
  const auto terrain = [](const std::string& items, int bands = 1) {
    TinyTiff t = tiff(heights);
    if (bands == 2) t.values.insert(t.values.end(), heights.begin(), heights.end());
    t.bands = bands;
    t.metadata = "<GDALMetadata>" + items + "</GDALMetadata>";
    return terrain_of(t);
  };
  const auto named = [](const std::string& name, int band = 0) {
    return "<Item name=\"DESCRIPTION\" sample=\"" + std::to_string(band) + "\" role=\"description\">" + name +
           "</Item>";
  };
  for (const char* name : {"slope", "Aspect (deg)", "Hillshade"})
    EXPECT_TRUE(warned(terrain(named(name)), "is what its band is called")) << name;
  EXPECT_TRUE(terrain(named("elevation")).warnings.empty());
  EXPECT_TRUE(warned(terrain(named("aspect") + named("elevation", 1), 2), "2 bands (aspect, elevation)"));
  for (const std::string& said :
       {named("elevation [ft]"), std::string("<Item name=\"units\" sample=\"0\">feet</Item>"),
        std::string("<Item name=\"VERTICAL_UNITS\">feet</Item>")}) {
    const Terrain t = terrain(said);
    EXPECT_NEAR(north_west(t), 501 * 0.3048, 1e-9) << said;
    EXPECT_TRUE(warned(t, "converted to metres")) << said;
  }
  EXPECT_TRUE(warned(terrain("<Item name=\"UNITS\">US survey feet</Item>"), "US survey feet"));
  EXPECT_TRUE(terrain("<Item name=\"UNITS\">metre</Item>").warnings.empty());
}
