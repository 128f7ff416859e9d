#include "ensemble/member.hpp"

#include <stdexcept>

#include <fmt/format.h>

#include "core/error.hpp"
#include "io/bytes.hpp"

namespace talus::ensemble {
namespace {

template <class Io, class M>
void each(Io& io, M& m) {
  io(m.index), io(m.steps), io(m.status), io(m.message), io(m.cpu), io(m.energy_residual),
      io(m.numerical_gain), io(m.reach_angle), io(m.start), io(m.end);
}

template <class Io, class C>
void crossing(Io& io, C& c) {
  io(c.line), io(c.block), io(c.time), io(c.position), io(c.velocity), io(c.spin), io(c.translational),
      io(c.rotational), io(c.height);
}

template <class Io, class H>
void hit(Io& io, H& h) {
  io(h.structure), io(h.block), io(h.time), io(h.mass), io(h.point), io(h.centre), io(h.velocity), io(h.spin),
      io(h.orientation);
}

}  // namespace

const char* status_text(Status status) {
  constexpr const char* names[] = {"done", "at rest", "left", "failed", "over limit", "suspect"};
  return names[static_cast<std::size_t>(status)];
}

std::string Member::encode() const {
  io::ByteWriter bytes;
  auto put = [&](const auto& x) { bytes.put(x); };
  each(put, *this);
  bytes.put(static_cast<std::uint64_t>(crossings.size()));
  for (const Crossing& c : crossings) crossing(put, c);
  bytes.put(static_cast<std::uint64_t>(hits.size()));
  for (const Hit& h : hits) hit(put, h);
  bytes.put(static_cast<std::uint64_t>(passages.size()));
  bytes.raw(passages.data(), passages.size() * sizeof(Passage));
  return bytes.bytes();
}

Member Member::decode(std::string_view text) {
  try {
    io::ByteReader bytes(text);
    auto get = [&](auto& x) { bytes.get(x); };
    Member m;
    each(get, m);
    const auto size = [&](std::size_t least) {
      const auto n = bytes.take<std::uint64_t>();
      if (n > bytes.left() / least) throw std::out_of_range("count beyond the record");
      return static_cast<std::size_t>(n);
    };
    m.crossings.resize(size(100));
    for (Crossing& c : m.crossings) crossing(get, c);
    m.hits.resize(size(100));
    for (Hit& h : m.hits) hit(get, h);
    m.passages.resize(size(sizeof(Passage)));
    bytes.raw(m.passages.data(), m.passages.size() * sizeof(Passage));
    if (m.status > Status::suspect) throw std::out_of_range("status");
    return m;
  } catch (const std::out_of_range& error) {
    throw InputError(Problem{.severity = Problem::Severity::error,
                             .file = {},
                             .line = 0,
                             .column = 0,
                             .key = "members.bin",
                             .value = {},
                             .rule = fmt::format("holds a member that cannot be read: {}", error.what()),
                             .remedy = "run without --resume"});
  }
}

}  // namespace talus::ensemble
