/// Results for a geographic information system, in map coordinates (the scene's plus site.origin) and the
/// terrain's coordinate reference system.
///
///   results.h5#/history/blocks out.geojson  the path of every block that moved, a LineString of centroids
///                                           [x, y, z]
///   results.h5#/maps/QUANTITY@CELL out.tif  a grid of square cells of CELL metres, on multiples of CELL
///
/// Both follow the centroids over the history rows; between two rows a block goes straight and its speed
/// changes linearly.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace talus::geometry {
struct Raster;
}

namespace talus::io {

/// GeoJSON text: one feature a block, with `name`, `mass` [kg], `volume` [m3], `fragment`, `max_speed` [m/s],
/// `max_kinetic` [J], `birth` and `end` [s]. Points nearer to the last one than a thousandth of the extent of
/// all paths are left out. Fixed blocks and those that never moved are not in it.
std::string tracks_geojson(const std::filesystem::path& results);

/// One of
///   passages  blocks whose centroid crossed the cell [1]
///   kinetic   greatest kinetic energy of a block in the cell [J]
///   speed     greatest speed of a centroid in the cell [m/s]
///   height    greatest height of a centroid over the terrain in the cell [m]
///   deposit   volume of blocks whose centroid lies in the cell at the end [m3]
/// NaN where no block came. `cell` <= 0: the greatest of 1, 2, 5 times a power of ten that divides the longer
/// side of the paths in plan (or a tenth of their extent in space) into 100 or more. Throws InputError for an
/// unknown quantity, no moving block, heights without a terrain, and grids of more than 1e8 cells.
geometry::Raster results_map(const std::filesystem::path& results, const std::string& quantity, double cell);

class Hdf5File;
/// Heights over the terrain of points x, y, z in a row, scene coordinates; NaN beside it and where a point is
/// NaN. Empty without a terrain [m].
std::vector<double> heights_over_ground(const Hdf5File& file, std::span<const double> points);

}  // namespace talus::io
