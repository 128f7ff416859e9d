#!/usr/bin/env python3
"""The dependencies between the folders of src/, as a table. Fails on every #include that the table does not allow, and on
deal.II outside src/fem, CGAL and GDAL outside src/geometry, MPI, PETSc and Trilinos outside src/fem.

    include_table.py SRC         checks a source tree
    include_table.py --self-test plants forbidden lines and checks that each is seen
"""
import pathlib
import re
import sys
import tempfile

# folder: the folders it may include from, besides itself
ALLOWED = {
    "core": [],
    "formulas": ["core"],
    "contact": ["core"],
    "geometry": ["core", "contact"],
    "dda": ["core", "contact"],
    "fem": ["core", "contact"],
    "coupling": ["core", "contact", "geometry", "dda"],  # fem only through contact/structures/structure.hpp
    "scene": ["core", "contact", "geometry", "dda", "coupling"],
    "sim": ["core", "contact", "geometry", "dda", "coupling", "scene"],
    "io": ["core", "formulas", "contact", "geometry", "dda", "coupling", "scene", "sim"],
    "verify": ["core", "contact", "geometry", "dda", "fem", "coupling", "scene", "sim", "io"],
    "ensemble": ["core", "contact", "geometry", "dda", "coupling", "scene", "sim", "io"],
    "app": ["core", "formulas", "contact", "geometry", "dda", "coupling", "scene", "sim", "io", "verify", "ensemble"],
}

# what stays in one folder: pattern of the included name, the folders that may, a name for the message
CONFINED = [
    (re.compile(r"^deal\.II/"), ["fem"], "deal.II"),
    (re.compile(r"^CGAL/"), ["geometry"], "CGAL"),
    (re.compile(r"^(gdal|ogr|cpl_)"), ["geometry"], "GDAL"),
    (re.compile(r"^(geo_normalize|xtiffio|geotiff)"), ["geometry"], "GeoTIFF"),
    (re.compile(r"^(mpi\.h|petsc|Epetra|Teuchos|Tpetra|ml_|Amesos)"), ["fem"], "MPI, PETSc or Trilinos"),
    (re.compile(r"^gmsh"), ["fem"], "Gmsh"),
    (re.compile(r"^toml\+\+/"), ["scene"], "toml++"),
    (re.compile(r"^CLI/"), ["app"], "CLI11"),
    (re.compile(r"^hdf5"), ["io", "sim"], "HDF5"),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def problems(src):
    found = []
    for path in sorted(src.rglob("*")):
        if path.suffix not in {".hpp", ".cpp", ".h", ".inc"}:
            continue
        folder = path.relative_to(src).parts[0]
        if folder not in ALLOWED:
            found.append(f"{path}: the folder {folder} is not in the table")
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            quote, name = match.groups()
            for pattern, owners, what in CONFINED:
                if pattern.search(name) and folder not in owners:
                    found.append(f"{path}:{number}: {what} stays in {', '.join(owners)}")
            first = name.split("/")[0]
            if quote == '"' and first in ALLOWED and first != folder and first not in ALLOWED[folder]:
                found.append(f"{path}:{number}: {folder} must not include {name}")
            if quote == '"' and ".." in name.split("/"):
                found.append(f"{path}:{number}: includes start at src/, not at ..")
    return found


def self_test():
    planted = {
        "core/a.hpp": '#include "contact/laws/law.hpp"',
        "contact/a.hpp": '#include "dda/state.hpp"',
        "dda/a.cpp": '  #  include "fem/setup.hpp"',
        "coupling/a.cpp": '#include "fem/setup.hpp"',
        "sim/a.cpp": "#include <deal.II/base/point.h>",
        "dda/b.cpp": "#include <CGAL/Polyhedron_3.h>",
        "io/a.cpp": "#include <gdal_priv.h>",
        "scene/a.cpp": '#include "sim/simulation.hpp"',
        "io/b.cpp": '#include "app/cli.hpp"',
        "fem/a.cpp": '#include "../dda/state.hpp"',
        "other/a.cpp": "int a;",
    }
    fine = {
        "sim/b.cpp": '#include "scene/scene.hpp"',
        "fem/b.cpp": "#include <deal.II/base/point.h>",
        "geometry/b.cpp": "#include <CGAL/Polyhedron_3.h>",
        "app/b.cpp": '// #include "fem/setup.hpp"',
    }
    with tempfile.TemporaryDirectory() as name:
        src = pathlib.Path(name)
        for file, text in {**planted, **fine}.items():
            (src / file).parent.mkdir(exist_ok=True)
            (src / file).write_text(text + "\n", encoding="utf-8")
        seen = problems(src)
    missed = [f for f in planted if not any(f"{f}" in p for p in seen)]
    wrong = [p for p in seen if any(f in p for f in fine)]
    for f in missed:
        print(f"not seen: {f}")
    for p in wrong:
        print(f"wrongly reported: {p}")
    return 1 if missed or wrong else 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    src = pathlib.Path(sys.argv[1])
    if not src.is_dir() or not any(src.iterdir()):
        print(f"no sources in {src}")
        return 1
    found = problems(src)
    print("\n".join(found) if found else "every include is allowed")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
