/// `talus convert IN OUT`: any history of results.h5 as CSV.
///
///   results.h5#/history/blocks     one row per time; columns NAME.position.x, NAME.position.y, ...
///   results.h5#/ledger             one row per time; columns kinetic, potential, ...
///   results.h5#/history/contacts/structure   one row per contact and step
///   results.h5#/history/blocks/position, results.h5#/geometry/blocks/vertices: one dataset
///
/// The first line holds the column names with their units, "B1.position.x [m]". Numbers keep all their
/// digits.
#pragma once
#include <optional>
#include <string>

namespace talus::io {

/// "FILE#PART" in two. A name may itself hold '#': the longest that is a file, and if there is none the part
/// begins with "#/" or after the last folder.
struct FileAndPart {
  std::string file;
  std::optional<std::string> part;
};
FileAndPart file_and_part(const std::string& in);

/// Throws InputError for an unknown format, a missing file or path, and WriteError if OUT cannot be written.
void convert(const std::string& in, const std::string& out);

/// The CSV text of one group or dataset of a results file.
std::string csv_text(const std::string& results, const std::string& path);

}  // namespace talus::io
