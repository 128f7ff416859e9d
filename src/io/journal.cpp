#include "io/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/error.hpp"
#include "io/checksum.hpp"
#include "io/files.hpp"

namespace talus::io {
namespace {

constexpr std::string_view journal_magic = "TALUSJ02";
constexpr std::size_t buffer_limit = 1 << 16;

struct Head {
  std::uint32_t kind = 0, tag = 0;
  std::uint64_t length = 0;
};
static_assert(sizeof(Head) == 16);

std::string_view view(const Head& head) { return {reinterpret_cast<const char*>(&head), sizeof(Head)}; }

}  // namespace

JournalWriter::JournalWriter(std::filesystem::path path, std::uint64_t keep) : path_(std::move(path)) {
  fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (keep == 0 ? O_TRUNC : 0), 0644);
  if (fd_ < 0) throw WriteError(system_error("create", path_));
  if (keep > 0 && (::ftruncate(fd_, static_cast<off_t>(keep)) != 0 || ::lseek(fd_, 0, SEEK_END) < 0))
    throw WriteError(system_error("cut back", path_));
  position_ = keep;
  if (keep == 0) {
    buffer_ = journal_magic;
    position_ = journal_magic.size();
    flush();
  }
}

JournalWriter::~JournalWriter() {
  if (fd_ < 0) return;
  try {
    flush();
  } catch (const WriteError&) {  // already reported by the flush that the run itself made
  }
  ::close(fd_);
}

void JournalWriter::append(RecordKind kind, std::string_view payload, std::uint32_t tag) {
  const Head head{static_cast<std::uint32_t>(kind), tag, payload.size()};
  const std::uint64_t crc = crc64(payload, crc64(view(head)));
  buffer_.append(view(head)).append(payload).append(reinterpret_cast<const char*>(&crc), sizeof crc);
  position_ += sizeof head + payload.size() + sizeof crc;
  if (buffer_.size() >= buffer_limit) flush();
}

void JournalWriter::take_back(std::uint64_t position) {
  if (const std::uint64_t written = position_ - buffer_.size(); position >= written) {
    buffer_.resize(position - written);
  } else {
    buffer_.clear();
    const auto end = static_cast<off_t>(position);
    if (::ftruncate(fd_, end) != 0 || ::lseek(fd_, end, SEEK_SET) < 0)
      throw WriteError(system_error("cut back", path_));
  }
  position_ = position;
}

void JournalWriter::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t n = ::write(fd_, rest.data(), rest.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const std::string text = system_error("write", path_);
      buffer_.erase(
          0, buffer_.size() - rest.size());  // what was not written stays, so that a later flush goes on
      throw WriteError(text);
    }
    rest.remove_prefix(static_cast<std::size_t>(n));
  }
  buffer_.clear();
}

void JournalWriter::sync() {
  flush();
  if (::fdatasync(fd_) != 0) throw WriteError(system_error("sync", path_));
  struct stat now {};
  if (::fstat(fd_, &now) != 0 || now.st_nlink == 0)
    throw WriteError(fmt::format("cannot go on: {} was removed while the run wrote to it", path_.string()));
}

JournalReader::JournalReader(const std::filesystem::path& path, std::uint64_t limit)
    : in_(path, std::ios::binary), limit_(limit) {
  char head[8] = {};
  if (!in_.is_open()) throw WriteError(system_error("read", path));  // removed while a run writes to it
  if (!in_.read(head, 8) || std::string_view(head, 8) != journal_magic)
    throw bad_file(path, {}, "is no journal of Talus", "run the scene again");
  in_.seekg(0, std::ios::end);
  size_ = static_cast<std::uint64_t>(in_.tellg());
  limit_ = std::min(limit_, size_);
  in_.seekg(8);
  position_ = 8;
}

void JournalReader::seek(std::uint64_t position) {
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(std::min(position, limit_)));
  position_ = std::min(position, limit_);
}

bool JournalReader::next(RecordKind& kind, std::string& payload, const std::uint32_t* tag) {
  Head head;
  std::uint64_t crc = 0;
  const auto end = [&] {
    damaged_ = position_ < size_;
    return false;
  };
  for (;;) {
    if (position_ + sizeof head + sizeof crc > limit_) return end();
    if (!in_.read(reinterpret_cast<char*>(&head), sizeof head)) return end();
    if (head.length > limit_ - position_ - sizeof head - sizeof crc) return end();
    if (tag == nullptr || head.tag == *tag) break;
    seek(position_ + sizeof head + head.length + sizeof crc);
  }
  payload.resize(head.length);
  if (!in_.read(payload.data(), static_cast<std::streamsize>(head.length)) ||
      !in_.read(reinterpret_cast<char*>(&crc), sizeof crc))
    return end();
  if (crc != crc64(payload, crc64(view(head)))) return end();
  position_ += sizeof head + head.length + sizeof crc;
  kind = static_cast<RecordKind>(head.kind);
  return true;
}

}  // namespace talus::io
