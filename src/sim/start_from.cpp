// The end of one run as the start of another.
#include <algorithm>

#include <fmt/format.h>

#include "core/error.hpp"
#include "sim/carried_contacts.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::sim {
namespace {

/// How the mesh of a structure differs from that of the earlier run.
std::string other_mesh(const std::string& name, const std::vector<Vec3>& there,
                       const std::vector<Vec3>& here) {
  if (there.size() != here.size())
    return fmt::format("structure {} has another mesh there ({} nodes, here {})", name, there.size(),
                       here.size());
  double farthest = 0;
  for (std::size_t n = 0; n < here.size(); ++n) farthest = std::max(farthest, (there[n] - here[n]).norm());
  return fmt::format("structure {} has its nodes elsewhere there, by up to {:.3g} m", name, farthest);
}

/// The first interface, joint or rock bridge that can be bonded; empty: none.
std::string first_bond(const scene::Scene& s) {
  for (const auto& [a, b] : s.law_pairs)
    if (const ContactLaw& law = s.laws(a, b); law.cohesion > 0 || law.tension > 0)
      return fmt::format("the interface of {} and {}", s.materials[static_cast<std::size_t>(a)].name,
                         s.materials[static_cast<std::size_t>(b)].name);
  return {};
}

/// What of the state's blocks and contacts goes on, for the log.
std::vector<std::string> contact_lines(const World& w, const FinalState& state, const std::string& file) {
  std::vector<std::string> lines;
  const dda::Model& model = w.system->model();
  const auto here = [&](const std::string& name) {
    return std::any_of(model.blocks.begin(), model.blocks.end(),
                       [&](const dda::Model::Block& b) { return b.name == name; });
  };
  std::string first;
  long gone = 0;
  for (const auto& [name, block] : state.blocks)
    if (!here(name) && gone++ == 0) first = name;
  if (gone > 0)
    lines.push_back(fmt::format("Blocks: {} of {} are not of this scene and are left out, {} among them.",
                                gone, file, first));
  long all = 0, bonded = 0, torn = 0;
  for (const auto& list : w.system->state().contacts)
    for (const coupling::ContactMemory& m : list) ++all, bonded += m.glued, torn += m.broken;
  if (all > 0 && !first_bond(w.scene).empty())
    lines.push_back(
        fmt::format("Contacts: {} bonded, {} torn at the start; what met in {} without a bond has none.",
                    bonded, torn, file));
  return lines;
}

}  // namespace

FinalState Simulation::final_state() const {
  FinalState state;
  const coupling::CoupledSystem& system = *world_->system;
  const dda::State& s = system.state().blocks;
  for (std::size_t i = 0; i < system.model().blocks.size(); ++i)
    state.blocks[system.model().blocks[i].name] = {s.c[i], s.v[i], s.w[i], s.q[i], s.eps[i], s.eps_rate[i]};
  const auto& parts = system.environment().structures;
  for (std::size_t q = 0; q < parts.size(); ++q) {
    if (!parts[q].stepped()) continue;  // it has no history
    FinalState::Structure& out = state.structures[world_->scene.structures[q].name];
    out.nodes = parts[q].structure->built_nodes();
    parts[q].structure->save(out.history);
    for (const World::StruckPlace& place : world_->struck)
      if (place.structure == static_cast<int>(q)) out.halved.push_back({place.zone, place.energy});
  }
  keep_contacts(*world_, state);
  return state;
}

void Simulation::halve_cells_struck(const FinalState& state) {
  World& w = *world_;
  const auto& parts = w.system->environment().structures;
  for (std::size_t q = 0; q < parts.size(); ++q) {
    const auto found = state.structures.find(w.scene.structures[q].name);
    if (found == state.structures.end() || !parts[q].stepped()) continue;
    for (const auto& [zone, energy] : found->second.halved)
      w.struck.push_back({static_cast<int>(q), zone, energy});
    w.refine_structure(static_cast<int>(q));
  }
}

std::vector<std::string> Simulation::start_from(const FinalState& state, const std::string& file) {
  World& w = *world_;
  std::vector<std::string> lines;
  std::vector<Problem> problems;
  const auto problem = [&](std::string rule, std::string remedy) {
    Problem p;
    p.file = w.scene.file;
    p.key = "simulation.initial_state";
    p.value = file;
    p.rule = std::move(rule);
    p.remedy = std::move(remedy);
    problems.push_back(std::move(p));
  };
  dda::State& s = w.system->state().blocks;
  for (std::size_t i = 0; i < w.system->model().blocks.size(); ++i) {
    const std::string& name = w.system->model().blocks[i].name;
    const auto found = state.blocks.find(name);
    if (found == state.blocks.end()) continue;
    const FinalState::Block& b = found->second;
    s.c[i] = b.c, s.v[i] = b.v, s.w[i] = b.w, s.q[i] = b.q, s.eps[i] = b.eps, s.eps_rate[i] = b.eps_rate;
    lines.push_back(fmt::format("Block {}: starts from the last state in {}.", name, file));
  }
  halve_cells_struck(state);
  auto& parts = w.system->environment().structures;
  for (std::size_t q = 0; q < parts.size(); ++q) {
    const std::string& name = w.scene.structures[q].name;
    const auto found = state.structures.find(name);
    if (found == state.structures.end() || !parts[q].stepped()) continue;
    Structure& structure = *parts[q].structure;
    const std::vector<Vec3> nodes = structure.built_nodes();
    if (nodes != found->second.nodes) {
      problem(other_mesh(name, found->second.nodes, nodes),
              found->second.halved.empty()
                  ? "give the structure the place, geometry and cell size it had in that run"
                  : "give the structure the place, geometry, cell size and refine (where = \"impact\", by "
                    "which its cells were halved) it had in that run");
      continue;
    }
    try {
      structure.restore(found->second.history);
    } catch (const NumericalFailure&) {
      problem(fmt::format("the state of structure {} has another form than here", name),
              "give it the damage law, bars and loads it had in that run");
      continue;
    }
    structure.start_over();
    w.header.structures[q].permanent = structure.loads().permanent_reaction();
    if (!parts[q].fixed_surface) {
      parts[q].index = std::make_unique<contact::SurfaceIndex>(structure.skin().surface());
      w.displaced[q].clear();
      structure.values([&](const Structure::Snapshot& part) {
        for (const Vec3& u : part.displacement) w.displaced[q].push_back(u.norm());
      });
    }
    lines.push_back(fmt::format("Structure {}: starts from the last state in {}, largest damage {:.4g}.",
                                name, file, structure.damage().largest));
  }
  if (problems.empty() && lines.empty())
    problem("it holds no block and no structure of this scene",
            "give blocks or structures the names they had in that run");
  if (w.paper || state.bodies.empty())
    if (const auto bond = first_bond(w.scene); !bond.empty())
      problem(fmt::format("method dda-1988 hands no bonds on to a later run, nor takes them from an earlier "
                          "one, and {} has cohesion or tension",
                          bond),
              "use method talus in both runs");
  if (problems.empty()) {
    const coupling::KnownPairs known = restore_contacts(w, state);
    problems = initial_overlaps(w, known);
    w.system->glue(known);
  }
  if (!problems.empty()) throw InputError(problems);
  for (std::string& line : contact_lines(w, state, file)) lines.push_back(std::move(line));
  w.notes.insert(w.notes.end(), lines.begin(), lines.end());
  return lines;
}

}  // namespace talus::sim
