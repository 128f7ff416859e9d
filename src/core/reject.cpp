#include "core/reject.hpp"

#include <fmt/format.h>

#include <utility>

namespace talus {

Problem problem_of(std::string key, std::string value, std::string rule, std::string remedy) {
  Problem p;
  p.key = std::move(key);
  p.value = std::move(value);
  p.rule = std::move(rule);
  p.remedy = std::move(remedy);
  return p;
}

void reject(std::string key, std::string value, std::string rule, std::string remedy) {
  throw InputError(problem_of(std::move(key), std::move(value), std::move(rule), std::move(remedy)));
}

void Requirements::require(bool good, const char* key, double value, const char* rule, const char* remedy) {
  if (!good) problems_.push_back(problem_of(key, fmt::format("{:g}", value), rule, remedy));
}

void Requirements::done() const {
  if (!problems_.empty()) throw InputError(problems_);
}

}  // namespace talus
