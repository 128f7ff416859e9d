/// What a process may still take of memory: the least of what the system, its control group and its own limit
/// leave.
#pragma once

namespace talus {

/// [bytes]; infinite where the system does not say.
double available_memory();

/// Gives back to the system what the heap holds free, after something large that will not be made again.
void give_back_memory();

}  // namespace talus
