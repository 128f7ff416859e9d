#include "io/checkpoint.hpp"

#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <string_view>

#include "io/checksum.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"

namespace talus::io {
namespace {

constexpr std::size_t user_block = 512;
constexpr std::string_view magic = "TALUSCK1";

struct Guard {
  char magic[8] = {};
  std::uint64_t length = 0, crc = 0;
};

/// Length and checksum of what follows the user block.
Guard measure(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  in.seekg(user_block);
  Guard guard;
  std::memcpy(guard.magic, magic.data(), magic.size());
  std::string buffer(1 << 20, '\0');
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    const auto n = static_cast<std::size_t>(in.gcount());
    guard.crc = crc64(std::string_view(buffer).substr(0, n), guard.crc);
    guard.length += n;
  }
  return guard;
}

/// HDF5 has no dataset of an empty name, and '/' would open a group.
std::string key(const char* group, const std::string& name) {
  return fmt::format("/{}/{}", group, safe_name(name));
}

}  // namespace

void save_checkpoint(const std::filesystem::path& path, const Checkpoint& c) {
  PartFile part(path);
  {
    Hdf5File file = Hdf5File::create(part.path(), user_block);
    file.attribute("/", "scene_hash", c.scene_hash);
    file.attribute("/", "version", c.version);
    file.group("/numbers");
    file.group("/integers");
    for (const auto& [name, values] : c.numbers) {
      file.write<double>(key("numbers", name), values, {values.size()}, {}, {}, Hdf5File::Packing::plain);
      file.attribute(key("numbers", name), "name", name);
    }
    for (const auto& [name, values] : c.integers) {
      file.write<std::int64_t>(key("integers", name), values, {values.size()});
      file.attribute(key("integers", name), "name", name);
    }
    file.close();
  }
  const Guard guard = measure(part.path());
  {
    std::fstream out(part.path(), std::ios::binary | std::ios::in | std::ios::out);
    out.write(reinterpret_cast<const char*>(&guard), sizeof guard);
    out.flush();
    if (!out) throw WriteError(system_error("write", part.path()));
  }
  part.swap_in();
}

Checkpoint load_checkpoint(const std::filesystem::path& path, const std::string& scene_hash,
                           const std::string& version) {
  const std::string remedy = "run the scene again without --resume";
  Guard guard;
  {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw bad_file(path, {}, "there is no checkpoint", remedy);
    in.read(reinterpret_cast<char*>(&guard), sizeof guard);
    if (!in || std::string_view(guard.magic, 8) != magic)
      throw bad_file(path, {}, "is no checkpoint of Talus", remedy);
  }
  const Guard found = measure(path);
  if (found.length != guard.length)
    throw bad_file(path, {},
                   fmt::format("is damaged: {} bytes where {} were written", found.length, guard.length),
                   remedy);
  if (found.crc != guard.crc)
    throw bad_file(path, {}, "is damaged: its checksum does not fit its contents", remedy);

  const Hdf5File file = Hdf5File::open(path);
  Checkpoint c;
  c.scene_hash = file.text_attribute("/", "scene_hash");
  c.version = file.text_attribute("/", "version");
  if (c.version != version)
    throw bad_file(path, "version",
                   fmt::format("was written by version {}, this is version {}", c.version, version),
                   "resume with that version, or " + remedy);
  if (c.scene_hash != scene_hash)
    throw bad_file(path, "scene",
                   fmt::format("belongs to another scene (hash {:.12}, this scene has {:.12})", c.scene_hash,
                               scene_hash),
                   "resume with the scene that the directory holds, or " + remedy);
  for (const std::string& name : file.list("/numbers"))
    c.numbers[file.text_attribute("/numbers/" + name, "name")] = file.read<double>("/numbers/" + name).values;
  for (const std::string& name : file.list("/integers"))
    c.integers[file.text_attribute("/integers/" + name, "name")] =
        file.read<std::int64_t>("/integers/" + name).values;
  return c;
}

}  // namespace talus::io
