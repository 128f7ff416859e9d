/// Fields for ParaView: `.vtu` files (raw appended, little-endian) and the `.pvd` that gives each its true
/// time.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/field_columns.hpp"
#include "sim/frame.hpp"

namespace talus::io {

/// Blocks as polyhedra at their poses. Cell data: block (index), displacement, velocity, speed,
/// kinetic_energy; `row` may be null. Blocks beyond poses.size() are not there yet.
void write_blocks_vtu(const std::filesystem::path& path, std::span<const sim::RunHeader::BlockInfo> blocks,
                      std::span<const Pose> poses, std::span<const Vec3> start, const sim::HistoryRow* row);

/// Live hexahedra with nodal displacement and velocity, cell damage and stress; reinforcement as line cells
/// of their own file.
void write_structure_vtu(const std::filesystem::path& path, const std::filesystem::path& journal,
                         const StructureField& field);
void write_bars_vtu(const std::filesystem::path& path, const std::filesystem::path& journal,
                    const StructureField& field);

/// Triangles, for the terrain.
void write_surface_vtu(const std::filesystem::path& path, const TriangleSurface& surface);

struct PvdEntry {
  double time;
  int part;
  std::string name;  // of the part
  std::string file;  // relative to the .pvd
};
std::string pvd_text(std::span<const PvdEntry> entries);

}  // namespace talus::io
