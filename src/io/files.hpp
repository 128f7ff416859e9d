/// Output directories and files that are whole or absent.
///
/// An output directory is ours if it holds the marker file `.talus-output`. A directory that is absent, empty
/// or ours may be written to; any other is refused with InputError before anything is touched. A file is
/// written beside its final name, synced, and renamed over it, so that a reader, or a crash, never meets half
/// of it.
#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/error.hpp"

namespace talus::io {

/// The disk is full, the directory has vanished, a file is locked: the run cannot go on recording. The
/// message names the file, the operation and the system's reason.
class WriteError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::string_view marker_name = ".talus-output";

/// The one process that writes to an output directory, as long as it lives (flock on the directory itself, so
/// that a kill leaves nothing behind). Throws InputError if another one does. File systems without such locks
/// are taken at their word.
class DirectoryLock {
 public:
  explicit DirectoryLock(const std::filesystem::path& directory);
  ~DirectoryLock();
  DirectoryLock(DirectoryLock&& other) noexcept;
  DirectoryLock& operator=(DirectoryLock&& other) noexcept;

 private:
  int fd_ = -1;
};

/// Throws InputError if another process writes to `directory`.
void require_idle(const std::filesystem::path& directory);

/// What a directory is to hold. Results of a run and of an ensemble were long in the making: neither gives
/// way to results of another kind.
enum class Results { run, ensemble, other };

/// Throws InputError if `directory` exists and is neither empty nor ours, cannot be written, or is written to
/// by another process. Changes nothing.
void check_directory(const std::filesystem::path& directory);
/// The same for what claims the directory: throws also if it holds a run, or an ensemble, finished or not,
/// and is to hold results of another kind.
void check_directory(const std::filesystem::path& directory, Results kind);

/// Throws InputError if one of `inputs` is a file that a run replaces in its directory.
void spare_inputs(const std::filesystem::path& directory, std::span<const std::filesystem::path> inputs);

/// Checks, creates, locks, marks; removes what earlier results of the kind left there (known names only,
/// never anything else).
[[nodiscard]] DirectoryLock claim_directory(const std::filesystem::path& directory, Results kind);

/// Whole or absent: temporary file, fsync, rename, fsync of the directory. Files that can be made again need
/// not be durable.
void write_file(const std::filesystem::path& path, std::string_view bytes, bool durable = true);
/// The same; `write` puts the pieces one after another.
void write_file(const std::filesystem::path& path,
                const std::function<void(const std::function<void(std::string_view)>&)>& write, bool durable);

/// A file in the making beside its final name. swap_in() syncs it and renames it over that name; without, it
/// is removed at the end, so that a full disk gets its space back.
class PartFile {
 public:
  explicit PartFile(std::filesystem::path target);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;
  const std::filesystem::path& path() const { return part_; }
  void swap_in(bool durable = true);

 private:
  std::filesystem::path target_, part_;
};

/// Throws InputError naming the file if it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// One thing wrong with a file or a dataset in it.
inline InputError bad_file(const std::filesystem::path& file, std::string key, std::string rule,
                           std::string remedy) {
  return InputError(Problem{
      Problem::Severity::error, file.string(), 0, 0, std::move(key), {}, std::move(rule), std::move(remedy)});
}

/// Text for the last system error on `path`.
std::string system_error(std::string_view operation, const std::filesystem::path& path);

/// A name from a scene as one component of a file or dataset path: separators and control characters become
/// '_', never "." or "..".
std::string safe_name(std::string_view name);

}  // namespace talus::io
