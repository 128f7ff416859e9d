#include "io/final_state.hpp"

#include "io/files.hpp"

namespace talus::io {
namespace {

constexpr std::size_t block_numbers = 25;   // 3 c, 3 v, 3 w, 4 q, 6 strain, 6 strain rate

std::string key(const char* group, const std::string& name) { return std::string("/state/") + group + "/" + safe_name(name); }

}  // namespace

void write_final_state(Hdf5File& file, const sim::FinalState& state) {
  file.group("/state/blocks");
  file.group("/state/structures");
  for (const auto& [name, b] : state.blocks) {
    std::vector<double> x;
    const auto put = [&](const auto& v) { x.insert(x.end(), v.data(), v.data() + v.size()); };
    put(b.c), put(b.v), put(b.w), put(b.q.coeffs()), put(b.eps), put(b.eps_rate);
    file.write<double>(key("blocks", name), x, {x.size()}, "", "centroid, velocity, spin, orientation (x, y, z, w), strain, strain rate; SI, world axes");
    file.attribute(key("blocks", name), "name", name);
  }
  for (const auto& [name, s] : state.structures) {
    std::vector<double> x;
    for (const Vec3& node : s.nodes) x.insert(x.end(), node.data(), node.data() + 3);
    file.group(key("structures", name));
    file.attribute(key("structures", name), "name", name);
    file.write<double>(key("structures", name) + "/nodes", x, {s.nodes.size(), 3}, "m", "reference positions");
    file.write<double>(key("structures", name) + "/history", s.history, {s.history.size()}, "", "state of the structure, for initial_state");
  }
}

sim::FinalState read_final_state(const std::filesystem::path& results) {
  const Hdf5File file = Hdf5File::open(results);
  if (!file.exists("/state/blocks") || !file.exists("/state/structures"))
    throw bad_file(results, "simulation.initial_state", "holds no final state: it is no results.h5 of a run that has ended", "name the results.h5 of a run that went to its end");
  sim::FinalState state;
  const std::string remedy = "run that scene again";
  for (const std::string& item : file.list("/state/blocks")) {
    const std::string path = "/state/blocks/" + item;
    const std::vector<double> x = file.read<double>(path).values;
    if (x.size() != block_numbers) throw bad_file(results, path, "has another length than a block's state", remedy);
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
    for (std::size_t i = 0; i < nodes.rows(); ++i) s.nodes.emplace_back(nodes.values[3 * i], nodes.values[3 * i + 1], nodes.values[3 * i + 2]);
    s.history = file.read<double>(path + "/history").values;
    state.structures[file.text_attribute(path, "name")] = std::move(s);
  }
  return state;
}

}  // namespace talus::io
