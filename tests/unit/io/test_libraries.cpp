// What a process maps before it does anything: HDF5 from its archive, without the libraries for reading from
// the web that the shared one brings.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "io/hdf5_file.hpp"

namespace {
std::string first_mapped(const std::string& what) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (line.find(what) != std::string::npos) return line;
  return "";
}
}  // namespace

TEST(Libraries, NoneForTheWeb) {
#ifndef TALUS_HDF5_FROM_ARCHIVE
  GTEST_SKIP() << "HDF5 has no archive here";
#endif
  for (const char* library : {"libhdf5", "libcurl", "libldap", "libkrb5"})
    EXPECT_EQ(first_mapped(library), "");
}
