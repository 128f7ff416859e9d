#include "io/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "core/error.hpp"

namespace fs = std::filesystem;

namespace talus::io {
namespace {

// Everything a run may leave behind; whatever else lies in the directory belongs to the user and stays.
// The checkpoint goes before the journal that it points into, so that a kill between them leaves no
// checkpoint without one.
constexpr std::string_view known_files[] = {
    "checkpoint.h5",       "journal.bin",        "summary.json",       "scene.toml",
    "scene.resolved.json", "log.jsonl",          "results.h5",         "results.xdmf",
    "results.pvd",         "report.html",        "scene.toml.part",    "scene.resolved.json.part",
    "summary.json.part",   "results.h5.part",    "results.xdmf.part",  "results.pvd.part",
    "report.html.part",    "checkpoint.h5.part", "capacity.json",      "capacity.json.part",
    "ensemble.h5",         "ensemble.h5.part",   "details.json",       "details.json.part",
    "ensemble.gpkg",       "fragility.json",     "fragility.json.part"};
constexpr std::string_view known_folders[] = {"fields", "members", "maps", "journal", "fragility"};

void sync_path(const fs::path& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) throw WriteError(system_error("open", path));
  const int rc = ::fsync(fd);
  const int saved = errno;
  ::close(fd);
  if (rc != 0 && saved != EINVAL && saved != EROFS) {
    errno = saved;
    throw WriteError(system_error("sync", path));
  }
}

InputError refusal(const fs::path& directory, std::string rule, std::string remedy) {
  return InputError(Problem{Problem::Severity::error,
                            {},
                            0,
                            0,
                            "output directory",
                            directory.string(),
                            std::move(rule),
                            std::move(remedy)});
}

/// Of the directory, with a lock of this kind; -1 where there is none to be had but for another's.
int locked(const fs::path& directory, int kind) {
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0 || ::flock(fd, kind | LOCK_NB) == 0) return fd;
  const bool busy = errno == EWOULDBLOCK;
  ::close(fd);
  if (busy)
    throw refusal(directory, "another talus is writing there",
                  "wait for its end, or name another directory with -o");
  return -1;
}

}  // namespace

DirectoryLock::DirectoryLock(const fs::path& directory) : fd_(locked(directory, LOCK_EX)) {}
DirectoryLock::~DirectoryLock() {
  if (fd_ >= 0) ::close(fd_);
}
DirectoryLock::DirectoryLock(DirectoryLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
DirectoryLock& DirectoryLock::operator=(DirectoryLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

void require_idle(const fs::path& directory) {
  if (const int fd = locked(directory, LOCK_SH); fd >= 0) ::close(fd);
}

void spare_inputs(const fs::path& directory, std::span<const fs::path> inputs) {
  std::error_code none;
  const fs::path fields = fs::weakly_canonical(directory / "fields", none);
  for (const fs::path& input : inputs) {
    bool replaced = fs::weakly_canonical(input, none).parent_path() == fields;
    for (const std::string_view name : known_files)
      replaced = replaced || fs::equivalent(directory / name, input, none);
    if (replaced)
      throw refusal(directory,
                    fmt::format("holds {}, which the scene reads and this run would replace", input.string()),
                    "name another directory with -o");
  }
}

std::string system_error(std::string_view operation, const fs::path& path) {
  return fmt::format("cannot {} {}: {}", operation, path.string(), std::strerror(errno));
}

std::string safe_name(std::string_view name) {
  std::string text(name);
  for (char& c : text)
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20) c = '_';
  if (text.empty() || text == "." || text == "..") text = "_" + text;
  return text;
}

void check_directory(const fs::path& directory) {
  std::error_code error;
  const fs::file_status status = fs::status(directory, error);
  if (!fs::exists(status)) {
    // The nearest existing ancestor decides whether it can be created.
    fs::path parent = fs::absolute(directory).lexically_normal();
    while (parent.has_relative_path() && !fs::exists(parent, error)) parent = parent.parent_path();
    if (!fs::is_directory(parent, error))
      throw refusal(directory, fmt::format("{} is a file", parent.string()),
                    "name another directory with -o");
    if (::access(parent.c_str(), W_OK | X_OK) != 0)
      throw refusal(directory, fmt::format("{} cannot be written: {}", parent.string(), std::strerror(errno)),
                    "name another directory with -o");
    return;
  }
  if (!fs::is_directory(status))
    throw refusal(directory, "is a file, not a directory", "name another directory with -o");
  if (::access(directory.c_str(), W_OK | X_OK) != 0)
    throw refusal(directory, fmt::format("cannot be written: {}", std::strerror(errno)),
                  "name another directory with -o");
  require_idle(directory);
  if (fs::exists(directory / marker_name, error)) return;
  // A run that was killed while it marked its new directory leaves half a marker there and nothing else.
  const std::string half = std::string(marker_name) + ".part";
  bool foreign = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error))
    foreign = foreign || entry.path().filename() != half;
  if (foreign || error)
    throw refusal(directory,
                  fmt::format("holds files that are not results of Talus (no {} in it)", marker_name),
                  "name an empty or new directory with -o");
}

void check_directory(const fs::path& directory, Results kind) {
  check_directory(directory);
  const auto holds = [&](std::initializer_list<const char*> names) {
    return std::ranges::any_of(names, [&](const char* name) { return fs::exists(directory / name); });
  };
  const bool ensemble = kind != Results::ensemble && holds({"ensemble.h5", "journal"}),
             run = kind != Results::run && holds({"results.h5", "journal.bin", "checkpoint.h5"});
  if (ensemble || run)
    throw refusal(
        directory,
        fmt::format("holds the results of {}, which would be lost", ensemble ? "an ensemble" : "a run"),
        "name another directory with -o, or remove this one");
}

DirectoryLock claim_directory(const fs::path& directory, Results kind) {
  check_directory(directory, kind);
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    throw refusal(directory, fmt::format("cannot be created: {}", error.message()),
                  "name another directory with -o");
  DirectoryLock lock(directory);
  for (const std::string_view name : known_files) fs::remove(directory / name, error);
  for (const std::string_view name : known_folders) fs::remove_all(directory / name, error);
  write_file(directory / marker_name,
             "Results of Talus. A directory with this file may be overwritten by the next run.\n");
  return lock;
}

PartFile::PartFile(fs::path target) : target_(std::move(target)), part_(target_) { part_ += ".part"; }

PartFile::~PartFile() {
  if (!part_.empty()) ::unlink(part_.c_str());
}

void PartFile::swap_in(bool durable) {
  if (durable) sync_path(part_, O_RDONLY);
  if (::rename(part_.c_str(), target_.c_str()) != 0)
    throw WriteError(system_error("rename a finished file to", target_));
  part_.clear();
  const fs::path parent = target_.parent_path();
  if (durable) sync_path(parent.empty() ? fs::path(".") : parent, O_RDONLY | O_DIRECTORY);
}

void write_file(const fs::path& path, std::string_view bytes, bool durable) {
  write_file(
      path, [bytes](const auto& put) { put(bytes); }, durable);
}

void write_file(const fs::path& path,
                const std::function<void(const std::function<void(std::string_view)>&)>& write,
                bool durable) {
  PartFile file(path);
  {
    struct Descriptor {
      int fd;
      ~Descriptor() {
        if (fd >= 0) ::close(fd);
      }
    } const to{::open(file.path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)};
    if (to.fd < 0) throw WriteError(system_error("create", file.path()));
    write([&](std::string_view bytes) {
      while (!bytes.empty()) {
        const ssize_t n = ::write(to.fd, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) throw WriteError(system_error("write", file.path()));
        bytes.remove_prefix(static_cast<std::size_t>(n));
      }
    });
  }
  file.swap_in(durable);
}

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw bad_file(path, {}, fmt::format("cannot be read: {}", std::strerror(errno)), "check the path");
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) throw bad_file(path, {}, "reading it failed", "check the disk");
  return bytes;
}

}  // namespace talus::io
