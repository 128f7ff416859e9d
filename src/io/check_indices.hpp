/// results.h5 may come from anywhere: what is used as an index is checked first.
#pragma once
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "io/files.hpp"

namespace talus::io {

/// Throws InputError unless all of `values` lie in [0, limit).
template <class T>
void check_indices(const std::vector<T>& values, std::size_t limit, const char* what) {
  for (const T v : values)
    if (v < 0 || static_cast<std::size_t>(v) >= limit)
      throw bad_file("results.h5", what, fmt::format("index {} of {}", v, limit),
                     "use results that Talus wrote");
}

}  // namespace talus::io
