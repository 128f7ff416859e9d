/// The parts of results.h5, each written by its own class. Internal to io.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "io/hdf5_file.hpp"
#include "io/records.hpp"
#include "io/xdmf.hpp"

namespace talus::io {

/// One dataset that grows row by row: rows are kept until flush() writes them together.
struct Column {
  std::string path;
  std::size_t width;
  std::vector<double> values;
  void add(const double* v, std::size_t n) { values.insert(values.end(), v, v + n); }
  void add(const Vec3& v) { add(v.data(), 3); }
  void add(double v) { values.push_back(v); }
};

/// /history/time, blocks, structures and /ledger, a batch of rows at a time.
class HistoryWriter {
 public:
  HistoryWriter(Hdf5File& file, const sim::RunHeader& header, std::size_t nt);
  void add(const sim::HistoryRow& row);
  void flush();

 private:
  void make(const std::string& path, const Dims& dims, const char* unit, const std::string& description);
  void make_structure(const sim::RunHeader::StructureInfo& s, std::size_t nt);
  void add_structure(const sim::HistoryRow::StructureRow& s, const sim::RunHeader::StructureInfo& info);
  Column& next() { return columns_[next_++]; }

  Hdf5File& file_;
  const sim::RunHeader& header_;
  std::size_t nb_;
  std::vector<Column> columns_;  // in the order of add()
  std::size_t next_ = 0, batch_ = 1, held_ = 0, written_ = 0;
};

/// /history/contacts/structure.
class ContactWriter {
 public:
  ContactWriter(Hdf5File& file, std::size_t n);
  void add(const sim::ContactRow& row);
  void flush();

 private:
  Hdf5File& file_;
  std::vector<Column> columns_;
  std::vector<std::int64_t> block_, structure_;
  std::size_t written_ = 0;
};

/// Frame groups; arrays equal to those of the frame before are linked, not written again.
class FieldWriter {
 public:
  /// `journal`: where the fields of structures are read from.
  FieldWriter(Hdf5File& file, const sim::RunHeader& header, std::filesystem::path journal)
      : file_(file), header_(header), journal_(std::move(journal)) {}
  void add(const FieldRow& row);
  const std::vector<XdmfFrame>& frames() const { return frames_; }

 private:
  template <class T>
  void put(const std::string& group, const std::string& name, const std::vector<T>& values, const Dims& dims,
           const char* unit, const char* description);
  void blocks(const FieldRow& f, XdmfFrame& frame);
  void structure(const StructureField& s, std::size_t i, XdmfFrame& frame);
  void column(const std::string& group, const StructureField& s, std::size_t c);

  struct Last {
    std::string path, bytes;
    Dims dims;
    std::uint64_t crc = 0;  // of fields of structures, in place of the bytes
  };
  Hdf5File& file_;
  const sim::RunHeader& header_;
  std::filesystem::path journal_;
  std::map<std::string, Last> last_;
  std::vector<XdmfFrame> frames_;
};

std::vector<double> flat(const std::vector<Vec3>& v);
template <std::size_t N>
std::vector<std::int32_t> flat(const std::vector<std::array<int, N>>& v) {
  std::vector<std::int32_t> out;
  out.reserve(N * v.size());
  for (const auto& p : v) out.insert(out.end(), p.begin(), p.end());
  return out;
}

}  // namespace talus::io
