/// Where bars meet what holds the structure. Real bars go on into the foundation; here they end, and their
/// force passes to the held nodes. A bar that ended one cover before a held section would leave the section
/// at the base with less steel than was asked for.
#pragma once
#include <string>
#include <vector>

#include "fem/rebar/rebar_embed.hpp"
#include "fem/setup.hpp"

namespace talus::fem {

/// Marks the ends of the member whose sections are held in all directions (`held_start`, `held_end`).
void mark_held_ends(rebar::Member& member, const HexMesh& mesh, const Supports& supports);

/// Marks the ends of open bars that lie on held faces of the mesh as anchored. Returns one warning on the
/// bars of a file that end inside a cell, short of its held face, or nothing.
std::string anchor_bars(std::vector<rebar::Bar>& bars, const rebar::HostSearch& host, const HexMesh& mesh,
                        const Supports& supports);

}  // namespace talus::fem
