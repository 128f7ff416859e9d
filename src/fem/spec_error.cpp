#include "fem/spec_error.hpp"

#include <fmt/format.h>

#include "core/reject.hpp"

namespace talus::fem {

void bad(const StructureSpec& spec, const std::string& key, const std::string& value, const std::string& rule,
         const std::string& remedy, const std::string& file) {
  Problem p;
  p.file = file;
  p.key = key.empty() ? "structure." + spec.name : fmt::format("structure.{}.{}", spec.name, key);
  p.value = value, p.rule = rule, p.remedy = remedy;
  throw InputError(p);
}

}  // namespace talus::fem
