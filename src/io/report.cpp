#include "io/report.hpp"

#include <algorithm>
#include <map>

#include "io/json_file.hpp"
#include "io/recorder.hpp"
#include "io/report_data.hpp"
#include "io/summary_check.hpp"
#include "io/xml.hpp"

// The page as one HTML file, put into the program by the assembler.
extern "C" {
extern const char talus_report_page[];
extern const char talus_report_page_end[];
}
__asm__(
    ".section .rodata\n"
    ".global talus_report_page\n"
    "talus_report_page:\n"
    ".incbin \"" TALUS_REPORT_PAGE
    "\"\n"
    ".global talus_report_page_end\n"
    "talus_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");

namespace fs = std::filesystem;

namespace talus::io {
namespace {

constexpr const char* summary_remedy = "run the scene again, or bring back the file that the run wrote";
constexpr const char* capacity_remedy = "delete it, and let talus capacity make it anew";

}  // namespace

ReportData::ReportData(const fs::path& directory)
    : file(Hdf5File::open(directory / "results.h5")),
      summary(read_json(directory / "summary.json", summary_remedy)),
      time(file.read<double>("/history/time").values),
      names(file.read_texts("/history/blocks/name")) {
  check_summary(summary, directory / "summary.json");
  meta["summary"] = summary;
  std::error_code none;
  if (const fs::path capacity = directory / "capacity.json"; fs::exists(capacity, none)) try {
      meta["capacity"] = read_json(capacity, capacity_remedy).at("members");
      for (auto& member : meta["capacity"]) member.erase("curve_built"), member.erase("curve_now");
    } catch (const nlohmann::json::exception& fault) { throw bad_json(capacity, fault, capacity_remedy); }
  for (const auto& m : summary.value("impacts", nlohmann::ordered_json::array()))
    windows.emplace_back(m.value("start", 0.0) - 0.1, m.value("end", 0.0) + 0.4);
}

namespace {

using json = nlohmann::ordered_json;

/// The page with its slots filled.
std::string fill(std::string_view page, const ReportData& d, const std::string& data) {
  // "<" cannot end the script element that holds the JSON.
  std::string text;
  for (const char c : d.meta.dump(-1, ' ', false, json::error_handler_t::replace))
    c == '<' ? text += "\\u003c" : text += c;
  const std::string title = xml_text(d.summary.value("title", std::string("Results")));
  std::string out;
  out.reserve(page.size() + data.size() + text.size());
  const std::map<std::string_view, const std::string*> slots = {
      {"%%TALUS_TITLE%%", &title}, {"%%TALUS_META%%", &text}, {"%%TALUS_DATA%%", &data}};
  std::size_t at = 0;
  while (at < page.size()) {
    const std::size_t mark = page.find("%%TALUS_", at);
    out += page.substr(at, mark - at);
    if (mark == std::string_view::npos) break;
    const std::size_t end = page.find("%%", mark + 2);
    const auto slot = slots.find(page.substr(mark, end == std::string_view::npos ? 0 : end + 2 - mark));
    if (slot == slots.end()) {
      out += page.substr(mark, 2);
      at = mark + 2;
    } else {
      out += *slot->second;
      at = end + 2;
    }
  }
  return out;
}

std::string page(const fs::path& directory) {
  ReportData d(directory);
  add_poses(d);
  add_structures(d);
  add_site(d);
  add_shapes(d);
  add_curves(d);
  json arrays = d.blob.index();
  d.meta["arrays"] = std::move(arrays);
  return fill({talus_report_page, static_cast<std::size_t>(talus_report_page_end - talus_report_page)}, d,
              base64(d.blob.bytes()));
}

}  // namespace

fs::path write_report(const fs::path& directory) {
  std::error_code error;
  if (fs::exists(directory / "journal.bin", error) && !fs::exists(directory / "summary.json", error))
    recover(directory);
  if (!fs::exists(directory / "results.h5", error) || !fs::exists(directory / "summary.json", error))
    throw bad_file(directory, {}, "holds no results (results.h5 and summary.json)",
                   "name the output directory of a run");
  const fs::path path = directory / "report.html";
  try {
    write_file(path, page(directory));
  } catch (const json::exception& fault) {  // a key of another kind than the run wrote
    throw bad_json(directory / "summary.json", fault, summary_remedy);
  }
  return path;
}

}  // namespace talus::io
