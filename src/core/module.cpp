#include "core/module.hpp"

#include <dlfcn.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "core/error.hpp"

namespace talus {

namespace {
std::vector<std::filesystem::path>& further_places() {
  static std::vector<std::filesystem::path> places;
  return places;
}

/// Its text is not as in the file.
bool relocates_text(const dl_phdr_info* object) {
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    if (object->dlpi_phdr[i].p_type != PT_DYNAMIC) continue;
    for (const auto* d = reinterpret_cast<const ElfW(Dyn)*>(object->dlpi_addr + object->dlpi_phdr[i].p_vaddr);
         d->d_tag != DT_NULL; ++d)
      if (d->d_tag == DT_TEXTREL || (d->d_tag == DT_FLAGS && (d->d_un.d_val & DF_TEXTREL) != 0)) return true;
  }
  return false;
}

/// To bind the names of deal.II the loader reads 130 MB of the libraries' tables, once. These pages are the
/// page cache's, but count as resident in every process as long as they are mapped: batch systems add them up,
/// one time for each rank. What is needed again comes back from the page cache.
int leave_to_page_cache(dl_phdr_info* object, std::size_t, void*) {
  if (object->dlpi_name == nullptr || *object->dlpi_name == '\0' || relocates_text(object)) return 0;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const auto& part = object->dlpi_phdr[i];
    if (part.p_type != PT_LOAD || (part.p_flags & PF_W) != 0) continue;
    const std::uintptr_t begin = (object->dlpi_addr + part.p_vaddr) / page * page,
                         end = object->dlpi_addr + part.p_vaddr + part.p_memsz;
    (void)madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
  }
  return 0;
}

}  // namespace

void add_module_directory(const std::filesystem::path& directory) { further_places().push_back(directory); }

void* module_symbol(const std::string& file, const std::string& symbol, const std::string& key,
                    const std::string& remedy) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* given = std::getenv("TALUS_MODULE_DIR")) places.emplace_back(given);
  places.insert(places.end(), further_places().begin(), further_places().end());
  // Beside the object that this code is in: a module finds the others whatever program has loaded it.
  // Never a name without a directory, which the working directory would answer.
  if (Dl_info own; dladdr(reinterpret_cast<const void*>(&module_symbol), &own) != 0 && own.dli_fname)
    if (const fs::path object = own.dli_fname; object.is_absolute()) places.push_back(object.parent_path());
  std::error_code failed;
  const fs::path executable = fs::read_symlink("/proc/self/exe", failed);
  if (!failed) {
    places.push_back(executable.parent_path());
    places.push_back(executable.parent_path().parent_path() / "lib" / "talus");
  }
  Problem p;
  p.key = key;
  p.remedy = remedy;
  std::string tried;
  for (const fs::path& place : places) {
    const fs::path path = place / file;
    if (!fs::exists(path, failed)) {
      tried += (tried.empty() ? "" : ", ") + path.string();
      continue;
    }
    // Lazy binding halves the time of loading two hundred libraries. Never closed: objects of the module live
    // until the process ends.
    void* handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!handle) {
      p.rule = dlerror();
      throw InputError(p);
    }
    dl_iterate_phdr(leave_to_page_cache, nullptr);
    if (void* address = dlsym(handle, symbol.c_str())) return address;
    p.rule = path.string() + " has no function " + symbol;
    p.remedy = "build the program and its modules from the same source";
    throw InputError(p);
  }
  p.rule = "the module " + file + " is not there (looked for " + tried + ")";
  throw InputError(p);
}

}  // namespace talus
