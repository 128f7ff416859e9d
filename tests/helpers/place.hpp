/// A directory of its own for one test, removed at the end.
#pragma once
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

namespace talus::test {

class Place {
 public:
  Place() {
    std::string name = (std::filesystem::temp_directory_path() / "talus-test-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Place() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  /// Writes a file, in folders that are made.
  std::filesystem::path put(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace talus::test
