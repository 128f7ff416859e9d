/// Append-only journal: what a run has recorded survives a crash at any moment.
///
///   file   = "TALUSJ02" record*
///   record = kind u32, tag u32, length u64, payload, crc64(kind .. payload) u64
///
/// A reader stops at the first record that is cut short or fails its checksum; everything before it is whole.
/// Bytes handed to the system by flush() survive a kill -9; sync() makes them survive a power cut.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace talus::io {

enum class RecordKind : std::uint32_t {
  header = 1,
  history = 2,
  contacts = 3,
  field = 4,
  extend = 5,
  outcome = 6,
  warning = 7,
  lines = 8,
  crossings = 9,
  column = 10  // of the fields of a structure; its number is the tag
};

class JournalWriter {
 public:
  JournalWriter() = default;
  /// Starts a new journal, or with keep > 0 cuts an existing one to `keep` bytes and goes on from there.
  JournalWriter(std::filesystem::path path, std::uint64_t keep);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  void append(RecordKind kind, std::string_view payload, std::uint32_t tag = 0);
  /// Forgets the records from `position` on.
  void take_back(std::uint64_t position);
  void flush();
  void sync();
  std::uint64_t position() const { return position_; }  // bytes, buffered ones included

 private:
  std::filesystem::path path_;
  int fd_ = -1;
  std::uint64_t position_ = 0;
  std::string buffer_;
};

class JournalReader {
 public:
  /// Reads up to `limit` bytes. Throws InputError if there is no journal.
  explicit JournalReader(const std::filesystem::path& path, std::uint64_t limit = ~std::uint64_t{0});
  /// False at the end of what is whole.
  bool next(RecordKind& kind, std::string& payload) { return next(kind, payload, nullptr); }
  /// The same; records of another tag are passed over unread.
  bool next(RecordKind& kind, std::string& payload, const std::uint32_t* tag);
  void seek(std::uint64_t position);
  std::uint64_t position() const { return position_; }  // end of the last whole record
  bool damaged() const { return damaged_; }             // bytes remain after the last whole record

 private:
  std::ifstream in_;
  std::uint64_t limit_, size_ = 0, position_ = 0;
  bool damaged_ = false;
};

}  // namespace talus::io
