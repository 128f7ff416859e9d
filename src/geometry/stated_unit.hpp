/// Units of length: by their names, and as files of meshes name them.
#pragma once
#include <string>

namespace talus::geometry {

/// Length of a unit [m] by its name ("ft", "US survey foot", "millimetres"); 0: none that is known.
double metres_of(const std::string& unit);

/// Whether a text names a unit of length other than the metre, as a word of its own ("elevations in US
/// feet"), and not as the unit of a number ("accuracy 0.3 ft"), nor "in", which is a word of English before.
bool names_other_unit(const std::string& text);

struct StatedUnit {
  std::string name;   ///< as the file writes it; empty: it names none, or metres
  double metres = 1;  ///< its length [m]
};

/// The unit that the head of a mesh file names: "# units: mm" before the first vertex of an OBJ or OFF file,
/// a comment of a PLY file, "UNITS=mm" in the header or first line of an STL file, "** units: mm" before the
/// first *NODE of an Abaqus file, the title of a VTK file, dataset 164 of a universal file. The other formats
/// have no unit, and such remarks are what exporters leave of it.
StatedUnit stated_unit(const std::string& path);

}  // namespace talus::geometry
