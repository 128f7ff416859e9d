#include "core/memory.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace talus {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The kernel's estimate of what can be taken without swapping.
double of_system() {
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  for (double kibibytes = 0; file >> name >> kibibytes;) {
    if (name == "MemAvailable:") return 1024 * kibibytes;
    std::getline(file, unit);
  }
  return unlimited;
}

double number_in(const char* path) {
  std::ifstream file(path);
  double value = 0;
  return file >> value ? value : unlimited;  // "max" is no number
}

/// Of a container: version 2 of control groups, and version 1.
double of_group() {
  const double two =
      number_in("/sys/fs/cgroup/memory.max") - std::min(1e300, number_in("/sys/fs/cgroup/memory.current"));
  const double one = number_in("/sys/fs/cgroup/memory/memory.limit_in_bytes") -
                     std::min(1e300, number_in("/sys/fs/cgroup/memory/memory.usage_in_bytes"));
  return std::max(0.0, std::min(two > 0 ? two : 0, one));
}

/// Address space that `ulimit -v` leaves.
double of_process() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return unlimited;
  std::ifstream statm("/proc/self/statm");
  double pages = 0;
  if (!(statm >> pages)) return unlimited;
  return std::max(0.0,
                  static_cast<double>(limit.rlim_cur) - pages * static_cast<double>(sysconf(_SC_PAGESIZE)));
}

}  // namespace

void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

double available_memory() { return std::min({of_system(), of_group(), of_process()}); }

}  // namespace talus
