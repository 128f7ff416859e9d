/// Block systems in HDF5: the part of results.h5 that says which blocks there are and where.
///
///   results.h5#/geometry/blocks         all blocks at t = 0
///   results.h5#/geometry/blocks@12.5    at the history row nearest to 12.5 s; @end: at the last one
#pragma once
#include <filesystem>
#include <string>

#include "geometry/mesh.hpp"

namespace talus::io {

/// The blocks as one mesh, a group for each. `when`: empty, "end" or a time [s]. Blocks that are not there
/// yet are left out. Throws InputError.
geometry::Mesh read_blocks(const std::filesystem::path& results, const std::string& when);

/// Every group of a mesh file as a block, in the layout of results.h5 with one history row. Throws
/// InputError, WriteError.
void write_blocks(const std::filesystem::path& path, const std::string& mesh_file);

}  // namespace talus::io
