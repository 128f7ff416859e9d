#include "io/hdf5_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/error.hpp"
#include "io/files.hpp"

namespace talus::io {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

/// Closes an identifier of whatever kind when it goes out of scope.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }  // NOLINT: stands for the identifier

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// No messages of the library's own, and no tidying up at the end of the program: after a write that failed
/// on a full disk it would write again there, and crash.
void prepare_library() {
  static const herr_t once = H5dont_atexit();
  (void)once;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

template <class T>
hid_t native();
template <>
hid_t native<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t native<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
hid_t native<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t native<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t native<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}

[[noreturn]] void write_failed(const std::filesystem::path& file, const std::string& path) {
  throw WriteError(fmt::format("cannot write {} in {}: disk full or file system error", path, file.string()));
}
[[noreturn]] void read_failed(const std::filesystem::path& file, const std::string& path,
                              const std::string& rule) {
  throw bad_file(file, path, rule, "use results that Talus wrote");
}

std::vector<hsize_t> extent(const Dims& dims) { return {dims.begin(), dims.end()}; }

Id text_type() {
  const hid_t t = H5Tcopy(H5T_C_S1);
  H5Tset_size(t, H5T_VARIABLE);
  H5Tset_cset(t, H5T_CSET_UTF8);
  return {t, H5Tclose};
}

/// Creation properties: groups on the way.
Id link_properties() {
  const hid_t p = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(p, 1);
  H5Pset_char_encoding(p, H5T_CSET_UTF8);
  return {p, H5Pclose};
}

/// Arrays above this are stored in chunks, if deflated then shuffled: sleeping blocks then cost next to
/// nothing.
constexpr std::size_t chunk_bytes = 1 << 18;

Id dataset_properties(const Dims& dims, std::size_t item,
                      Hdf5File::Packing packing = Hdf5File::Packing::deflated) {
  const hid_t p = H5Pcreate(H5P_DATASET_CREATE);
  // Creation times are kept out, so that two equal runs write equal bytes.
  H5Pset_obj_track_times(p, 0);
  std::size_t row = item;
  for (std::size_t k = 1; k < dims.size(); ++k) row *= dims[k];
  if (!dims.empty() && dims[0] > 1 && row > 0 && dims[0] * row > chunk_bytes) {
    std::vector<hsize_t> chunk = extent(dims);
    chunk[0] = std::clamp<std::size_t>(chunk_bytes / row, 1, dims[0]);
    H5Pset_chunk(p, static_cast<int>(chunk.size()), chunk.data());
    if (packing == Hdf5File::Packing::deflated) H5Pset_shuffle(p), H5Pset_deflate(p, 1);
  }
  return {p, H5Pclose};
}

Id create_dataset(hid_t file, const std::string& path, hid_t type, const Dims& dims, hid_t properties) {
  const std::vector<hsize_t> e = extent(dims);
  const Id space(H5Screate_simple(static_cast<int>(e.size()), e.data(), nullptr), H5Sclose);
  const Id links = link_properties();
  return {H5Dcreate2(file, path.c_str(), type, space, links, properties, H5P_DEFAULT), H5Dclose};
}

Id open_object(hid_t file, const std::string& path) {
  return {H5Oopen(file, path.c_str(), H5P_DEFAULT), H5Oclose};
}

bool text_attribute_on(hid_t object, const std::string& name, const std::string& text) {
  const Id type = text_type();
  const Id space(H5Screate(H5S_SCALAR), H5Sclose);
  const Id attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* p = text.c_str();
  return attribute >= 0 && H5Awrite(attribute, type, &p) >= 0;
}

void describe(hid_t dataset, const std::string& unit, const std::string& description) {
  if (!unit.empty()) text_attribute_on(dataset, "unit", unit);
  if (!description.empty()) text_attribute_on(dataset, "description", description);
}

/// False if they cannot be written, or there is no room for them.
template <class T>
bool write_hyperslab(hid_t dataset, std::size_t first, std::size_t rows, const T* values) {
  const Id space(dataset < 0 ? -1 : H5Dget_space(dataset), H5Sclose);
  if (space < 0) return false;
  std::vector<hsize_t> count(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, count.data(), nullptr);
  std::vector<hsize_t> start(count.size(), 0);
  if (count.empty() || first + rows > count[0]) return false;
  start[0] = first;
  count[0] = rows;
  for (const hsize_t c : count)
    if (c == 0) return true;
  const Id memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
  return H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >= 0 &&
         H5Dwrite(dataset, native<T>(), memory, space, H5P_DEFAULT, values) >= 0;
}

}  // namespace

Hdf5File::Hdf5File(std::filesystem::path path, std::int64_t id, bool writing)
    : path_(std::move(path)), id_(id), writing_(writing) {}
Hdf5File::Hdf5File(Hdf5File&& other) noexcept
    : path_(std::move(other.path_)), id_(std::exchange(other.id_, -1)), writing_(other.writing_) {}
Hdf5File::~Hdf5File() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5File::close() {
  if (id_ < 0) return;
  const hid_t id = std::exchange(id_, -1);
  const bool stored = !writing_ || H5Fflush(id, H5F_SCOPE_LOCAL) >= 0;
  if (H5Fclose(id) < 0 || !stored)
    throw WriteError(fmt::format("cannot store {}: disk full or file system error", path_.string()));
}

Hdf5File Hdf5File::create(const std::filesystem::path& path, std::size_t user_block) {
  prepare_library();
  const Id creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  if (user_block > 0) H5Pset_userblock(creation, user_block);
  const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT);
  if (id < 0) throw WriteError(system_error("create", path));
  return {path, id, true};
}

Hdf5File Hdf5File::open(const std::filesystem::path& path) {
  prepare_library();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw bad_file(path, {}, "does not exist", "check the path");
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) throw bad_file(path, {}, "is no HDF5 file, or is damaged", "write it again");
  return {path, id, false};
}

template <class T>
void Hdf5File::write_parts(const std::string& path, const Dims& dims,
                           const std::function<void(const std::function<void(std::span<const T>)>&)>& parts,
                           const std::string& unit, const std::string& description, Packing packing) {
  const Id properties = dataset_properties(dims, sizeof(T), packing);
  const Id dataset = create_dataset(id_, path, native<T>(), dims, properties);
  if (dataset < 0) write_failed(path_, path);
  std::size_t stride = 1, first = 0;
  for (std::size_t k = 1; k < dims.size(); ++k) stride *= dims[k];
  // With the dataset open: chunks are deflated once they are full.
  parts([&, dataset = static_cast<hid_t>(dataset)](std::span<const T> values) {
    const std::size_t rows = stride > 0 ? values.size() / stride : 0;
    if (rows * stride != values.size() || !write_hyperslab(dataset, first, rows, values.data()))
      write_failed(path_, path);
    first += rows;
  });
  if (stride > 0 && first != dims[0]) write_failed(path_, path);
  describe(dataset, unit, description);
}

template <class T>
void Hdf5File::write(const std::string& path, std::span<const T> values, const Dims& dims,
                     const std::string& unit, const std::string& description, Packing packing) {
  write_parts<T>(
      path, dims, [&](const auto& take) { take(values); }, unit, description, packing);
}
#define TALUS_WRITES(T)                                                                                     \
  template void Hdf5File::write<T>(const std::string&, std::span<const T>, const Dims&, const std::string&, \
                                   const std::string&, Packing);                                            \
  template void Hdf5File::write_parts<T>(                                                                   \
      const std::string&, const Dims&,                                                                      \
      const std::function<void(const std::function<void(std::span<const T>)>&)>&, const std::string&,       \
      const std::string&, Packing);
TALUS_WRITES(double)
TALUS_WRITES(float)
TALUS_WRITES(std::int64_t)
TALUS_WRITES(std::int32_t)
TALUS_WRITES(std::uint8_t)
#undef TALUS_WRITES

void Hdf5File::write(const std::string& path, const std::vector<std::string>& texts,
                     const std::string& description) {
  const Id type = text_type();
  const Id properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties, 0);
  const Id dataset = create_dataset(id_, path, type, {texts.size()}, properties);
  if (dataset < 0) write_failed(path_, path);
  std::vector<const char*> p;
  for (const std::string& t : texts) p.push_back(t.c_str());
  if (!p.empty() && H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, p.data()) < 0)
    write_failed(path_, path);
  describe(dataset, {}, description);
}

void Hdf5File::attribute(const std::string& path, const std::string& name, const std::string& text) {
  const Id object = open_object(id_, path);
  if (object < 0 || !text_attribute_on(object, name, text)) write_failed(path_, path);
}

namespace {
template <class T>
bool number_attribute_on(hid_t file, const std::string& path, const std::string& name, T value) {
  const Id object = open_object(file, path);
  const Id space(H5Screate(H5S_SCALAR), H5Sclose);
  const Id attribute(
      object < 0 ? -1 : H5Acreate2(object, name.c_str(), native<T>(), space, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  return attribute >= 0 && H5Awrite(attribute, native<T>(), &value) >= 0;
}
}  // namespace

void Hdf5File::attribute(const std::string& path, const std::string& name, double value) {
  if (!number_attribute_on(id_, path, name, value)) write_failed(path_, path);
}
void Hdf5File::attribute(const std::string& path, const std::string& name, std::int64_t value) {
  if (!number_attribute_on(id_, path, name, value)) write_failed(path_, path);
}

void Hdf5File::group(const std::string& path) {
  if (exists(path)) return;
  const Id links = link_properties();
  const Id creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  const Id group(H5Gcreate2(id_, path.c_str(), links, creation, H5P_DEFAULT), H5Gclose);
  if (group < 0) write_failed(path_, path);
}

void Hdf5File::hard_link(const std::string& existing, const std::string& alias) {
  const Id links = link_properties();
  if (H5Lcreate_hard(id_, existing.c_str(), id_, alias.c_str(), links, H5P_DEFAULT) < 0)
    write_failed(path_, alias);
}

void Hdf5File::create_rows(const std::string& path, const Dims& dims, const std::string& unit,
                           const std::string& description, Packing packing) {
  const Id properties = dataset_properties(dims, sizeof(double), packing);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  H5Pset_fill_value(properties, H5T_NATIVE_DOUBLE, &nan);
  const Id dataset = create_dataset(id_, path, H5T_NATIVE_DOUBLE, dims, properties);
  if (dataset < 0) write_failed(path_, path);
  describe(dataset, unit, description);
}

void Hdf5File::create_rows_int(const std::string& path, const Dims& dims, const std::string& description) {
  const Id properties = dataset_properties(dims, sizeof(std::int64_t));
  const Id dataset = create_dataset(id_, path, H5T_NATIVE_INT64, dims, properties);
  if (dataset < 0) write_failed(path_, path);
  describe(dataset, "1", description);
}

template <class T>
void Hdf5File::write_rows(const std::string& path, std::size_t first, std::size_t rows, const T* values) {
  if (rows == 0) return;
  const Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!write_hyperslab(dataset, first, rows, values)) write_failed(path_, path);
}
template void Hdf5File::write_rows(const std::string&, std::size_t, std::size_t, const double*);
template void Hdf5File::write_rows(const std::string&, std::size_t, std::size_t, const std::int64_t*);

bool Hdf5File::exists(const std::string& path) const {
  if (path.empty() || path == "/") return true;
  // H5Lexists asks for one component at a time.
  for (std::size_t at = path.find('/', 1);; at = path.find('/', at + 1)) {
    const std::string part = path.substr(0, at);
    if (H5Lexists(id_, part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (at == std::string::npos) return true;
  }
}

bool Hdf5File::is_group(const std::string& path) const {
  if (!exists(path)) return false;
  const Id object = open_object(id_, path.empty() ? "/" : path);
  return object >= 0 && H5Iget_type(object) == H5I_GROUP;
}

namespace {
H5T_class_t type_class(hid_t file, const std::string& path) {
  const Id dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (dataset < 0) return H5T_NO_CLASS;
  const Id type(H5Dget_type(dataset), H5Tclose);
  return H5Tget_class(type);
}
}  // namespace

bool Hdf5File::is_text(const std::string& path) const { return type_class(id_, path) == H5T_STRING; }
bool Hdf5File::is_integer(const std::string& path) const { return type_class(id_, path) == H5T_INTEGER; }

std::vector<std::string> Hdf5File::list(const std::string& path) const {
  std::vector<std::string> names;
  const Id group(H5Gopen2(id_, path.empty() ? "/" : path.c_str(), H5P_DEFAULT), H5Gclose);
  if (group < 0) read_failed(path_, path, "is no group of this file");
  const auto visit = [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, visit, &names);
  return names;
}

Dims Hdf5File::dims(const std::string& path) const {
  const Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (dataset < 0) read_failed(path_, path, "is no dataset of this file");
  const Id space(H5Dget_space(dataset), H5Sclose);
  std::vector<hsize_t> e(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space), 0)));
  H5Sget_simple_extent_dims(space, e.data(), nullptr);
  return {e.begin(), e.end()};
}

template <class T>
Array<T> Hdf5File::read_rows(const std::string& path, std::size_t first, std::size_t rows) const {
  Array<T> array;
  array.dims = dims(path);
  if (array.dims.empty() || first + rows > array.dims[0])
    read_failed(path_, path, "has fewer rows than asked for");
  array.dims[0] = rows;
  const std::size_t n = rows * array.stride();
  // A damaged header may claim any extent: what cannot be stored in the file is not allocated.
  if (n > (std::size_t{1} << 33)) read_failed(path_, path, "claims an impossible size");
  array.values.resize(n);
  if (n == 0) return array;
  const Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Id space(H5Dget_space(dataset), H5Sclose);
  const std::vector<hsize_t> count = extent(array.dims);
  std::vector<hsize_t> start(count.size(), 0);
  start[0] = first;
  const Id memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(dataset, native<T>(), memory, space, H5P_DEFAULT, array.values.data()) < 0)
    read_failed(path_, path, "cannot be read: another type, or damaged");
  return array;
}
template <class T>
Array<T> Hdf5File::read(const std::string& path) const {
  const Dims d = dims(path);
  return read_rows<T>(path, 0, d.empty() ? 0 : d[0]);
}
template Array<double> Hdf5File::read_rows(const std::string&, std::size_t, std::size_t) const;
template Array<float> Hdf5File::read_rows(const std::string&, std::size_t, std::size_t) const;
template Array<std::int64_t> Hdf5File::read_rows(const std::string&, std::size_t, std::size_t) const;
template Array<std::int32_t> Hdf5File::read_rows(const std::string&, std::size_t, std::size_t) const;
template Array<double> Hdf5File::read(const std::string&) const;
template Array<float> Hdf5File::read(const std::string&) const;
template Array<std::int64_t> Hdf5File::read(const std::string&) const;
template Array<std::int32_t> Hdf5File::read(const std::string&) const;

std::vector<std::string> Hdf5File::read_texts(const std::string& path) const {
  const Dims d = dims(path);
  std::vector<std::string> texts;
  const Id dataset(H5Dopen2(id_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Id stored(H5Dget_type(dataset), H5Tclose);
  if (d.size() != 1 || H5Tget_class(stored) != H5T_STRING || H5Tis_variable_str(stored) <= 0)
    read_failed(path_, path, "is no list of texts");
  const Id type = text_type();
  std::vector<char*> p(d[0], nullptr);
  if (!p.empty() && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, p.data()) < 0)
    read_failed(path_, path, "cannot be read");
  for (const char* t : p) texts.emplace_back(t != nullptr ? t : "");
  const Id space(H5Dget_space(dataset), H5Sclose);
  if (!p.empty()) H5Dvlen_reclaim(type, space, H5P_DEFAULT, p.data());
  return texts;
}

std::string Hdf5File::text_attribute(const std::string& path, const std::string& name) const {
  if (H5Aexists_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT) <= 0) return {};
  const Id attribute(H5Aopen_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const Id type = text_type();
  char* p = nullptr;
  if (H5Aread(attribute, type, &p) < 0 || p == nullptr) return {};
  std::string text(p);
  H5free_memory(p);
  return text;
}

}  // namespace talus::io
