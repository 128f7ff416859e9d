/// Maps of an ensemble, in map coordinates.
///
///   maps/reach.tif                     share of the finished members whose path goes through the cell
///   maps/energy_p50.tif, _p95.tif      percentiles, over the members that go through the cell, of each one's
///                                      largest kinetic energy there [J]
///   maps/height_p95.tif                the same of the height of the centroid above the ground [m]
///   maps/intensity.tif                 1 below 30 kJ, 2 from 30 kJ, 3 from 300 kJ, of the largest; with
///                                      releases_per_year f the class with f P(class) >= 1 / 300
///   maps/intensity_30.tif, _100, _300  the same of return periods of 30, 100 and 300 years, with f
///   ensemble.gpkg                      layers lines and end_points
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "ensemble/ensemble.hpp"

namespace talus::ensemble {

/// Of the first `members` members in the directory's journals. Returns what could not be made, a sentence
/// each.
std::vector<std::string> write_maps(const Ensemble& ensemble, const std::filesystem::path& directory,
                                    long members);

}  // namespace talus::ensemble
