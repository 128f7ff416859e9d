/// All numbers of a contact's memory in one order, for both directions of a copy.
#pragma once
#include "coupling/environment.hpp"

namespace talus::coupling {

/// `f` takes double and Vec3, const or to be set as `m` is.
template <typename Memory, typename F>
void each_number(Memory& m, F&& f) {
  f(m.force);
  f(m.shear);
  f(m.normal_energy);
  f(m.end_energy);
  f(m.shear_energy);
  f(m.crushed);
  f(m.indentation);
  f(m.offset);
  f(m.stiffness);
  f(m.corner_normal);
  f(m.place);
  f(m.normal);
  f(m.lasted);
  f(m.shear_way);
}

/// How many numbers that are.
constexpr std::size_t memory_numbers = 6 * 3 + 8;

/// Feature of a contact that another body, or the same two the other way round, knew under another name;
/// found by none, so that the pair's contacts take it over.
constexpr std::uint64_t handed_over = contact::first_key(contact::Form::handed_over);

inline std::int64_t bond_flags(const ContactMemory& m) { return (m.broken ? 1 : 0) | (m.glued ? 2 : 0); }
inline void set_bond(ContactMemory& m, std::int64_t flags) {
  m.broken = (flags & 1) != 0, m.glued = (flags & 2) != 0;
}

}  // namespace talus::coupling
