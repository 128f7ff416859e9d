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
  f(m.bonded.point_a);
  f(m.bonded.point_b);
  f(m.bonded.normal);
  f(m.bonded.area);
}

/// How many numbers that are.
constexpr std::size_t memory_numbers = 9 * 3 + 9;

/// Feature of a contact that another body, or the same two the other way round, knew under another name;
/// found by none, so that the pair's contacts take it over.
constexpr std::uint64_t handed_over = contact::first_key(contact::Form::handed_over);

/// Torn 1, holds 2, and from there 31 bits each: the bonded faces of A and B, from 1; 0: none.
inline std::int64_t bond_flags(const ContactMemory& m) {
  const auto face = [](int of) { return static_cast<std::uint64_t>(of + 1); };
  return static_cast<std::int64_t>((m.broken ? 1U : 0U) | (m.glued ? 2U : 0U) | face(m.bonded.face_a) << 2U |
                                   face(m.bonded.face_b) << 33U);
}
inline void set_bond(ContactMemory& m, std::int64_t flags) {
  const auto bits = static_cast<std::uint64_t>(flags);
  const auto face = [&](unsigned from) { return static_cast<int>(bits >> from & 0x7fffffffU) - 1; };
  m.broken = (bits & 1U) != 0, m.glued = (bits & 2U) != 0;
  m.bonded.face_a = face(2), m.bonded.face_b = face(33);
}

}  // namespace talus::coupling
