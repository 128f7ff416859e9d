#include "ensemble/store.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "io/files.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

InputError of_another(const fs::path& file) {
  return io::bad_file(file, "--resume",
                      "the scene, its files, the ensemble or the program is another than before",
                      "run without --resume, or put the scene back as it was");
}

}  // namespace

Store::Store(const fs::path& directory, int rank, const std::string& identity) {
  const fs::path file = directory / "journal" / fmt::format("{}.bin", rank);
  fs::create_directories(file.parent_path());
  std::uint64_t keep = 0;
  if (fs::exists(file) && fs::file_size(file) > 0) {
    io::JournalReader reader(file);
    io::RecordKind kind{};
    std::string payload;
    if (reader.next(kind, payload)) {
      if (kind != io::RecordKind::header || payload != identity) throw of_another(file);
      while (reader.next(kind, payload)) {}
      keep = reader.position();
    }
  }
  writer_ = std::make_unique<io::JournalWriter>(file, keep);
  if (keep > 0) return;
  writer_->append(io::RecordKind::header, identity);
  writer_->flush();
}

void Store::add(const Member& member) {
  const std::string bytes = member.encode();
  const std::lock_guard lock(mutex_);
  writer_->append(io::RecordKind::outcome, bytes);
  writer_->flush();
}

void each_member(const fs::path& directory, const std::string& identity,
                 const std::function<void(Member&&)>& visit) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(directory / "journal", none))
    if (entry.path().extension() == ".bin") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    if (fs::file_size(file) == 0) continue;
    io::JournalReader reader(file);
    io::RecordKind kind{};
    std::string payload;
    if (!reader.next(kind, payload)) continue;  // cut short in its first record
    if (kind != io::RecordKind::header || payload != identity) throw of_another(file);
    while (reader.next(kind, payload))
      if (kind == io::RecordKind::outcome) visit(Member::decode(payload));
  }
}

}  // namespace talus::ensemble
