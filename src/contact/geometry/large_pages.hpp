/// Large pages for arrays that are read at random places. Internal to src/contact.
#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace talus::contact {

/// Reserves room for n elements and, for arrays of many megabytes, asks the system for large pages: a query
/// of a million triangles otherwise waits for page tables as long as for the data. Without effect where the
/// system refuses.
template <class T>
void reserve_on_large_pages(std::vector<T>& array, std::size_t n) {
  constexpr std::uintptr_t page = std::uintptr_t{2} << 20;
  array.reserve(n);
#ifdef MADV_HUGEPAGE
  const auto address = reinterpret_cast<std::uintptr_t>(array.data());
  const std::uintptr_t first = (address + page - 1) / page * page,
                       last = (address + array.capacity() * sizeof(T)) / page * page;
  if (last > first) (void)madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#endif
}

}  // namespace talus::contact
