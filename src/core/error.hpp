/// The three kinds of failure (architecture: input, bug, non-convergence).
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

namespace talus {

/// One thing wrong with the input: where it is, what it is, and what to do. `check(scene)` collects all of
/// them.
struct Problem {
  enum class Severity { error, warning };
  Severity severity = Severity::error;
  std::string file;         // path as the user gave it; empty if none applies
  int line = 0;             // 1-based; 0 if unknown
  int column = 0;           // 1-based; 0 if unknown
  std::string key;          // dotted key, e.g. "block.B1.size", or the entity, e.g. "mesh edge 12-17"
  std::string value;        // the offending value as text
  std::string rule;         // what must hold
  std::string remedy;       // what to do
  std::string str() const;  // "file:line:column: error: key = value: rule; remedy"
};

/// Bad input or usage: exit code 2, nothing written.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Problem> problems);
  explicit InputError(Problem problem) : InputError(std::vector<Problem>{std::move(problem)}) {}
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

/// The step could not be solved at the smallest step: exit code 3, state saved.
class NumericalFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace talus
