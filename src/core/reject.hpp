/// Short ways to tell bad input (see Problem).
#pragma once
#include <string>
#include <vector>

#include "core/error.hpp"

namespace talus {

/// An error about the value of a key, without a place in a file.
Problem problem_of(std::string key, std::string value, std::string rule, std::string remedy);

/// Throws InputError with that one problem.
[[noreturn]] void reject(std::string key, std::string value, std::string rule, std::string remedy);

/// Collects the requirements that a set of numbers misses, so that all are reported at once.
class Requirements {
 public:
  void require(bool good, const char* key, double value, const char* rule, const char* remedy);
  /// Throws InputError if anything fell short.
  void done() const;

 private:
  std::vector<Problem> problems_;
};

}  // namespace talus
