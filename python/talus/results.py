"""Results of a run as NumPy arrays. Names, shapes and units are those of docs/output.md; nothing here needs
the program.

    r = talus.open("results/tirol-pier")
    r.time                                   [nt] s
    r.blocks["boulder"].position             [nt, 3] m
    r.structures["pier"].base_force          [nt, 3] N
    r.contacts.force                         [rows, 3] N
    r.ledger.kinetic                         [nt] J
    r.summary["headline"]

An array is read at its first use and kept; `unit(path)` and `description(path)` tell of it. `r.file` is the
h5py file.
"""
import json
import os
import pathlib

import h5py
import numpy as np


def _array(dataset):
    if h5py.check_string_dtype(dataset.dtype):
        return np.asarray(dataset.asstr()[...], dtype=object)
    return dataset[...]


def _list(names, none="none"):
    return ", ".join(names) or none


class Group:
    """A group of the file: its datasets are arrays, its groups are groups, by attribute or by name."""

    def __init__(self, group):
        self._group = group
        self._read = {}

    def __getitem__(self, name):
        if name not in self._read:
            if name not in self._group:
                raise KeyError(f"{self._group.name} has no {name}; it has {_list(self._group, 'nothing')}")
            item = self._group[name]
            self._read[name] = _array(item) if isinstance(item, h5py.Dataset) else Group(item)
        return self._read[name]

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as missing:
            raise AttributeError(missing.args[0]) from None

    def __contains__(self, name):
        return name in self._group

    def __iter__(self):
        return iter(self._group)

    def __len__(self):
        return len(self._group)

    def __dir__(self):
        return list(super().__dir__()) + list(self._group)

    def __repr__(self):
        return f"<{self._group.name}: {', '.join(self)}>"


class Block:
    """One block: columns of the arrays of all blocks. Fragments read NaN before their birth."""

    def __init__(self, results, index):
        self._results, self.index = results, index
        self.name = results.block_names[index]

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        values = getattr(self._results.blocks, name)
        return values[self.index] if name in Blocks.single else values[:, self.index]

    @property
    def speed(self):
        """[nt] m/s"""
        return np.linalg.norm(self.velocity, axis=1)

    @property
    def kinetic(self):
        """[nt] J, of translation and rotation"""
        return self.kinetic_translational + self.kinetic_rotational

    @property
    def rotation(self):
        """[nt, 3, 3], body to world"""
        return rotation_matrix(self.orientation)

    @property
    def vertices(self):
        """[n, 3] m, in body axes about the centroid, as at the start"""
        g = self._results.geometry.blocks
        first, last = g.vertex_offset[self.index : self.index + 2]
        return g.vertices[first:last]

    def vertices_at(self, row):
        """[n, 3] m, in the scene at a row of the histories; strain left out."""
        return self.position[row] + self.vertices @ self.rotation[row].T

    def __repr__(self):
        return f"<block {self.name}, {self.mass:.4g} kg>"


class _Absent(dict):
    """In place of a group that the file does not have."""

    def __init__(self, what):
        super().__init__()
        self._what = what

    def __missing__(self, name):
        raise KeyError(f"no {self._what} {name}; there are none")


def _at(names, index, what):
    """names[index], by its number from either end."""
    if not -len(names) <= index < len(names):
        raise IndexError(f"no {what} {index}; there are {len(names)}")
    return names[index]


class Blocks(Group):
    """/history/blocks: arrays over all blocks; `blocks["B1"]` or `blocks[0]` is one of them."""

    single = ("mass", "left")

    def __init__(self, group, results):
        super().__init__(group)
        self._results = results

    def __getitem__(self, name):
        if isinstance(name, (int, np.integer)):
            return Block(self._results, _at(range(len(self._results.block_names)), name, "block"))
        if name in self._group:
            return super().__getitem__(name)
        if name in self._results.block_names:
            return Block(self._results, self._results.block_names.index(name))
        names = self._results.block_names
        more = ", ..." if len(names) > 5 else ""
        raise KeyError(f"no block {name}; there are {_list(names[:5])}{more}")

    def __iter__(self):
        return iter(self._results.block_names)

    def __len__(self):
        return len(self._results.block_names)

    def __contains__(self, name):
        return name in self._results.block_names or name in self._group

    def __dir__(self):
        return list(object.__dir__(self)) + list(self._group)


def _instead(directory, opener, file):
    """What to do with a directory that lacks its results."""
    if (directory / file).is_file():
        return f"it holds {file}: {opener} reads it"
    if (directory / "journal").is_dir():
        return f"the ensemble is not finished: `talus ensemble SCENE -o {directory} --resume`"
    if (directory / "journal.bin").is_file():
        return f"the run was killed: `talus report {directory}` builds it"
    return "name the output directory of Talus"


def _open(file):
    if not h5py.is_hdf5(file):
        raise OSError(f"{file}: no HDF5 file, or one cut short; name the output directory of Talus")
    unlocked = {"locking": False} if h5py.version.hdf5_version_tuple >= (1, 12, 1) else {}
    try:
        return h5py.File(file, "r", **unlocked)
    except OSError as error:
        raise OSError(f"{file}: cut short or damaged: {error}") from None


class _Opened:
    """A results file that a `with` closes."""

    def close(self):
        self.file.close()

    def __enter__(self):
        return self

    def __exit__(self, *ignored):
        self.close()


class Results(_Opened):
    """A run's directory. Use as it is, or as `with talus.open(DIR) as r:`."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        file = self.directory / "results.h5" if self.directory.is_dir() else self.directory
        if not file.is_file():
            instead = _instead(self.directory, "talus.open_ensemble", "ensemble.h5")
            raise FileNotFoundError(f"{directory}: no results.h5; {instead}")
        self.directory = file.parent
        self.file = _open(file)
        self._root = Group(self.file)

    @property
    def summary(self):
        """summary.json"""
        if not hasattr(self, "_summary"):
            self._summary = json.loads((self.directory / "summary.json").read_text(encoding="utf-8"))
        return self._summary

    @property
    def status(self):
        return self.summary["status"]

    @property
    def time(self):
        """[nt] s, of all histories but those of contacts"""
        return self._root.history.time

    @property
    def blocks(self):
        if not hasattr(self, "_blocks"):
            self._blocks = Blocks(self.file["history/blocks"], self)
        return self._blocks

    @property
    def block_names(self):
        if not hasattr(self, "_names"):
            self._names = list(_array(self.file["history/blocks/name"]))
        return self._names

    @property
    def structures(self):
        """A group for each structure; empty without any."""
        history = self._root.history
        return history["structures"] if "structures" in history else _Absent("structure")

    @property
    def contacts(self):
        """Contacts of blocks and structures, by rows: time, dt, point, force, normal, block, structure."""
        return self._root.history.contacts.structure

    @property
    def ledger(self):
        return self._root.ledger

    @property
    def geometry(self):
        return self._root.geometry

    @property
    def field_times(self):
        """[nf] s"""
        return self._root.fields.time

    def field(self, index):
        """The fields of a frame: `field(-1).structures.pier.displacement`."""
        frames = sorted(name for name in self._root.fields if name != "time")
        return self._root.fields[_at(frames, index, "frame")]

    def unit(self, path):
        return self._attribute(path, "unit")

    def description(self, path):
        return self._attribute(path, "description")

    def _attribute(self, path, name):
        if path not in self.file:
            raise KeyError(f"{self.file.filename} has no {path}; r.file.visit(print) lists what it has")
        if name not in self.file[path].attrs:
            raise KeyError(f"{path} has no {name}")
        value = self.file[path].attrs[name]
        return value.decode() if isinstance(value, bytes) else str(value)

    def contacts_of(self, structure=None):
        """[rows] bool, which rows of `contacts` are on a structure (a name; all by default)."""
        if structure is None:
            return np.ones(len(self.contacts.time), bool)
        names = list(_array(self.file["geometry/structures/name"]))
        if structure not in names:
            raise KeyError(f"no structure {structure}; there are {_list(names)}")
        return self.contacts.structure == names.index(structure)

    def contact_force(self, structure=None):
        """Force on a structure (a name; all of them by default), mean over each coupled step: times [n] s,
        forces [n, 3] N.

        Rows of one step share their time; their forces add up.
        """
        c = self.contacts
        keep = self.contacts_of(structure)
        times, step = np.unique(c.time[keep], return_inverse=True)
        sums = [np.bincount(step, c.force[keep, k], len(times)) for k in range(3)] if len(times) else []
        force = np.stack(sums, -1) if sums else np.zeros((0, 3))
        return times, force

    def impulse(self, structure=None):
        """[3] N s, on a structure (all by default)."""
        c, keep = self.contacts, self.contacts_of(structure)
        return (c.force[keep] * c.dt[keep][:, None]).sum(axis=0)

    def __repr__(self):
        return (f"<results of {os.fspath(self.directory)}: {len(self.time)} rows, {len(self.blocks)} blocks, "
                f"structures {_list(self.structures)}>")


def rotation_matrix(q):
    """Matrices of unit quaternions (w, x, y, z): [..., 4] -> [..., 3, 3]."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, -1).reshape(np.shape(q)[:-1] + (3, 3))


class EnsembleResults(_Opened):
    """An ensemble's directory: `members`, `lines`, `hits` as groups of arrays (docs/guide/ensemble.md),
    `summary` from summary.json, `fragility` from fragility.json.

        e = talus.open_ensemble("results/slope")
        e.members.runout                    [members, blocks] m
        e.members.varied                    what was drawn
        e.lines.road.velocity               [crossings, 3] m/s
        e.line("road").kinetic              [crossings] J, of translation and rotation
    """

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        file = self.directory / "ensemble.h5" if self.directory.is_dir() else self.directory
        if not file.is_file():
            instead = _instead(self.directory, "talus.open", "results.h5")
            raise FileNotFoundError(f"{directory}: no ensemble.h5; {instead}")
        self.directory = file.parent
        self.file = _open(file)
        self._root = Group(self.file)
        self.members = self._root.members

    @property
    def summary(self):
        return json.loads((self.directory / "summary.json").read_text(encoding="utf-8"))

    @property
    def fragility(self):
        """fragility.json by the name of the structure: `e.fragility["viaduct"]["per_event"]`."""
        file = self.directory / "fragility.json"
        if not file.is_file():
            raise FileNotFoundError(f"{file}: there is none; talus fragility {self.directory} --structure "
                                    "NAME makes it")
        last = json.loads(file.read_text(encoding="utf-8"))
        return {f["structure"]: f for f in [last, *last.pop("others", [])]}

    @property
    def lines(self):
        return self._root["lines"] if "lines" in self._root else _Absent("line")

    @property
    def hits(self):
        return self._root["hits"] if "hits" in self._root else _Absent("structure that is hit,")

    def line(self, name):
        if name not in self.lines:
            raise KeyError(f"no line {name}; there are {_list(self.lines)}")
        status = np.asarray(self.members.status).astype(str)
        return Crossings(self.lines[name], self.members.index[~np.isin(status, ["failed", "over limit"])])

    def __repr__(self):
        return (f"<ensemble of {os.fspath(self.directory)}: {len(self.members.index)} members, "
                f"lines {_list(self.lines)}, hits {_list(self.hits)}>")


class Crossings:
    """Crossings of one line, one entry each."""

    def __init__(self, group, finished):
        self._group, self._finished = group, finished

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._group, name)

    @property
    def kinetic(self):
        """[n] J, of translation and rotation"""
        return self._group.kinetic_translational + self._group.kinetic_rotational

    @property
    def speed(self):
        """[n] m/s"""
        return np.linalg.norm(self._group.velocity, axis=1)

    def largest(self, quantity):
        """Largest value of each member that crosses and came to an end: what the percentiles of the summary
        are of. [such members]"""
        values, member = np.asarray(getattr(self, quantity)), self._group.member
        # A height is NaN where there is no ground.
        kept = np.isin(member, self._finished) & np.isfinite(values)
        found, at = np.unique(member[kept], return_inverse=True)
        out = np.full(len(found), -np.inf)
        np.maximum.at(out, at, values[kept])
        return out
