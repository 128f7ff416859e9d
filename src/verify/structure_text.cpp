#include "verify/structure_text.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// One for each process, as suites may run side by side.
std::filesystem::path folder_path() {
  return std::filesystem::temp_directory_path() /
         fmt::format("talus-verify-{}", static_cast<long>(::getpid()));
}

struct Folder {
  std::filesystem::path path = folder_path();
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { remove_temporary(); }
};

std::string temporary(const std::string& name) {
  static const Folder folder;
  return (folder.path / name).string();
}

}  // namespace

void remove_temporary() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_path(), ignored);
}

std::string StructureText::str() const {
  std::string text = fmt::format(
      "schema = 1\n[simulation]\nduration = {}\ngravity = {}\nthreads = 1\n[output]\ninterval = "
      "{}\nhistory_interval = {}\n"
      "[[material]]\nname = \"m\"\n{}\n[[interface]]\nbetween = [\"m\", \"m\"]\nfriction = "
      "0.6\n[[structure]]\nname = \"S\"\nmaterial = \"m\"\n{}\n",
      number(duration), vector(gravity), number(duration), number(interval), material, body);
  for (std::size_t i = 0; i < probes.size(); ++i)
    text += fmt::format("[[structure.probe]]\nname = \"p{}\"\nat = {}\n", i, vector(probes[i]));
  for (const Load& load : loads) {
    std::string table;
    for (const auto& [time, factor] : load.history)
      table += fmt::format("{}[{}, {}]", table.empty() ? "" : ", ", number(time), number(factor));
    text +=
        fmt::format("[[structure.load]]\nregion = {{ min = {}, max = {} }}\ntraction = {}\nhistory = [{}]\n",
                    vector(load.region.min()), vector(load.region.max()), vector(load.traction), table);
  }
  return text;
}

std::vector<double> probe_history(const Outcome& o, int probe, int axis) {
  std::vector<double> u;
  for (const sim::HistoryRow& row : o.rows)
    u.push_back(row.structures.at(0).probe_displacement.at(static_cast<std::size_t>(probe))[axis]);
  return u;
}

std::string write_chain(const std::string& name, const std::vector<Section>& sections) {
  const std::string path = temporary(name + ".inp");
  std::ofstream out(path);
  const int corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  out << "*NODE, NSET=ALL\n";
  for (std::size_t i = 0; i < sections.size(); ++i)
    for (int k = 0; k < 4; ++k)
      out << fmt::format("{}, {}, {}, {}\n", 4 * i + k + 1, number(sections[i].x),
                         number(corner[k][0] * sections[i].half), number(corner[k][1] * sections[i].half));
  out << "*ELEMENT, TYPE=C3D8, ELSET=BAR\n";
  for (std::size_t i = 0; i + 1 < sections.size(); ++i) {
    const std::size_t n = 4 * i;
    out << fmt::format("{}, {}, {}, {}, {}, {}, {}, {}, {}\n", i + 1, n + 1, n + 2, n + 3, n + 4, n + 5,
                       n + 6, n + 7, n + 8);
  }
  const std::size_t last = 4 * (sections.size() - 1);
  out << fmt::format("*NSET, NSET=LEFT, GENERATE\n1, 4, 1\n*NSET, NSET=RIGHT, GENERATE\n{}, {}, 1\n",
                     last + 1, last + 4);
  if (!out.flush()) throw NumericalFailure("the mesh " + path + " cannot be written");
  return path;
}

std::string write_patch(std::vector<Vec3>& nodes) {
  nodes = {{.25, .28, .22}, {.72, .29, .27}, {.75, .65, .26}, {.27, .72, .23},
           {.30, .22, .66}, {.68, .30, .70}, {.77, .70, .66}, {.22, .74, .72}};
  const std::string path = temporary("patch.inp");
  std::ofstream out(path);
  const double corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                               {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  out << "*NODE\n";
  for (int i = 0; i < 8; ++i)
    out << fmt::format("{}, {}, {}, {}\n", i + 1, number(nodes[static_cast<std::size_t>(i)].x()),
                       number(nodes[static_cast<std::size_t>(i)].y()),
                       number(nodes[static_cast<std::size_t>(i)].z()));
  for (int i = 0; i < 8; ++i)
    out << fmt::format("{}, {}, {}, {}\n", i + 9, number(corner[i][0]), number(corner[i][1]),
                       number(corner[i][2]));
  out << "*ELEMENT, TYPE=C3D8, ELSET=PATCH\n1, 1, 2, 3, 4, 5, 6, 7, 8\n";
  // The six cells between a face of the inner one and a face of the cube.
  const int face[6][4] = {{1, 2, 3, 4}, {5, 8, 7, 6}, {1, 5, 6, 2}, {3, 7, 8, 4}, {1, 4, 8, 5}, {2, 6, 7, 3}};
  for (int f = 0; f < 6; ++f)
    out << fmt::format("{}, {}, {}, {}, {}, {}, {}, {}, {}\n", f + 2, face[f][0] + 8, face[f][1] + 8,
                       face[f][2] + 8, face[f][3] + 8, face[f][0], face[f][1], face[f][2], face[f][3]);
  if (!out.flush()) throw NumericalFailure("the mesh " + path + " cannot be written");
  return path;
}

}  // namespace talus::verify
