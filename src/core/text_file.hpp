/// Text files as UTF-8 with line feeds, whatever the program that wrote them.
#pragma once
#include <string>
#include <string_view>

namespace talus {

/// The bytes of a file. Throws InputError naming the file.
std::string read_bytes(const std::string& path);
void write_bytes(const std::string& path, std::string_view bytes);

/// True if the bytes begin with a byte order mark of UTF-8, UTF-16 or UTF-32.
bool has_byte_order_mark(const std::string& bytes);

/// Text as UTF-8: byte order marks are dropped, UTF-16 (with a mark, or without one where every other of the
/// first bytes is zero) is converted, and lone carriage returns become line feeds. Throws InputError for
/// UTF-32 and for UTF-16 that is damaged; `name` is the file in the message.
std::string as_utf8(std::string bytes, const std::string& name);

/// Both. Throws InputError.
std::string read_text(const std::string& path);

}  // namespace talus
