#include "verify/suite.hpp"
namespace talus::verify {
std::vector<Case> stability_cases() { return {}; }
std::vector<Case> fem_cases() { return {}; }
std::vector<Case> coupling_cases() { return {}; }
}
