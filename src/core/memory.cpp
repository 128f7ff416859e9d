#include "core/memory.hpp"

#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
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

/// Its text is not as in the file.
bool relocates_text(const dl_phdr_info* object) {
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    if (object->dlpi_phdr[i].p_type != PT_DYNAMIC) continue;
    for (const auto* d = reinterpret_cast<const ElfW(Dyn)*>(object->dlpi_addr + object->dlpi_phdr[i].p_vaddr);
         d->d_tag != DT_NULL; ++d)
      if (d->d_tag == DT_TEXTREL || (d->d_tag == DT_FLAGS && (d->d_un.d_val & DF_TEXTREL) != 0)) return true;
  }
  return false;
}

/// To bind the names of deal.II the loader reads 130 MB of the libraries' tables, once, and set-up calls much
/// that is not called again. These pages are the page cache's, but count as resident in every process as long
/// as they are mapped: batch systems add them up, one time for each rank. What is needed again comes back
/// from the page cache.
int leave_to_page_cache(dl_phdr_info* object, std::size_t, void*) {
  if (object->dlpi_name == nullptr || *object->dlpi_name == '\0' || relocates_text(object)) return 0;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const auto& part = object->dlpi_phdr[i];
    if (part.p_type != PT_LOAD || (part.p_flags & PF_W) != 0) continue;
    const std::uintptr_t begin = (object->dlpi_addr + part.p_vaddr) / page * page,
                         end = object->dlpi_addr + part.p_vaddr + part.p_memsz;
    (void)madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
  }
  return 0;
}

}  // namespace

void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  dl_iterate_phdr(leave_to_page_cache, nullptr);
}

double available_memory() { return std::min({of_system(), of_group(), of_process()}); }

}  // namespace talus
