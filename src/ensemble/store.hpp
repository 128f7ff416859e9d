/// Members that are finished, on disk: journal/RANK.bin in the output directory, one file a process, a record
/// a member. What a kill cuts short is not read.
#pragma once
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "ensemble/member.hpp"
#include "io/journal.hpp"

namespace talus::ensemble {

class Store {
 public:
  /// Opens or goes on with the file of a process. `identity`: what another ensemble would not have.
  Store(const std::filesystem::path& directory, int rank, const std::string& identity);
  /// From any thread; the bytes are with the system when it returns.
  void add(const Member& member);

 private:
  std::mutex mutex_;
  std::unique_ptr<io::JournalWriter> writer_;
};

/// Calls `visit` for every member of all processes' files, in no order. Throws InputError if a file is
/// another ensemble's.
void each_member(const std::filesystem::path& directory, const std::string& identity,
                 const std::function<void(Member&&)>& visit);

}  // namespace talus::ensemble
