#include "fem/spec_error.hpp"

#include <fmt/format.h>

#include "core/reject.hpp"

namespace talus::fem {

void bad(const StructureSpec& spec, const std::string& key, const std::string& value, const std::string& rule,
         const std::string& remedy) {
  reject(fmt::format("structure.{}.{}", spec.name, key), value, rule, remedy);
}

}  // namespace talus::fem
