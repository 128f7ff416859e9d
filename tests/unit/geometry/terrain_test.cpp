#include "geometry/terrain.hpp"

#include "geometry/raster_outliers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "geometry/layers.hpp"
#include "geometry/mesh.hpp"
#include "geometry/raster.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

struct TemporaryFile {
  explicit TemporaryFile(const std::string& name, const std::string& text = "") {
    path = (std::filesystem::temp_directory_path() /
            ("talus_terrain_" + std::to_string(::getpid()) + "_" + name))
               .string();
    if (!text.empty()) std::ofstream(path, std::ios::binary) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path); }
  std::string path;
};

const std::string rows = "1 2 3\n4 5 6\n7 8 9\n";  // north first

/// As ESRI's programs write it: without codes.
const std::string wkt_of_lv95 =
    "PROJCS[\"CH1903+_LV95\",GEOGCS[\"GCS_CH1903+\",DATUM[\"D_CH1903+\",SPHEROID[\"Bessel_1841\",6377397.155,"
    "299.1528128]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Hotine_"
    "Oblique_"
    "Mercator_Azimuth_Center\"],PARAMETER[\"False_Easting\",2600000.0],PARAMETER[\"False_Northing\",1200000."
    "0],"
    "PARAMETER[\"Scale_Factor\",1.0],PARAMETER[\"Azimuth\",90.0],PARAMETER[\"Longitude_Of_Center\","
    "7.43958333333333],PARAMETER[\"Latitude_Of_Center\",46.9524055555556],UNIT[\"Meter\",1.0]]";

}  // namespace

TEST(Terrain, CornerAndCentreRegistration) {
  const TemporaryFile corner(
      "corner.asc",
      "ncols 3\nnrows 3\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n" + rows);
  const TemporaryFile centre(
      "centre.asc",
      "ncols 3\nnrows 3\nxllcenter 100\nyllcenter 200\ncellsize 10\nNODATA_value -9999\n" + rows);
  const Terrain a = load_terrain(corner.path), b = load_terrain(centre.path);
  ASSERT_EQ(a.surface.vertices.size(), 9u);
  EXPECT_EQ(a.surface.vertices[0], Vec3(105, 205, 7));  // cell centres, south-west first
  EXPECT_EQ(b.surface.vertices[0], Vec3(100, 200, 7));
  EXPECT_EQ(b.surface.vertices[8], Vec3(120, 220, 3));
  // Each quad is split from lower left to upper right.
  EXPECT_EQ(a.surface.triangles[0], (std::array<int, 3>{0, 1, 4}));
  EXPECT_EQ(a.surface.triangles[1], (std::array<int, 3>{0, 4, 3}));
}

TEST(Terrain, HolesDropTrianglesAndAreRemembered) {
  const TemporaryFile file("hole.asc",
                           "ncols 3\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n1 2 "
                           "-9999\n4 5 6\n7 8 9\n");
  const Terrain t = load_terrain(file.path);
  EXPECT_EQ(t.surface.vertices.size(), 8u);
  EXPECT_EQ(t.surface.triangles.size(), 6u);  // both triangles of the quad touch its upper right node
  EXPECT_TRUE(t.over_hole(1.7, 1.6));
  EXPECT_TRUE(t.over_hole(1.6, 1.7));
  EXPECT_FALSE(t.over_hole(0.5, 0.5));
  EXPECT_FALSE(t.over_hole(5, 5));  // beside the terrain, not over a hole
  ASSERT_EQ(t.warnings.size(), 1u);
  EXPECT_EQ(t.warnings[0].severity, Problem::Severity::warning);
}

TEST(Terrain, OriginAndCrop) {
  const TemporaryFile file("crop.asc",
                           "ncols 3\nnrows 3\nxllcenter 1000\nyllcenter 2000\ncellsize 1\n" + rows);
  TerrainOptions o;
  o.origin = {1000, 2000, 5};
  o.crop = Box3(Vec3(0.2, 0.2, 0), Vec3(0.8, 0.8, 0));
  const Terrain t = load_terrain(file.path, o);
  ASSERT_EQ(t.surface.vertices.size(), 4u);
  EXPECT_EQ(t.surface.vertices[0], Vec3(0, 0, 2));
  o.crop = Box3(Vec3(50, 50, 0), Vec3(60, 60, 0));
  EXPECT_THROW(load_terrain(file.path, o), InputError);
}

TEST(Terrain, GeoTiffSaysTheSameAsTheGrid) {
  const TemporaryFile grid("same.asc",
                           "ncols 3\nnrows 3\nxllcenter 100.25\nyllcenter 200\ncellsize 10\nNODATA_value "
                           "-9999\n1.125 2 -9999\n4 5 6\n7 8 9\n");
  const TemporaryFile tiff("same.tif");
  Raster r = read_raster(grid.path);
  r.crs = "EPSG:31254";
  write_raster(tiff.path, r);
  const Terrain a = load_terrain(grid.path), b = load_terrain(tiff.path);
  EXPECT_EQ(a.surface.vertices, b.surface.vertices);
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
  EXPECT_EQ(b.crs, "EPSG:31254");
  TerrainOptions o;
  o.crs = "EPSG:31254";
  EXPECT_NO_THROW(load_terrain(tiff.path, o));
  o.crs = "EPSG:2056";
  EXPECT_THROW(load_terrain(tiff.path, o), InputError);
}

TEST(Terrain, MeshIsTurnedUpUnlessTwoSided) {
  const TemporaryFile file("down.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 3 2\n");
  EXPECT_EQ(load_terrain(file.path).surface.triangles[0], (std::array<int, 3>{0, 2, 1}));
  TerrainOptions o;
  o.two_sided = true;
  EXPECT_EQ(load_terrain(file.path, o).surface.triangles[0], (std::array<int, 3>{0, 1, 2}));
}

TEST(Terrain, MaterialsByPolygon) {
  const TemporaryFile file("material.asc",
                           "ncols 3\nnrows 3\nxllcenter 1000\nyllcenter 2000\ncellsize 1\n" + rows);
  const TemporaryFile area(
      "area.geojson",
      R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry":
      {"type": "Polygon", "coordinates": [[[999, 1999], [1001, 1999], [1001, 2003], [999, 2003], [999, 1999]]]}}]})");
  TerrainOptions o;
  o.origin = {1000, 2000, 0};
  o.default_material = 3;
  o.material_areas.push_back({area.path, "", 0, 7});
  const Terrain t = load_terrain(file.path, o);
  ASSERT_EQ(t.surface.material.size(), 8u);
  int sevens = 0;
  for (std::size_t k = 0; k < t.surface.triangles.size(); ++k) {
    const auto& c = t.surface.triangles[k];
    const double x =
        (t.surface.vertices[c[0]].x() + t.surface.vertices[c[1]].x() + t.surface.vertices[c[2]].x()) / 3;
    EXPECT_EQ(t.surface.material[k], x < 1 ? 7 : 3);
    sevens += t.surface.material[k] == 7;
  }
  EXPECT_EQ(sevens, 4);
}

TEST(Terrain, PolygonsOfAnAreaMayOverlapAndHaveHoles) {
  const auto polygon = [](double a, double b, const std::string& holes) {
    const auto ring = [](double from, double to) {
      const std::string p = std::to_string(from), q = std::to_string(to);
      return "[[" + p + "," + p + "],[" + q + "," + p + "],[" + q + "," + q + "],[" + p + "," + q + "],[" +
             p + "," + p + "]]";
    };
    return R"({"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [)" +
           ring(a, b) + (holes.empty() ? "" : "," + ring(5, 6)) + "]}}";
  };
  const TemporaryFile file("two.geojson", R"({"type": "FeatureCollection", "features": [)" +
                                              polygon(0, 7, "hole") + "," + polygon(3, 10, "hole") + "," +
                                              polygon(8, 9, "") + "]}");
  const Area area = read_area(file.path, "site.area.polygon");
  for (const double at : {1.0, 4.0, 6.5, 8.5, 9.5}) EXPECT_TRUE(area.contains(at, at)) << at;
  for (const double at : {-1.0, 5.5, 10.5}) EXPECT_FALSE(area.contains(at, at)) << at;
  const AreaExtent extent =
      extent_of(area, Vec3(1, 2, 0), [](double x, double y) { return x > 4 && y > -9; });
  EXPECT_EQ(extent.limits.min(), Eigen::Vector2d(-1, -2));
  EXPECT_NEAR(extent.area, 49 + 49 - 16 - 1, 0.5);
  EXPECT_NEAR(extent.over_ground, 40.0 / 81, 0.01);
  EXPECT_EQ(beside_ground(extent, "release.polygon").size(), 1u);
}

/// GeoJSON of one polygon of these rings.
std::string polygon_of(const std::string& rings) {
  return R"({"type": "Polygon", "coordinates": [)" + rings + "]}";
}

TEST(Terrain, HolesTakeAwayWhereverTheyOverlap) {
  const TemporaryFile file("holes.geojson",
                           polygon_of("[[0,0],[9,0],[9,9],[0,9],[0,0]], [[2,2],[5,2],[5,5],[2,5],[2,2]], "
                                      "[[4,4],[12,4],[12,6],[4,6],[4,4]]"));
  const Area area = read_area(file.path, "site.area.polygon");
  EXPECT_TRUE(area.contains(1, 1));
  EXPECT_FALSE(area.contains(3, 3));
  EXPECT_FALSE(area.contains(4.5, 4.5));  // in both holes
  EXPECT_FALSE(area.contains(11, 5));     // in the hole, beside the polygon
}

TEST(Terrain, RingsThatDoNotSayWhatIsInsideAreToldWithTheirPlace) {
  const auto told = [](const std::string& rings) {
    const TemporaryFile file("rings.geojson", polygon_of(rings));
    const auto text = [](const Problem& p) {
      return (p.severity == Problem::Severity::warning ? "warning " : "") + p.key + " " + p.value + ": " +
             p.rule;
    };
    try {
      const Area area = read_area(file.path, "site.area.polygon");
      return area.warnings.empty() ? std::string() : text(area.warnings[0]);
    } catch (const InputError& e) { return text(e.problems()[0]); }
  };
  const std::string square = "[[0,0],[4,0],[4,4],[0,4],[0,0]]";
  EXPECT_EQ(told(square + ", [[6,1],[7,1],[7,2],[6,1]]"),
            "site.area.polygon polygon 1 at 6, 1: begins a hole that lies outside of its polygon");
  EXPECT_EQ(told("[[0,0],[4,4],[4,0],[0,4],[0,0]]"),
            "warning site.area.polygon polygon 1 at 2, 2: its sides cross there; what they go around an odd "
            "number of times is taken as inside");
  EXPECT_EQ(told(square + ", [[2,0],[4,2],[2,4],[0,2],[2,0]]"), "");         // touches with all its corners
  EXPECT_EQ(told("[[0,0],[2,2],[4,0],[4,4],[2,2],[0,4],[0,0]]"), "");        // two triangles that touch
  EXPECT_EQ(told("[[0,0],[4,0],[4,4],[2,4],[2,3],[2,4],[0,4],[0,0]]"), "");  // there and back
  EXPECT_EQ(told("[[0,0],[4,0],[4,4],[2,-0.0004],[0,4],[0,0]]"), "");        // by what files round to
}

/// Bytes of a shapefile's numbers.
template <class T>
std::string bytes_of(T value, bool big_endian = false) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::ranges::reverse(bytes);
  return bytes;
}

TEST(Terrain, AreasOfShapefiles) {
  // A square of 10 m at (2600000, 1200000), its ring clockwise, and a hole of 2 m, counter-clockwise.
  const double x = 2600000, y = 1200000;
  const std::vector<std::array<double, 2>> points{{0, 0}, {0, 10}, {10, 10}, {10, 0}, {0, 0},
                                                  {4, 4}, {6, 4},  {6, 6},   {4, 6},  {4, 4}};
  std::string box = bytes_of(x) + bytes_of(y) + bytes_of(x + 10) + bytes_of(y + 10),
              record = bytes_of(5) + box;
  record += bytes_of(2) + bytes_of(10) + bytes_of(0) + bytes_of(5);
  for (const auto& p : points) record += bytes_of(x + p[0]) + bytes_of(y + p[1]);
  const auto head = [&](std::size_t size) {
    return bytes_of(9994, true) + std::string(20, '\0') + bytes_of(static_cast<int>(size / 2), true) +
           bytes_of(1000) + bytes_of(5) + box + std::string(32, '\0');
  };
  const std::string length = bytes_of(static_cast<int>(record.size() / 2), true);
  const TemporaryFile shapes("s.shp", head(108 + record.size()) + bytes_of(1, true) + length + record),
      index("s.shx", head(108) + bytes_of(50, true) + length), system("s.prj", wkt_of_lv95);
  const Area area = read_area(shapes.path, "site.area.polygon");
  EXPECT_EQ(same_crs(area.crs, "EPSG:2056"), 1);
  EXPECT_TRUE(area.contains(x + 1, y + 1));
  EXPECT_FALSE(area.contains(x + 5, y + 5));
  EXPECT_FALSE(area.contains(x + 11, y + 5));
}

TEST(Terrain, LinesOfGeoPackages) {
  const TemporaryFile file("lines.gpkg", "");
  Layer road;
  road.name = "road";
  road.lines = true;
  road.features.emplace_back().parts = {{{1, 2, 3}, {4, 5, 6}}};
  write_geopackage(file.path, "EPSG:31254", std::array{road});
  const PlanLines lines = read_plan_lines(file.path, "line.road.file");
  EXPECT_EQ(lines.crs, "EPSG:31254");
  ASSERT_EQ(lines.lines.size(), 1u);
  EXPECT_EQ(lines.lines[0][1], Eigen::Vector2d(4, 5));
  Layer other = road;
  other.name = "axis";
  write_geopackage(file.path, "EPSG:31254", std::array{road, other});
  try {
    read_plan_lines(file.path, "line.road.file");
    FAIL();
  } catch (const InputError& e) { EXPECT_EQ(e.problems()[0].rule, "holds several layers: road, axis"); }
}

TEST(Terrain, GeometriesOfAnotherTypeAreSaidToBeLeftOut) {
  const std::string polygon = R"({"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9]]]})",
                    line = R"({"type": "LineString", "coordinates": [[0, 0], [9, 9]]})",
                    point = R"({"type": "Point", "coordinates": [0, 0]})";
  const TemporaryFile file("mixed.geojson", R"({"type": "GeometryCollection", "geometries": [)" + point +
                                                "," + polygon + "," + line + "," + point + "]}");
  const Area area = read_area(file.path, "site.area.polygon");
  ASSERT_EQ(area.warnings.size(), 1u);
  EXPECT_EQ(area.warnings[0].value, "1 LineString, 2 Point");
  const PlanLines lines = read_plan_lines(file.path, "line.road.file");
  ASSERT_EQ(lines.warnings.size(), 1u);
  EXPECT_EQ(lines.warnings[0].value, "2 Point, 1 Polygon");
  const TemporaryFile alone("alone.geojson", polygon);
  EXPECT_TRUE(read_area(alone.path, "site.area.polygon").warnings.empty());
}

TEST(Terrain, NestingOfGeometriesTakesNoStack) {
  std::string text = R"({"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9]]]})", before,
              behind;
  for (int k = 0; k < 200000; ++k) before += R"({"type":"GeometryCollection","geometries":[)", behind += "]}";
  const TemporaryFile file("deep.geojson", before + text + behind);
  EXPECT_TRUE(read_area(file.path, "site.area.polygon").contains(1, 1));
}

TEST(Terrain, MaterialsByRasterOfClasses) {
  const TemporaryFile file("classes.asc",
                           "ncols 3\nnrows 3\nxllcenter 1000\nyllcenter 2000\ncellsize 1\n" + rows);
  // Cells of one metre, two wide: class 5 on the western half of the terrain, 6 on the eastern.
  const TemporaryFile cover("cover.asc",
                            "ncols 2\nnrows 2\nxllcorner 1000\nyllcorner 2000\ncellsize 1\n5 6\n5 6\n");
  TerrainOptions o;
  o.origin = {1000, 2000, 0};
  o.default_material = 3;
  o.material_areas.push_back({"", cover.path, 6, 7});
  const Terrain t = load_terrain(file.path, o);
  for (std::size_t k = 0; k < t.surface.triangles.size(); ++k) {
    const auto& c = t.surface.triangles[k];
    const double x =
        (t.surface.vertices[c[0]].x() + t.surface.vertices[c[1]].x() + t.surface.vertices[c[2]].x()) / 3;
    EXPECT_EQ(t.surface.material[k], x > 1 ? 7 : 3);
  }
  o.material_areas[0].value = 9;
  EXPECT_EQ(load_terrain(file.path, o).warnings.size(), 1u);  // no such class
  const TemporaryFile far("far.asc",
                          "ncols 2\nnrows 2\nxllcorner 11.2\nyllcorner 47.1\ncellsize 0.001\n5 6\n5 6\n");
  o.material_areas[0].raster_file = far.path;
  EXPECT_THROW(load_terrain(file.path, o), InputError);  // degrees beside metres
}

TEST(Terrain, CoordinateSystemsThatDifferAreRefused) {
  const TemporaryFile file("crs.asc",
                           "ncols 3\nnrows 3\nxllcenter 1000\nyllcenter 2000\ncellsize 1\n" + rows);
  const auto polygon = [](const std::string& crs) {
    return R"({"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": ")" + crs +
           R"("}}, "features": [{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [[[999, 1999], [1001, 1999], [1001, 2003], [999, 1999]]]}}]})";
  };
  const TemporaryFile same("same.geojson", polygon("urn:ogc:def:crs:EPSG::31254")),
      other("other.geojson", polygon("urn:ogc:def:crs:EPSG::2056"));
  TerrainOptions o;
  o.crs = "EPSG:31254";
  o.material_areas = {{same.path, "", 0, 1}};
  EXPECT_NO_THROW(load_terrain(file.path, o));
  o.material_areas = {{other.path, "", 0, 1}};
  try {
    load_terrain(file.path, o);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems()[0].key, "site.area.polygon");
    EXPECT_NE(e.problems()[0].rule.find("another coordinate system"), std::string::npos);
  }
}

TEST(Terrain, MapsWhoseLengthsAreNotThoseOfTheGroundAreRefused) {
  const auto told = [](const std::string& crs, double x, double y) {
    try {
      check_lengths(crs, {x, y}, "scene.toml", "site.terrain");
    } catch (const InputError& e) { return e.problems()[0].rule; }
    return std::string();
  };
  EXPECT_EQ(told("EPSG:2056", 2600000, 1180000), "");
  EXPECT_EQ(told("EPSG:32632", 381000, 5181000), "");
  EXPECT_EQ(told("EPSG:3035", 4400000, 2700000), "");
  EXPECT_EQ(told("", 0, 0), "");
  // Web Mercator of WGS 84 at 46.774 degrees: 1 / cos times a / N along x, a / M along y, by
  // N = a / sqrt(1 - e^2 sin^2), M = a (1 - e^2) / (1 - e^2 sin^2)^1.5.
  EXPECT_NE(told("EPSG:3857", 828393, 5905316).find("are 1.458 (along x) and 1.462 (along y) times"),
            std::string::npos)
      << told("EPSG:3857", 828393, 5905316);
  EXPECT_EQ(told("EPSG:3857", 828393, 0), "");  // it is right at the equator
}

TEST(Terrain, CoordinateSystemsInAllFormsOfGeoJson) {
  const auto file_with = [](const std::string& top, const std::string& feature = "") {
    return R"({"type": "FeatureCollection", )" + top + R"("features": [{"type": "Feature", )" + feature +
           R"("properties": {}, "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}}]})";
  };
  const auto crs_of = [](const std::string& text) {
    const TemporaryFile file("forms.geojson", text);
    return read_area(file.path, "site.area.polygon").crs;
  };
  EXPECT_EQ(crs_of(file_with("")), "");
  EXPECT_EQ(crs_of(file_with("\"crs\": null, ")), "");
  EXPECT_EQ(crs_of(file_with("\"crs\": \"EPSG:31255\", ")), "EPSG:31255");
  const std::string by_name = R"("crs": {"type": "name", "properties": {"name": "EPSG:31255"}}, )";
  EXPECT_EQ(crs_of(file_with(by_name)), "EPSG:31255");
  EXPECT_EQ(crs_of(file_with(R"("crs": {"type": "EPSG", "properties": {"code": 31255}}, )")), "EPSG:31255");
  EXPECT_EQ(crs_of(file_with("", by_name)), "EPSG:31255");
  EXPECT_EQ(crs_of(file_with(by_name, by_name)), "EPSG:31255");
  EXPECT_EQ(crs_of(file_with("\"coordRefSys\": \"[EPSG:31255]\", ")), "EPSG:31255");
  const std::string address = "http://www.opengis.net/def/crs/EPSG/0/31255";
  EXPECT_EQ(crs_of(file_with("\"coordRefSys\": \"" + address + "\", ")), address);
  EXPECT_EQ(same_crs(address, "EPSG:31255"), 1);
  for (const std::string& text :
       {file_with(
            R"("crs": {"type": "link", "properties": {"href": "http://a.org/31255/", "type": "proj4"}}, )"),
        file_with("\"crs\": 31255, "), file_with("\"coordRefSys\": [\"EPSG:31255\", \"EPSG:5778\"], "),
        file_with(by_name, R"("crs": {"type": "name", "properties": {"name": "EPSG:31254"}}, )")})
    EXPECT_THROW(crs_of(text), InputError) << text;
}

// As GDAL and ArcGIS write them beside grids of text: ESRI's names, no codes.
TEST(Terrain, CoordinateSystemsInTheWordsOfEsri) {
  const std::string mgi =
      R"(PROJCS["MGI_Austria_GK_West",GEOGCS["GCS_MGI",DATUM["D_MGI",SPHEROID["Bessel_1841",6377397.155,299.1528128]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",-5000000.0],PARAMETER["Central_Meridian",10.3333333333333],PARAMETER["Scale_Factor",1.0],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]])";
  const TemporaryFile grid("esri.asc",
                           "ncols 3\nnrows 3\nxllcenter 1000\nyllcenter 2000\ncellsize 1\n" + rows),
      beside("esri.prj", mgi);
  const std::string crs = load_terrain(grid.path).crs;
  EXPECT_EQ(crs, "EPSG:31254");
  EXPECT_EQ(same_crs(mgi, "EPSG:31254"), 1);
  EXPECT_EQ(same_crs("urn:ogc:def:crs:EPSG::31254", mgi), 1);
  EXPECT_EQ(same_crs(mgi, "EPSG:31255"), 0);
  EXPECT_EQ(same_crs(mgi, "EPSG:25832"), 0);
  EXPECT_EQ(same_crs(mgi, "EPSG:99999"), -1);
}

TEST(Terrain, CoordinateSystemsOfASceneAreInMetres) {
  const auto rule = [](const std::string& crs) -> std::string {
    try {
      check_crs(crs, "scene.toml", "site.crs");
    } catch (const InputError& e) { return e.problems()[0].rule; }
    return {};
  };
  for (const char* good : {"", "EPSG:31254", "EPSG:2056", "EPSG:31254+5778", "urn:ogc:def:crs:EPSG::25832"})
    EXPECT_EQ(rule(good), "") << good;
  for (const char* unknown : {"EPSG:99999", "31254", "Gauss-Krueger", "/etc/hostname"})
    EXPECT_EQ(rule(unknown), "is no coordinate system that is known") << unknown;
  EXPECT_NE(rule("EPSG:4326").find("degrees"), std::string::npos);
  EXPECT_NE(rule("EPSG:2263").find("0.30480061 m"), std::string::npos) << rule("EPSG:2263");
  for (const char* other : {"EPSG:4978", "EPSG:5778"})
    EXPECT_EQ(rule(other), "is no system of coordinates in plan") << other;
}

TEST(Terrain, HeadersThatSayTwoThingsAreRefused) {
  for (const char* twice :
       {"cellsize 1\ncellsize 2\n", "cellsize 1\nncols 4\n", "cellsize 1\ndx 2\ndy 2\n"}) {
    const TemporaryFile file(
        "twice.asc", "ncols 3\nnrows 3\nxllcorner 1000\nyllcorner 2000\n" + std::string(twice) + rows);
    EXPECT_THROW(load_terrain(file.path), InputError) << twice;
  }
}

TEST(Terrain, FarFromTheOriginIsWarnedOf) {
  const TemporaryFile file("map.asc",
                           "ncols 3\nnrows 3\nxllcenter 650000\nyllcenter 5200000\ncellsize 1\n" + rows);
  const Terrain t = load_terrain(file.path);
  ASSERT_EQ(t.warnings.size(), 1u);
  EXPECT_EQ(t.warnings[0].key, "site.origin");
  TerrainOptions o;
  o.origin = {650000, 5200000, 0};
  EXPECT_TRUE(load_terrain(file.path, o).warnings.empty());
}

namespace {

std::string line_file(const std::string& coordinates) {
  return R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": {"type": "MultiLineString", "coordinates": )" +
         coordinates + "}}]}";
}

bool has_edge(const TriangleSurface& s, const Vec3& a, const Vec3& b) {
  for (const auto& t : s.triangles)
    for (int k = 0; k < 3; ++k)
      if (s.vertices[t[k]] == a && s.vertices[t[(k + 1) % 3]] == b) return true;
  return false;
}

}  // namespace

TEST(Terrain, BreaklinesAloneMakeTheSurface) {
  // A crest and a toe across, and a ridge that joins them off the middle.
  const TemporaryFile file("lines.geojson", line_file("[[[0, 0, 10], [4, 0, 12], [10, 0, 10]], [[0, 20, 0], "
                                                      "[6, 20, 0], [10, 20, 0]], [[4, 0, 12], [6, 20, 0]]]"));
  TerrainOptions o;
  o.breaklines = file.path;
  const Terrain t = load_terrain("", o);
  EXPECT_EQ(t.surface.vertices.size(), 6u);
  EXPECT_EQ(t.surface.triangles.size(), 4u);
  EXPECT_TRUE(has_edge(t.surface, {4, 0, 12}, {6, 20, 0}) && has_edge(t.surface, {6, 20, 0}, {4, 0, 12}));
}

TEST(Terrain, BreaklinesInAGridStayThroughDecimation) {
  std::string text = "ncols 21\nnrows 21\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n";
  for (int i = 0; i < 21; ++i) {
    for (int j = 0; j < 21; ++j) text += i < 3 && j < 3 ? "-9999 " : "5 ";
    text += "\n";
  }
  const TemporaryFile grid("flat.asc", text),
      line("ridge.geojson", line_file("[[[2.3, 4.1, 8], [10.2, 9.7, 9], [17.6, 12.4, 8]]]"));
  TerrainOptions o;
  o.breaklines = line.path;
  o.decimation_error = 0.01;
  const Terrain t = load_terrain(grid.path, o);
  EXPECT_TRUE(has_edge(t.surface, {2.3, 4.1, 8}, {10.2, 9.7, 9}));
  EXPECT_TRUE(has_edge(t.surface, {10.2, 9.7, 9}, {17.6, 12.4, 8}));
  EXPECT_LT(t.surface.triangles.size(), 500u);  // of 800: the plain is thinned out, the ridge is not
  double area = 0;
  for (const auto& c : t.surface.triangles) {
    const Vec3 n = (t.surface.vertices[c[1]] - t.surface.vertices[c[0]])
                       .cross(t.surface.vertices[c[2]] - t.surface.vertices[c[0]]);
    EXPECT_GT(n.z(), 0);
    area += 0.5 * n.z();
  }
  EXPECT_NEAR(area, 400 - 8.5, 1e-9);  // the hole in the north-west corner, 3 x 3 nodes, is still one: 2.5
                                       // x 3.5 cells less the half that the split keeps
}

TEST(Terrain, BreaklinesThatCannotBeAreRefused) {
  TerrainOptions o;
  const auto rule = [&](const std::string& coordinates) -> std::string {
    const TemporaryFile file("bad.geojson", line_file(coordinates));
    o.breaklines = file.path;
    try {
      load_terrain("", o);
    } catch (const InputError& e) { return e.problems()[0].rule; }
    return "";
  };
  EXPECT_EQ(rule("[[[0, 0, 0], [10, 10, 0]], [[0, 10, 0], [10, 0, 3]]]"),
            "two lines cross between their points");
  EXPECT_NE(rule("[[[0, 0, 0], [10, 10, 0]], [[0, 0, 4], [10, 0, 3]]]").find("above each other"),
            std::string::npos);
  EXPECT_EQ(rule("[[[0, 0], [10, 10]]]"), "is not GeoJSON as needed here");
}

TEST(Terrain, BreaklinesFarFromTheTerrainAreWarnedOf) {
  std::string text = "ncols 6\nnrows 6\nxllcenter 0\nyllcenter 0\ncellsize 5\n";
  for (int k = 0; k < 36; ++k) text += std::to_string(500 + k / 6) + " ";
  const TemporaryFile grid("far.asc", text);
  for (const auto& [height, warned] : {std::pair{"0", true}, {"1640", true}, {"503", false}}) {
    const std::string z = height;
    const TemporaryFile line("far.geojson", line_file("[[[3, 4, " + z + "], [17, 16, " + z + "]]]"));
    TerrainOptions o;
    o.breaklines = line.path;
    const Terrain t = load_terrain(grid.path, o);
    EXPECT_EQ(std::any_of(t.warnings.begin(), t.warnings.end(),
                          [](const Problem& p) { return p.key == "site.breaklines"; }),
              warned)
        << height;
  }
}

TEST(Terrain, HighestPlaceWithinARectangle) {
  TriangleSurface s;
  s.vertices = {{0, 0, 0}, {10, 0, 0}, {10, 10, 10}, {0, 10, 10}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_NEAR(highest_within(s, {Eigen::Vector2d(2, 2), Eigen::Vector2d(4, 5)}), 5, 1e-12);
  EXPECT_FALSE(std::isfinite(highest_within(s, {Eigen::Vector2d(20, 2), Eigen::Vector2d(24, 5)})));
}

TEST(Terrain, BadInputIsRefusedWithItsPlace) {
  EXPECT_THROW(load_terrain("/nowhere.asc"), InputError);
  const TemporaryFile rubbish("rubbish.asc", "this is no grid\n");
  EXPECT_THROW(load_terrain(rubbish.path), InputError);
  const TemporaryFile empty("empty.asc",
                            "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value "
                            "-9999\n-9999 -9999\n-9999 -9999\n");
  EXPECT_THROW(load_terrain(empty.path), InputError);
}

TEST(Terrain, HeightsBeyondAllGroundAreRefusedWithTheirCell) {
  for (const char* z : {"1e30", "-1e200"}) {
    const TemporaryFile file(
        "high.asc",
        std::string("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\n1 2 3\n4 ") + z + " 6\n");
    try {
      load_terrain(file.path);
      FAIL() << "taken";
    } catch (const InputError& e) {
      EXPECT_NE(e.problems().at(0).value.find("row 2, column 2"), std::string::npos) << e.what();
      EXPECT_NE(e.problems().at(0).remedy.find("NODATA_value"), std::string::npos) << e.what();
    }
  }
}

TEST(Terrain, DecimalCommasAreRefusedWithTheirLine) {
  const TemporaryFile file("comma.asc",
                           "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1.5 2.5\n3.5 4,5\n");
  try {
    load_terrain(file.path);
    FAIL() << "taken";
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems().at(0).line, 7);
    EXPECT_EQ(e.problems().at(0).column, 5);
    EXPECT_EQ(e.problems().at(0).value, "4,5");
  }
}

TEST(Terrain, HeightsThatStandOutAreNamed) {
  // A rough slope of 45 degrees with a cliff of 30 m: neither is an outlier, a spike and a pit of two nodes
  // are.
  constexpr int n = 30;
  std::vector<double> z(n * n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      z[static_cast<std::size_t>(i * n + j)] =
          2.0 * i + 0.3 * ((7 * i + 5 * j) % 4) + (j > 20 && i > 12 ? 30 : 0);
  const HeightGrid grid{z, n, n, 600000, 200000, 2, 2};
  EXPECT_TRUE(height_outliers(grid).empty());
  z[5 * n + 7] = 9999;
  z[20 * n + 10] = z[20 * n + 11] = -200;
  const auto found = height_outliers(grid);
  EXPECT_EQ(found, (std::vector<std::size_t>{5 * n + 7, 20 * n + 10, 20 * n + 11}));
  const auto warning = outlier_warning(grid, "dem.asc");
  ASSERT_EQ(warning.size(), 1u);
  EXPECT_NE(warning[0].rule.find("z = 9999 m at x = 600014, y = 200010"), std::string::npos)
      << warning[0].rule;
}

TEST(Terrain, WidenedLimitsAreLevelWithTheEdge) {
  const TemporaryFile file("wide.asc", "ncols 3\nnrows 3\nxllcenter 0\nyllcenter 0\ncellsize 1\n" + rows);
  TerrainOptions o;
  o.widen = 10;
  const Terrain t = load_terrain(file.path, o);
  Box3 box;
  for (const Vec3& v : t.surface.vertices) box.extend(v);
  EXPECT_NEAR(box.min().x(), -10, 1e-9);
  EXPECT_NEAR(box.max().y(), 12, 1e-9);
  for (const auto& c : t.surface.triangles) {
    const Vec3 n = (t.surface.vertices[c[1]] - t.surface.vertices[c[0]])
                       .cross(t.surface.vertices[c[2]] - t.surface.vertices[c[0]]);
    EXPECT_GT(n.z(), 0);
  }
}

TEST(Terrain, SlopeFromFacesFollowsItsDips) {
  const double deg = 3.14159265358979323846 / 180;
  const auto s = slope_from_faces({0, 0, 100}, 90 * deg, {{60 * deg, 50}, {30 * deg, 80}, {0, 20}}, 40);
  ASSERT_EQ(s.vertices.size(), 8u);
  EXPECT_NEAR(s.vertices[2].x(), 25, 1e-12);  // dip direction 90: down towards +x
  EXPECT_NEAR(s.vertices[2].z(), 100 - 50 * std::sin(60 * deg), 1e-12);
  EXPECT_NEAR(s.vertices[7].z(), 100 - 50 * std::sin(60 * deg) - 40, 1e-12);
  for (const auto& c : s.triangles) {
    const Vec3 n = (s.vertices[c[1]] - s.vertices[c[0]]).cross(s.vertices[c[2]] - s.vertices[c[0]]);
    EXPECT_GT(n.z(), 0);
  }
}

TEST(Terrain, AMillionTrianglesLoad) {
  // 708 x 708 nodes: 999,698 triangles, as binary STL (the common case).
  const int n = 708;
  Mesh mesh;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      mesh.vertices.emplace_back(j, i, 20 * std::sin(0.01 * i) * std::cos(0.013 * j));
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      const int k = i * n + j;
      mesh.triangles.push_back({k, k + 1, k + n + 1});
      mesh.triangles.push_back({k, k + n + 1, k + n});
    }
  const TemporaryFile file("million.stl");
  write_mesh(file.path, mesh);
  const Terrain t = load_terrain(file.path);
  EXPECT_EQ(t.surface.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(t.surface.vertices.size(), mesh.vertices.size());
}

TEST(Terrain, DecimationKeepsItsVerticalBoundEverywhere) {
  const int n = 61;
  const auto grid = [&](auto&& z) {
    std::pair<std::vector<Vec3>, std::vector<std::array<int, 3>>> g;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) g.first.emplace_back(j, i, z(j, i));
    for (int i = 0; i + 1 < n; ++i)
      for (int j = 0; j + 1 < n; ++j) {
        const int k = i * n + j;
        g.second.push_back({k, k + 1, k + n + 1});
        g.second.push_back({k, k + n + 1, k + n});
      }
    return g;
  };
  const auto height = [](const std::vector<Vec3>& v, const std::vector<std::array<int, 3>>& tris, double x,
                         double y) {
    for (const auto& t : tris) {
      const Vec3 &a = v[t[0]], &b = v[t[1]], &c = v[t[2]];
      const auto area = [](double ax, double ay, double bx, double by) { return ax * by - ay * bx; };
      const double all = area(b.x() - a.x(), b.y() - a.y(), c.x() - a.x(), c.y() - a.y());
      const double wb = area(x - a.x(), y - a.y(), c.x() - a.x(), c.y() - a.y()) / all,
                   wc = area(b.x() - a.x(), b.y() - a.y(), x - a.x(), y - a.y()) / all;
      if (wb >= -1e-9 && wc >= -1e-9 && wb + wc <= 1 + 1e-9)
        return a.z() + wb * (b.z() - a.z()) + wc * (c.z() - a.z());
    }
    return std::nan("");
  };
  auto [v, t] = grid([](int x, int y) { return 0.25 * x - 0.5 * y; });
  double reached = -1;
  decimate(v, t, 0.01, reached);
  EXPECT_LT(reached, 1e-9);
  EXPECT_LT(t.size(), 2000u);  // of 7200; the border keeps its 240 vertices

  const auto original = grid([](int x, int y) { return 3 * std::sin(0.2 * x) * std::cos(0.15 * y); });
  auto [w, s] = original;
  decimate(w, s, 0.2, reached);
  EXPECT_LE(reached, 0.2);
  EXPECT_LT(s.size(), original.second.size() / 2);
  double worst = 0;
  for (int k = 0; k < 1500; ++k) {  // between the nodes as well
    const double x = std::fmod(k * 0.618034 * 60, 60), y = std::fmod(k * 0.754878 * 60, 60);
    worst = std::max(worst, std::abs(height(w, s, x, y) - height(original.first, original.second, x, y)));
  }
  EXPECT_LE(worst, reached + 1e-9);
  EXPECT_GT(worst, 0.01);
}
