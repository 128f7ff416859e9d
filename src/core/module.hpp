/// Modules that are loaded at run time, so that a scene maps only the libraries it needs.
#pragma once
#include <filesystem>
#include <string>

namespace talus {

/// Address of `symbol` in the module `file`, looked for in TALUS_MODULE_DIR, in the directories of
/// add_module_directory(), beside the object that this code is in, beside the executable, and in ../lib/talus
/// from there. The module stays loaded until the process ends. Throws InputError under `key`, with `remedy`,
/// if it is not there or does not load.
void* module_symbol(const std::string& file, const std::string& symbol, const std::string& key,
                    const std::string& remedy);

/// A further place to look in, before all others but TALUS_MODULE_DIR: for programs that the modules do not
/// lie beside (Python).
void add_module_directory(const std::filesystem::path& directory);

}  // namespace talus
