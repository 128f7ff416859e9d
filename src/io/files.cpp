#include "io/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "core/error.hpp"

namespace fs = std::filesystem;

namespace talus::io {
namespace {

// Everything a run may leave behind; whatever else lies in the directory belongs to the user and stays.
constexpr std::string_view known_files[] = {"scene.toml",  "scene.resolved.json", "log.jsonl",   "summary.json", "results.h5",
                                            "results.xdmf", "results.pvd",        "report.html", "journal.bin",  "checkpoint.h5",
                                            "scene.toml.part", "scene.resolved.json.part", "summary.json.part", "results.h5.part",
                                            "results.xdmf.part", "results.pvd.part", "report.html.part", "checkpoint.h5.part"};

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
  return InputError(Problem{Problem::Severity::error, {}, 0, 0, "output directory", directory.string(), std::move(rule), std::move(remedy)});
}

}  // namespace

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
    if (!fs::is_directory(parent, error)) throw refusal(directory, fmt::format("{} is a file", parent.string()), "name another directory with -o");
    if (::access(parent.c_str(), W_OK | X_OK) != 0)
      throw refusal(directory, fmt::format("{} cannot be written: {}", parent.string(), std::strerror(errno)), "name another directory with -o");
    return;
  }
  if (!fs::is_directory(status)) throw refusal(directory, "is a file, not a directory", "name another directory with -o");
  if (::access(directory.c_str(), W_OK | X_OK) != 0)
    throw refusal(directory, fmt::format("cannot be written: {}", std::strerror(errno)), "name another directory with -o");
  if (fs::exists(directory / marker_name, error)) return;
  if (!fs::is_empty(directory, error) || error)
    throw refusal(directory, fmt::format("holds files that are not results of Talus (no {} in it)", marker_name),
                  "name an empty or new directory with -o");
}

void claim_directory(const fs::path& directory) {
  check_directory(directory);
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw refusal(directory, fmt::format("cannot be created: {}", error.message()), "name another directory with -o");
  for (const std::string_view name : known_files) fs::remove(directory / name, error);
  fs::remove_all(directory / "fields", error);
  write_file(directory / marker_name, "Results of Talus. A directory with this file may be overwritten by the next run.\n");
}

void swap_in(const fs::path& temporary, const fs::path& path) {
  sync_path(temporary, O_RDONLY);
  if (::rename(temporary.c_str(), path.c_str()) != 0) throw WriteError(system_error("rename a finished file to", path));
  const fs::path parent = path.parent_path();
  sync_path(parent.empty() ? fs::path(".") : parent, O_RDONLY | O_DIRECTORY);
}

void write_file(const fs::path& path, std::string_view bytes, bool durable) {
  fs::path temporary = path;
  temporary += ".part";
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) throw WriteError(system_error("create", temporary));
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const std::string text = system_error("write", temporary);
      ::close(fd);
      ::unlink(temporary.c_str());
      throw WriteError(text);
    }
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  ::close(fd);
  if (durable) return swap_in(temporary, path);
  if (::rename(temporary.c_str(), path.c_str()) != 0) throw WriteError(system_error("rename a finished file to", path));
}

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw bad_file(path, {}, fmt::format("cannot be read: {}", std::strerror(errno)), "check the path");
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) throw bad_file(path, {}, "reading it failed", "check the disk");
  return bytes;
}

}  // namespace talus::io
