// Erosion and fragments: what leaves the structure.
#include "fem/fracture/fracture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/sort_unique.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/fracture/piece_shape.hpp"

namespace talus::fem {

namespace {
// A cracked cell carries pressure along its cracks and across them once they close, and its bars hold:
// however wide it stands open, it goes only when it is crushed, too, or when what it parts comes off
// (pieces.cpp).
constexpr double open_gap = 5e-3;  // of what is cracked and crushed [m]
// No solid to touch or to compute with, also where nothing is to erode:
constexpr double torn_strain = 1;       // of a cell 1.7 times as long as it was
constexpr double flat_volume = 0.1;     // of what it was: next to inside out
constexpr std::size_t least_piece = 2;  // cells; a single one is rubble
constexpr double least_volume = 1e-3;   // [m^3], and so is what a hand can hold
constexpr double least_share = 0.01;    // unless the structure is small itself: this share of its volume
constexpr double bent =
    0.1;  // of a cell's edge: by so much less a piece may be deformed and is still given its planar faces
}  // namespace

double Fracture::cell_energy(int cell) const {
  return body_.damage && body_.damage->has(cell) ? body_.damage->result(cell).energy
                                                 : body_.elements->energy(cell);
}

double Fracture::link_energy(const std::vector<int>& cells) const {
  const std::vector<int> here = body_.partition ? body_.partition->cells_here(cells) : cells;
  double energy = body_.bars ? body_.bars->stored_in(here) : 0.0;
  if (body_.bearings && body_.first_rank()) energy += body_.bearings->stored_at(here, body_.live);
  body_.sum({&energy, 1});
  return energy;
}

void Fracture::switch_off(const std::vector<int>& cells) {
  energy_.power_valid = false;
  ++body_.revision;
  for (const int whole : cells) {
    const int cell = body_.cell_here(whole);
    if (cell < 0) continue;
    body_.live[cell] = 0;
    body_.elements->set_on(cell, false);
    if (body_.damage) body_.damage->remove(cell);
    for (int n : carriers(body_.mesh, cell)) --body_.cells_at_node[n];
  }
  if (body_.partition) body_.partition->exchange_numbers(body_.cells_at_node);
}

/// Removes cells: their stored energy is accounted for, that of their bars and bearings too, and the mass of
/// their nodes stays where other cells hold it. A node without cells would fly on for ever: its mass is dust,
/// and leaves with its motion. A free body keeps it, and with it its mass and momenta to the last digit.
void Fracture::drop_orphans(const std::vector<int>& cells) {
  const std::vector<double> values = body_.of_cells(
      cells, 2, [this](int cell, double* to) { to[0] = cell_energy(cell), to[1] = body_.cell_mass[cell]; });
  const double links = link_energy(cells);
  energy_.works.eroded_energy += links;
  energy_.stored_half -= links;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    energy_.works.eroded_energy += values[2 * k];
    energy_.stored_half -= values[2 * k];
    body_.lost.eroded_volume += values[2 * k + 1] / body_.spec.density;
  }
  switch_off(cells);
  if (body_.supports.none) return;
  // Node by node in the order of the cells, each told of by its owner: mass, place, velocity.
  constexpr std::size_t width = 7;
  std::vector<double> dust;
  for (const int whole : cells) {
    const int cell = body_.cell_here(whole);
    const std::vector<int> nodes = cell >= 0 ? carriers(body_.mesh, cell) : std::vector<int>(8, -1);
    for (const int n : nodes) {
      dust.resize(dust.size() + width, 0.0);
      if (n < 0 || body_.cells_at_node[n] > 0 || body_.mass[n] == 0) continue;
      if (body_.own_node(n)) {
        double* const to = dust.data() + dust.size() - width;
        to[0] = body_.mass[n];
        Eigen::Map<Vec3>(to + 1) = fields_.position(n);
        Eigen::Map<Vec3>(to + 4) = fields_.velocity(n);
      }
      remove_node(n);
    }
  }
  body_.sum(dust);
  for (std::size_t at = 0; at < dust.size(); at += width) {
    const double mass = dust[at];
    if (mass == 0) continue;
    const Vec3 x(&dust[at + 1]), v(&dust[at + 4]);
    energy_.works.eroded_energy += 0.5 * mass * v.squaredNorm();
    body_.lost.dust_potential -=
        mass *
        body_.gravity.dot(x - 0.5 * fields_.h_last * v);  // where it came off: its fall is not followed
    body_.lost.dust_mass += mass;
    body_.lost.dust_momentum += mass * v;
    body_.lost.dust_spin += mass * x.cross(v);
  }
}

void Fracture::remove_node(int n) {
  body_.mass[n] = 0;
  forces_.masses_changed();
  for (int c = 0; c < 3; ++c)
    body_.inverse_mass[4 * n + c] = 0, fields_.v[4 * n + c] = fields_.v_hat[4 * n + c] = 0;
}

std::vector<int> spent_cells(const StructureBody& body) {
  const std::vector<char> none;
  return body.damage->spent(
      {flat_volume, torn_strain, body.spec.erosion ? open_gap : std::numeric_limits<double>::infinity()},
      body.bars ? body.bars->ties().tied(body.live.size()) : none);
}

void Fracture::erode(const std::vector<int>& cells) {
  if (!body_.spec.erosion && body_.lost.eroded_volume == 0)
    body_.report(
        fmt::format("structure {}: cells torn to 1.7 times their length or crushed flat are removed, "
                    "although erosion is off",
                    body_.spec.name));
  drop_orphans(cells);
  ++body_.lost.breaks;
  skin_.rebuild();
  forces_.pass_over_the_gone();
}

/// Rubble that still shares nodes with others stays in the mesh: its cells carry pressure and no tension.
bool Fracture::is_rubble(const std::vector<int>& piece) const {
  const double least = std::min(least_volume, least_share * body_.mass_of_cells / body_.spec.density);
  double volume = 0;
  for (const double mass :
       body_.of_cells(piece, 1, [this](int cell, double*to) { *to = body_.cell_mass[cell]; }))
    volume += mass / body_.spec.density;
  return piece.size() < least_piece || volume < least;
}

Structure::Unsupported Fracture::unsupported() {
  Structure::Unsupported lost;
  if (!body_.damage && !body_.bearings) return lost;
  const long cuts = pieces_.count_cuts();
  if (cuts == body_.lost.cuts_seen) return lost;
  body_.lost.cuts_seen = cuts;
  for (const std::vector<int>& piece : pieces_.loose()) {
    if (is_rubble(piece)) continue;
    const std::vector<double> values = body_.of_cells(piece, 4, [this](int cell, double* to) {
      to[0] = body_.cell_mass[cell];
      Eigen::Map<Vec3>(to + 1) = body_.cell_mass[cell] * cell_centre(body_.mesh, cell);
    });
    for (std::size_t at = 0; at < values.size(); at += 4)
      lost.mass += values[at], lost.centroid += Vec3(&values[at + 1]);
  }
  if (lost.mass > 0) lost.centroid /= lost.mass;
  lost.share = lost.mass / body_.mass_of_cells;
  return lost;
}

/// Cells of the whole mesh, with what a piece needs of them and of their nodes, from the ranks that own them.
Fracture::Excerpt Fracture::excerpt(const std::vector<int>& cells) const {
  Excerpt e;
  const auto node = [&](int n) { return body_.whole_node(n); };
  const std::vector<double> of_cell = body_.of_cells(cells, 9, [&](int cell, double* to) {
    for (const int n : body_.mesh.hexes[cell]) *to++ = node(n);
    *to = body_.cell_mass[cell];
  });
  for (std::size_t at = 0; at < of_cell.size(); at += 9)
    for (std::size_t a = 0; a < 8; ++a) e.node.push_back(static_cast<int>(of_cell[at + a]));
  std::vector<int> corners = e.node;
  sort_unique(e.node);
  for (std::size_t at = 0, k = 0; at < of_cell.size(); at += 9) {
    std::array<int, 8>& hex = e.mesh.hexes.emplace_back();
    for (int& n : hex) n = e.place(corners[k++]);
    e.cell_mass.push_back(of_cell[at + 8]);
  }
  constexpr std::size_t width = 14;
  std::vector<double> of_node(width * e.node.size(), 0.0);
  for (std::size_t k = 0; k < e.node.size(); ++k) {
    const int n = body_.node_here(e.node[k]);
    if (n < 0 || !body_.own_node(n)) continue;
    double* const to = &of_node[width * k];
    const Vec3 places[4] = {body_.mesh.nodes[n], body_.mesh.local[n], fields_.position(n),
                            fields_.velocity(n)};
    for (int i = 0; i < 4; ++i) std::copy_n(places[i].data(), 3, to + 3 * i);
    to[12] = body_.mass[n], to[13] = body_.cells_at_node[n];
  }
  body_.sum(of_node);
  for (std::size_t at = 0; at < of_node.size(); at += width) {
    e.mesh.nodes.emplace_back(&of_node[at]), e.mesh.local.emplace_back(&of_node[at + 3]);
    e.position.emplace_back(&of_node[at + 6]), e.velocity.emplace_back(&of_node[at + 9]);
    e.mass.push_back(of_node[at + 12]);
    e.cells_at_node.push_back(static_cast<int>(of_node[at + 13]));
  }
  std::map<std::array<int, 4>, std::pair<std::size_t, std::size_t>> open;  // faces that have one cell yet
  e.mesh.across.assign(e.mesh.hexes.size(), {-1, -1, -1, -1, -1, -1});
  for (std::size_t cell = 0; cell < e.mesh.hexes.size(); ++cell)
    for (std::size_t face = 0; face < 6; ++face) {
      std::array<int, 4> nodes;
      for (std::size_t i = 0; i < 4; ++i)
        nodes[i] = e.mesh.hexes[cell][static_cast<std::size_t>(hex_faces[face][i])];
      std::sort(nodes.begin(), nodes.end());
      const auto [mate, alone] = open.emplace(nodes, std::pair(cell, face));
      if (alone) continue;
      e.mesh.across[cell][face] = static_cast<int>(mate->second.first);
      e.mesh.across[mate->second.first][mate->second.second] = static_cast<int>(cell);
      open.erase(mate);
    }
  return e;
}

int Fracture::Excerpt::place(int whole) const {
  const auto at = std::lower_bound(node.begin(), node.end(), whole);
  return at == node.end() || *at != whole ? -1 : static_cast<int>(at - node.begin());
}

std::vector<Fragment> Fracture::take_fragments() {
  if (!body_.damage && !body_.bearings) return {};
  const long cuts = pieces_.count_cuts();
  if (cuts == body_.lost.cuts_seen) return {};
  body_.lost.cuts_seen = cuts;
  std::vector<std::vector<int>> pieces = pieces_.loose();
  const auto hangs = [&](const std::vector<int>& piece) {
    std::map<int, int> inside;  // cells of the piece
    const auto hanging = [&](const auto& cells_at) {
      return std::any_of(inside.begin(), inside.end(), [&](const auto& at) {
        return at.second < cells_at[static_cast<std::size_t>(at.first)];
      });
    };
    if (!body_.partition) {
      for (int cell : piece)
        for (int n : carriers(body_.mesh, cell)) ++inside[n];
      return hanging(body_.cells_at_node);
    }
    const Excerpt e = excerpt(piece);
    for (const auto& hex : e.mesh.hexes)
      for (int n : hex) ++inside[n];
    return hanging(e.cells_at_node);
  };
  std::erase_if(pieces, [&](const std::vector<int>& piece) { return is_rubble(piece) && hangs(piece); });
  if (pieces.empty()) return {};

  forces_.evaluate(fields_.time);  // energies of the cells
  drop_orphans(pieces_.parted_beside(pieces));
  const std::vector<SeatedNode> seats = seated_nodes();  // a cap beam may come off before its deck
  std::vector<Fragment> fragments;
  for (const std::vector<int>& piece : pieces) {
    if (is_rubble(piece))
      drop_orphans(piece);
    else
      fragments.push_back(detach(piece, seats));
  }
  ++body_.lost.breaks;
  body_.lost.cuts_seen = pieces_.count_cuts();  // the parts that left took some of it along
  skin_.rebuild();
  forces_.pass_over_the_gone();
  forces_.moved();
  return fragments;
}

std::vector<SeatedNode> Fracture::seated_nodes() const {
  std::vector<SeatedNode> seats;
  if (!body_.bearings) return seats;
  for (std::size_t i = 0; i < body_.bearings->sites().size(); ++i) {
    const Bearings::Site& site = body_.bearings->sites()[i];
    if (!body_.bearings->holds(i) || !body_.live[site.deck_cell] || !body_.live[body_.bearings->cap_cell(i)])
      continue;
    const Bearings::Foot& foot = body_.bearings->foot(i);
    Vec3 place = Vec3::Zero();
    for (std::size_t a = 0; a < 8; ++a) place += foot.weight[a] * fields_.position(foot.node[a]);
    seats.push_back({body_.whole_node(site.deck_node), body_.whole_cell(site.deck_cell),
                     2 * site.deck + site.end, site.height, place});
  }
  return seats;
}

/// Mass that leaves with each node of a piece; of a hanging node that of what it follows. A node that keeps
/// no cell gives all it has: steel, and what rounding left.
std::map<int, Fracture::Leaving> Fracture::leaving_nodes(const HexMesh& mesh, const std::vector<int>& cells,
                                                         const Excerpt* apart) const {
  std::map<int, Leaving> nodes;
  for (int cell : cells) {
    const std::array<double, 8> share = corner_volumes(mesh, cell);
    for (int a = 0; a < 8; ++a) {
      const double m = body_.spec.density * share[a];
      const int n = mesh.hexes[cell][a];
      const HangingNode* h = hanging_node(mesh, n);
      nodes[n].mass += h != nullptr ? 0 : m;
      if (h != nullptr)
        for (const auto& [master, weight] : h->masters) nodes[master].mass += weight * m;
    }
    for (int n : carriers(mesh, cell)) ++nodes[n].cells;
  }
  for (auto& [n, node] : nodes) {
    const auto i = static_cast<std::size_t>(n);
    node.goes = node.cells == (apart != nullptr ? apart->cells_at_node[i] : body_.cells_at_node[i]);
    if (node.goes) node.mass = apart != nullptr ? apart->mass[i] : body_.mass[i];
    node.position = apart != nullptr ? apart->position[i] : fields_.position(n);
    node.velocity = apart != nullptr ? apart->velocity[i] : fields_.velocity(n);
  }
  return nodes;
}

/// The surface of a piece: vertices and triangles of `f`.
void Fracture::shape_of_piece(const HexMesh& mesh, const std::vector<int>& cells, double smallest,
                              const std::map<int, Leaving>& nodes, const std::vector<SeatedNode>& seated,
                              Fragment& f) const {
  std::vector<char> only(mesh.hexes.size(), 0);
  for (int cell : cells) only[cell] = 1;
  std::vector<SkinQuad> quads = skin(mesh, only);
  std::vector<Vec3> reference, present;
  std::vector<double> weight;
  std::map<int, std::size_t> at;
  for (const auto& [n, node] : nodes) {
    at.emplace(n, at.size());
    reference.push_back(mesh.nodes[n]);
    present.push_back(node.position);
    weight.push_back(node.mass);
  }
  // A face that is bared by quarters has corners of the cells that went: they lie where what they follow
  // says.
  for (const SkinQuad& q : quads)
    for (const int n : q.node) {
      if (!at.emplace(n, at.size()).second) continue;
      Vec3 place = Vec3::Zero();
      for (const auto& [master, share] : hanging_node(mesh, n)->masters)
        place += share * nodes.at(master).position;
      reference.push_back(mesh.nodes[n]);
      present.push_back(place);
      weight.push_back(0);
    }
  std::vector<Vec3> points = straightened(reference, present, weight, bent * std::cbrt(smallest));
  stand_on_pads(mesh, seated, quads, at, points);
  quads = cut_at_middles(mesh, quads);
  const ClosedSurface surface = close_surface(quads);
  for (int n : surface.node) f.vertices.push_back(points[at.at(n)]);
  std::vector<int> cell;  // of each triangle
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& v = surface.quad[q];
    f.triangles.push_back({v[0], v[1], v[2]});
    if (v[3] != v[2]) f.triangles.push_back({v[0], v[2], v[3]});
    cell.resize(f.triangles.size(), quads[q].cell);
  }
  part_touching_edges(f.vertices, f.triangles, std::move(cell));
  merge_planar(f.vertices, f.triangles);
}

Fragment Fracture::detach(const std::vector<int>& whole_cells, const std::vector<SeatedNode>& seats) {
  // On several ranks by an excerpt with numbers of its own, which all of them have; on one in the mesh
  // itself.
  std::optional<Excerpt> excerpted;
  if (body_.partition) excerpted = excerpt(whole_cells);
  const Excerpt* const apart = excerpted ? &*excerpted : nullptr;
  const HexMesh& mesh = apart != nullptr ? apart->mesh : body_.mesh;
  std::vector<int> cells = whole_cells;
  if (apart != nullptr) std::iota(cells.begin(), cells.end(), 0);
  Fragment f;
  f.elastic = link_energy(whole_cells);
  for (const double energy :
       body_.of_cells(whole_cells, 1, [this](int cell, double*to) { *to = cell_energy(cell); }))
    f.elastic += energy;
  double smallest = std::numeric_limits<double>::infinity(), of_cells = 0;
  for (const int cell : cells) {
    const auto i = static_cast<std::size_t>(cell);
    const double volume = (apart != nullptr ? apart->cell_mass[i] : body_.cell_mass[i]) / body_.spec.density;
    body_.lost.detached_volume += volume;
    smallest = std::min(smallest, volume);
    of_cells += volume * body_.spec.density;
  }
  const std::map<int, Leaving> nodes = leaving_nodes(mesh, cells, apart);
  for (const auto& [n, node] : nodes) {
    f.mass += node.mass;
    f.centroid += node.mass * node.position;
    f.linear_momentum += node.mass * node.velocity;
    f.kinetic += 0.5 * node.mass * node.velocity.squaredNorm();
  }
  f.centroid /= f.mass;
  f.crushed = std::max(0.0, f.mass - of_cells);
  for (const auto& [n, node] : nodes)
    f.angular_momentum += node.mass * (node.position - f.centroid).cross(node.velocity);
  std::vector<SeatedNode> seated;
  for (SeatedNode s : seats) {
    if (!std::binary_search(whole_cells.begin(), whole_cells.end(), s.cell)) continue;
    if (apart != nullptr) s.node = apart->place(s.node);
    seated.push_back(s);
  }
  shape_of_piece(mesh, cells, smallest, nodes, seated, f);
  switch_off(whole_cells);
  for (const auto& [of_piece, node] : nodes) {
    const int n =
        apart != nullptr ? body_.node_here(apart->node[static_cast<std::size_t>(of_piece)]) : of_piece;
    if (n < 0) continue;
    if (node.goes) {
      remove_node(n);
      continue;
    }
    body_.mass[n] -= node.mass;
    for (int c = 0; c < 3; ++c)
      if (body_.inverse_mass[4 * n + c] > 0) body_.inverse_mass[4 * n + c] = 1 / body_.mass[n];
  }
  forces_.masses_changed();
  energy_.stored_half -= f.elastic;
  energy_.works.eroded_energy += f.elastic;  // as of a cell that erodes
  energy_.works.algorithmic +=
      0.5 * fields_.h_last *
      body_.gravity.dot(f.linear_momentum);  // the structure's potential is that of half steps,
                                             // the block's that of its place
  body_.report(
      fmt::format("structure {}: {} cells came off, {:.4g} kg{}", body_.spec.name, whole_cells.size(), f.mass,
                  f.crushed > 0.5e-3 * f.mass
                      ? fmt::format(", {:.4g} kg of it {}what crushed cells beside them left at their nodes",
                                    f.crushed, body_.bars ? "the steel within and " : "")
                      : std::string()));
  return f;
}

void Fracture::save(std::vector<double>& state, bool here) const {
  state.insert(state.end(),
               {static_cast<double>(body_.lost.breaks), static_cast<double>(body_.lost.cuts_seen),
                body_.lost.dust_mass, body_.lost.dust_potential, body_.lost.eroded_volume,
                body_.lost.detached_volume});
  for (const Vec3* p : {&body_.lost.dust_momentum, &body_.lost.dust_spin})
    state.insert(state.end(), p->data(), p->data() + 3);
  body_.save(state, here, Of::cells, 1, [this](int cell, double* to) { *to = body_.live[cell]; });
  body_.save(state, here, Of::nodes, 1, [this](int n, double* to) { *to = body_.mass[n]; });
  if (body_.damage) body_.damage->save(state, here);
}

void Fracture::restore(StateReader& state, bool here) {
  body_.lost.breaks = static_cast<long>(state.next()), body_.lost.cuts_seen = static_cast<long>(state.next());
  for (double* p : {&body_.lost.dust_mass, &body_.lost.dust_potential, &body_.lost.eroded_volume,
                    &body_.lost.detached_volume})
    *p = state.next();
  for (Vec3* p : {&body_.lost.dust_momentum, &body_.lost.dust_spin}) std::copy_n(state.take(3), 3, p->data());
  double changed = 0;
  std::fill(body_.cells_at_node.begin(), body_.cells_at_node.end(), 0);
  const Division::Saved lives = body_.saved(state, here, Of::cells, 1);
  for (std::size_t cell = 0; cell < body_.live.size(); ++cell) {
    const char now = *lives(static_cast<int>(cell)) != 0;
    if (now != body_.live[cell]) changed = 1;
    body_.live[cell] = now;
    if (now)
      for (int n : carriers(body_.mesh, static_cast<int>(cell))) ++body_.cells_at_node[n];
  }
  if (body_.partition) body_.partition->exchange_numbers(body_.cells_at_node);
  const Division::Saved masses = body_.saved(state, here, Of::nodes, 1);
  for (std::size_t n = 0; n < body_.mass.size(); ++n) {
    const double mass = *masses(static_cast<int>(n));
    if (mass != body_.mass[n]) changed = 1;
    body_.mass[n] = mass;
    for (int c = 0; c < 3; ++c)
      body_.inverse_mass[4 * n + c] = mass > 0 && !body_.supports.held[n][c] ? 1 / mass : 0.0;
  }
  forces_.masses_changed();
  if (body_.damage) body_.damage->restore(state, here);
  for (int cell = 0; cell < static_cast<int>(body_.live.size()); ++cell)
    body_.elements->set_on(cell, body_.live[cell] && !(body_.damage && body_.damage->has(cell)));
  if (body_.largest(changed) > 0) {
    skin_.rebuild();
    forces_.pass_over_the_gone();
    ++body_.revision;
  }
}

}  // namespace talus::fem
