#include "io/final_state.hpp"

#include <algorithm>

#include "coupling/touch/contact_numbers.hpp"
#include "io/files.hpp"

namespace talus::io {
namespace {

constexpr std::size_t block_numbers = 25;  // 3 c, 3 v, 3 w, 4 q, 6 strain, 6 strain rate

constexpr const char *names_path = "/state/bodies", *forms_path = "/state/forms",
                     *keys_path = "/state/contact_keys", *contacts_path = "/state/contacts";
constexpr std::size_t contact_keys = 4;    // body, partner, feature, bond
constexpr std::size_t halved_numbers = 8;  // 3 least, 3 greatest corner, cell size, energy

std::string state_key(const char* group, const std::string& name) {
  return std::string("/state/") + group + "/" + safe_name(name);
}

struct Appended {
  std::vector<double>& to;
  void operator()(double x) const { to.push_back(x); }
  void operator()(const Vec3& x) const { to.insert(to.end(), x.data(), x.data() + 3); }
};

struct Numbers {
  const double*& from;
  void operator()(double& x) const { x = *from++; }
  void operator()(Vec3& x) const { x = Vec3(from[0], from[1], from[2]), from += 3; }
};

void write_contacts(Hdf5File& file, const sim::FinalState& state) {
  std::vector<std::string> names;
  std::vector<std::int64_t> forms, keys;
  std::vector<double> numbers;
  for (const auto& b : state.bodies) names.push_back(b.name), forms.push_back(b.form);
  for (const auto& c : state.contacts) {
    keys.insert(keys.end(), {c.body, c.partner, static_cast<std::int64_t>(c.memory.feature),
                             coupling::bond_flags(c.memory)});
    coupling::each_number(c.memory, Appended{numbers});
  }
  file.write(names_path, names, "whatever may be touched");
  file.write<std::int64_t>(forms_path, forms, {forms.size()}, "", "hash of each body's undeformed form");
  file.write<std::int64_t>(keys_path, keys, {state.contacts.size(), contact_keys}, "",
                           "body, partner, feature, bond (1 torn, 2 holds)");
  file.write<double>(contacts_path, numbers, {state.contacts.size(), coupling::memory_numbers}, "",
                     "what each contact remembers, SI, for initial_state");
}

void read_contacts(const Hdf5File& file, const std::filesystem::path& results, const std::string& remedy,
                   sim::FinalState& state) {
  for (const char* path : {names_path, forms_path, keys_path, contacts_path})
    if (!file.exists(path))
      throw bad_file(results, path, "is missing: the file is of a version that kept no contacts", remedy);
  const std::vector<std::string> names = file.read_texts(names_path);
  const std::vector<std::int64_t> forms = file.read<std::int64_t>(forms_path).values;
  if (forms.size() != names.size())
    throw bad_file(results, forms_path, "has another length than the list of bodies", remedy);
  for (std::size_t i = 0; i < names.size(); ++i) state.bodies.push_back({names[i], forms[i]});
  const Array<std::int64_t> keys = file.read<std::int64_t>(keys_path);
  const Array<double> numbers = file.read<double>(contacts_path);
  if (keys.stride() != contact_keys || numbers.stride() != coupling::memory_numbers ||
      keys.rows() != numbers.rows())
    throw bad_file(results, contacts_path, "has another shape than contacts have", remedy);
  const auto count = static_cast<std::int64_t>(names.size());
  const std::int64_t* k = keys.values.data();
  const double* x = numbers.values.data();
  for (std::size_t i = 0; i < keys.rows(); ++i, k += contact_keys) {
    sim::FinalState::Contact c{k[0], k[1], {}};
    if (std::min(c.body, c.partner) < 0 || std::max(c.body, c.partner) >= count)
      throw bad_file(results, keys_path, "names a body that is not in the list", remedy);
    c.memory.feature = static_cast<std::uint64_t>(k[2]);
    coupling::set_bond(c.memory, k[3]);
    coupling::each_number(c.memory, Numbers{x});
    state.contacts.push_back(c);
  }
}

}  // namespace

void write_final_state(Hdf5File& file, const sim::FinalState& state) {
  file.group("/state/blocks");
  file.group("/state/structures");
  for (const auto& [name, b] : state.blocks) {
    std::vector<double> x;
    const auto put = [&](const auto& v) { x.insert(x.end(), v.data(), v.data() + v.size()); };
    put(b.c), put(b.v), put(b.w), put(b.q.coeffs()), put(b.eps), put(b.eps_rate);
    file.write<double>(
        state_key("blocks", name), x, {x.size()}, "",
        "centroid, velocity, spin, orientation (x, y, z, w), strain, strain rate; SI, world axes");
    file.attribute(state_key("blocks", name), "name", name);
  }
  for (const auto& [name, s] : state.structures) {
    std::vector<double> x;
    for (const Vec3& node : s.nodes) x.insert(x.end(), node.data(), node.data() + 3);
    file.group(state_key("structures", name));
    file.attribute(state_key("structures", name), "name", name);
    file.write<double>(state_key("structures", name) + "/nodes", x, {s.nodes.size(), 3}, "m",
                       "reference positions");
    file.write<double>(state_key("structures", name) + "/history", s.history, {s.history.size()}, "",
                       "state of the structure, for initial_state", Hdf5File::Packing::plain);
    if (s.halved.empty()) continue;
    x.clear();
    for (const auto& [zone, energy] : s.halved) {
      const Box3& box = zone.region;
      x.insert(x.end(), box.min().data(), box.min().data() + 3);
      x.insert(x.end(), box.max().data(), box.max().data() + 3);
      x.insert(x.end(), {zone.cell_size, energy});
    }
    file.write<double>(state_key("structures", name) + "/halved", x, {s.halved.size(), halved_numbers}, "",
                       "where cells were halved before blocks struck: corners of the zone, edge of its cells "
                       "[m], energy of the block [J]");
  }
  write_contacts(file, state);
}

sim::FinalState read_final_state(const std::filesystem::path& results) {
  const Hdf5File file = Hdf5File::open(results);
  if (!file.exists("/state/blocks") || !file.exists("/state/structures"))
    throw bad_file(results, "/state", "holds no final state: it is no results.h5 of a run that has ended",
                   "run that scene to its end (talus run SCENE -o DIR --resume goes on with one that was "
                   "stopped)");
  sim::FinalState state;
  const std::string remedy = "run that scene again";
  for (const std::string& item : file.list("/state/blocks")) {
    const std::string path = "/state/blocks/" + item;
    const std::vector<double> x = file.read<double>(path).values;
    if (x.size() != block_numbers)
      throw bad_file(results, path, "has another length than a block's state", remedy);
    std::size_t at = 0;
    const auto take = [&](auto& v) {
      for (Eigen::Index i = 0; i < v.size(); ++i) v.data()[i] = x[at++];
    };
    sim::FinalState::Block b;
    take(b.c), take(b.v), take(b.w), take(b.q.coeffs()), take(b.eps), take(b.eps_rate);
    state.blocks[file.text_attribute(path, "name")] = b;
  }
  for (const std::string& item : file.list("/state/structures")) {
    const std::string path = "/state/structures/" + item;
    sim::FinalState::Structure s;
    const Array<double> nodes = file.read<double>(path + "/nodes");
    if (nodes.stride() != 3) throw bad_file(results, path + "/nodes", "must have three columns", remedy);
    for (std::size_t i = 0; i < nodes.rows(); ++i)
      s.nodes.emplace_back(nodes.values[3 * i], nodes.values[3 * i + 1], nodes.values[3 * i + 2]);
    s.history = file.read<double>(path + "/history").values;
    if (file.exists(path + "/halved")) {
      const Array<double> halved = file.read<double>(path + "/halved");
      if (halved.stride() != halved_numbers)
        throw bad_file(results, path + "/halved", "has another shape than zones have", remedy);
      for (std::size_t i = 0; i < halved.rows(); ++i) {
        const double* x = &halved.values[halved_numbers * i];
        s.halved.push_back({{Box3(Vec3(x), Vec3(x + 3)), x[6]}, x[7]});
      }
    }
    state.structures[file.text_attribute(path, "name")] = std::move(s);
  }
  read_contacts(file, results, remedy, state);
  return state;
}

}  // namespace talus::io
