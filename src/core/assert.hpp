/// TALUS_ASSERT(condition, values...): a bug if it fails; prints the values. Compiled out unless the audit or
/// debug build is on.
#pragma once
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

#ifdef TALUS_AUDIT
#define TALUS_ASSERT(condition, ...)                                                           \
  do {                                                                                         \
    if (!(condition)) {                                                                        \
      std::fprintf(stderr, "%s:%d: assertion failed: %s %s\n", __FILE__, __LINE__, #condition, \
                   fmt::format("" __VA_ARGS__).c_str());                                       \
      std::abort();                                                                            \
    }                                                                                          \
  } while (false)
#else
#define TALUS_ASSERT(condition, ...) ((void)0)
#endif
