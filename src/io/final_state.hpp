/// The end of a run inside its results.h5, for key simulation.initial_state of a later scene.
///
///   /state/blocks/NAME                 [25] c, v, w, q (x, y, z, w), strain, strain rate
///   /state/structures/NAME/nodes       [n, 3] reference positions, m
///   /state/structures/NAME/history     [m] everything the structure remembers
///   /state/bodies, /state/forms        [b] whatever may be touched, by name and hash of its form
///   /state/contact_keys                [n, 4] body, partner (both by their place in bodies), feature, bond
///   /state/contacts                    [n, 19] coupling::ContactMemory
#pragma once
#include <filesystem>
#include <string>

#include "io/hdf5_file.hpp"
#include "sim/final_state.hpp"

namespace talus::io {

/// Adds the state to a results file that is being written. Throws WriteError.
void write_final_state(Hdf5File& file, const sim::FinalState& state);

/// Throws InputError: no such file, no results of a run that has ended, damaged.
sim::FinalState read_final_state(const std::filesystem::path& results);

}  // namespace talus::io
