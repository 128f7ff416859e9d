#!/usr/bin/env python3
"""import talus: results are those of the program, bit for bit; errors, sweeps, stops, ensembles, plots and the notebook.

    module_test.py TALUS REPOSITORY     with PYTHONPATH=build/release/python
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import types
import unittest

import numpy as np

import talus

program, repository = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])

SLIDE = """
schema = 1
title = "A cube slides"
[simulation]
duration = "0.5 s"
[[plane]]
point = [0, 0, 0]
dip_direction = "90 deg"
dip = "35 deg"
material = "slope"
[[material]]
name = "rock"
density = 2500
[[interface]]
between = ["rock", "slope"]
friction = "28 deg"
normal_stiffness = "hard"
[[block]]
name = "B1"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0.28678821817552305, 0, 0.4095760221444959]
orientation = { rotation_vector = [0, 0.6108652381980153, 0] }
[output]
history_interval = "10 ms"
"""

PIER = """
schema = 1
title = "A cube strikes a pier"
[simulation]
duration = "0.06 s"
[[material]]
name = "rock"
density = 2500
[[material]]
name = "concrete"
density = 2500
young = "30 GPa"
poisson = 0.2
[[interface]]
between = ["rock", "concrete"]
friction = 0.5
[[structure]]
name = "pier"
kind = "column"
material = "concrete"
base = [0, 0, 0]
section = [1, 1]
height = 4
cell_size = 0.5
[[block]]
name = "B1"
material = "rock"
shape = "box"
size = [0.8, 0.8, 0.8]
position = [-1.0, 0, 2.6]
velocity = [8, 0, 0]
[output]
interval = "20 ms"
history_interval = "1 ms"
"""


class Reading(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name)
        (cls.root / "pier.toml").write_text(PIER)
        subprocess.run([program, "run", cls.root / "pier.toml", "-o", cls.root / "cli"], check=True, capture_output=True)
        cls.cli = talus.open(cls.root / "cli")

    @classmethod
    def tearDownClass(cls):
        cls.cli.close()
        cls.folder.cleanup()

    def test_run_gives_the_bits_of_the_program(self):
        with talus.run(self.root / "pier.toml", self.root / "here") as here:
            compared = []

            def compare(name, item):
                if hasattr(item, "shape") and not name.startswith("final"):
                    np.testing.assert_array_equal(here.file[name][()], item[()], err_msg=name)
                    compared.append(name)

            self.cli.file.visititems(compare)
            self.assertGreater(len(compared), 40)
            self.assertEqual(here.summary["impacts"], self.cli.summary["impacts"])

    def test_shapes_and_units(self):
        r, nt = self.cli, len(self.cli.time)
        self.assertEqual(r.blocks.position.shape, (nt, 1, 3))
        self.assertEqual(r.blocks["B1"].position.shape, (nt, 3))
        self.assertEqual(r.structures["pier"].base_force.shape, (nt, 3))
        self.assertEqual(r.unit("/ledger/kinetic"), "J")
        self.assertEqual(list(r.blocks), ["B1"])
        self.assertEqual(r.field(-1).structures.pier.displacement.shape[1], 3)
        with self.assertRaisesRegex(AttributeError, "it has"):
            r.ledger.heat
        with self.assertRaisesRegex(KeyError, "there are pier"):
            r.impulse("peer")

    def test_impulse_is_the_momentum_that_the_block_lost(self):
        b = self.cli.blocks["B1"]
        np.testing.assert_allclose(self.cli.impulse("pier")[0], b.mass * (b.velocity[0, 0] - b.velocity[-1, 0]), rtol=1e-9)

    def test_filtered_force_is_that_of_the_summary(self):
        _, filtered = talus.plots.mean_force(self.cli, "pier")
        told = self.cli.summary["impacts"][0]["filtered_force"]
        self.assertAlmostEqual(filtered.max() / told, 1, delta=1e-6)   # one mean written twice: round-off over some thousand bins

    def test_vertices_turn_with_the_block(self):
        b = self.cli.blocks["B1"]
        corners = b.vertices_at(0)
        np.testing.assert_allclose(sorted(set(np.round(corners[:, 0], 9))), [-1.4, -0.6], atol=1e-12)

    def test_notebook(self):
        os.environ["TALUS_RESULTS"] = str(self.root / "cli")
        cells = json.loads((repository / "docs/notebooks/report.ipynb").read_text())["cells"]
        names = {}
        for cell in cells:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), "report.ipynb", "exec"), names)

    def test_report_page_of_plots(self):
        talus.plots.report(self.cli).savefig(self.root / "plots.png")
        self.assertGreater((self.root / "plots.png").stat().st_size, 20000)


class Running(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def test_closed_form_from_text_with_set(self):
        """g (sin a - tan(phi) cos a) t^2 / 2 down the slope."""
        with talus.run(SLIDE, self.root / "slide", {"interface.rock/slope.friction": "20 deg"}) as r:
            a, t = np.radians(35), r.time[-1]
            way = np.linalg.norm(r.blocks["B1"].position[-1] - r.blocks["B1"].position[0])
            self.assertAlmostEqual(way, 0.5 * 9.81 * (np.sin(a) - np.tan(np.radians(20)) * np.cos(a)) * t**2, delta=1e-3)   # accuracy 1e-3 of a metre
        self.assertEqual((self.root / "slide/scene.toml").read_text(), SLIDE)

    def test_check(self):
        told = talus.check(SLIDE)
        self.assertEqual(told.title, "A cube slides")
        self.assertTrue(told.plan)

    def test_time_that_nobody_knows_is_no_figure(self):
        line = next(line for line in talus.check(PIER, {"simulation.duration": "100 s"}).plan if line.startswith("CPU time"))
        self.assertIn("not known beforehand", line)
        told = talus.check(SLIDE.replace('duration = "0.5 s"', 'duration = "20 s"\nstep = "1e-9 s"'))
        self.assertRegex(told.warnings[0], r"scene.toml:6:\d+: warning: simulation.step .* days")

    def test_errors_name_place_and_remedy(self):
        with self.assertRaises(talus.SceneError) as caught:
            talus.check(SLIDE.replace("density = 2500", "density = -1").replace('friction = "28 deg"', 'friction = -1'))
        problems = caught.exception.problems
        self.assertEqual(len(problems), 2)
        self.assertTrue(all(p["line"] > 0 and p["rule"] for p in problems))
        with self.assertRaises(talus.SceneError):
            talus.run(SLIDE, self.root / "none", {"block.B1.sise": 2})
        self.assertFalse((self.root / "none").exists())
        with self.assertRaises(FileNotFoundError):
            talus.open(self.root)

    def test_values_of_set_are_what_python_has(self):
        plan = lambda key, value: talus.check(SLIDE, {key: value})
        turned = {"rotation_vector": [np.float32(0), "35 deg", np.float64(0)]}
        self.assertEqual(plan("block.B1.orientation", turned).plan, plan("title", "x").plan)
        self.assertEqual(plan("title", 'a "b"').title, 'a "b"')
        with self.assertRaises(talus.SceneError) as caught:
            plan("site", {"terrain": self.root / "none.asc", "material": "slope"})
        self.assertIn("no file " + str(self.root / "none.asc"), str(caught.exception))
        for value in (None, {"a": None}, object()):
            with self.assertRaisesRegex(TypeError, "a value of `set` is"):
                plan("title", value)

    def test_stopped_and_resumed_to_the_same_bits(self):
        class Enough(Exception):
            pass

        def stop(time, duration):
            if time > 0.2:
                raise Enough

        with self.assertRaises(Enough):
            talus.run(SLIDE, self.root / "slide", progress=stop)
        self.assertEqual(talus.open(self.root / "slide").status, "interrupted")
        with talus.run(SLIDE, self.root / "slide", resume=True) as resumed, talus.run(SLIDE, self.root / "whole") as whole:
            np.testing.assert_array_equal(resumed.blocks.position, whole.blocks.position)
            self.assertEqual(resumed.status, "done")

    def test_sweep(self):
        angles = ["20 deg", "24 deg", "28 deg"]
        swept = talus.sweep(SLIDE, {"interface.rock/slope.friction": angles}, self.root / "sweep", jobs=2)
        way = swept.table(way=lambda r: np.linalg.norm(r.blocks[0].position[-1] - r.blocks[0].position[0]))["way"]
        self.assertEqual(way, sorted(way, reverse=True))
        with self.assertRaises(talus.SceneError):
            talus.sweep(SLIDE, {"block.B1.size": [[1, 1, 1], [0, 1, 1]]}, self.root / "bad")
        self.assertFalse((self.root / "bad").exists())

    def test_ensemble(self):
        scene = SLIDE + '\n[[line]]\nname = "road"\npoints = [[0.5, -5], [0.5, 5]]\n[ensemble]\nmembers = 8\nseed = 1\n[[ensemble.vary]]\nkey = "interface.rock/slope.friction"\nuniform = ["10 deg", "20 deg"]\n'
        (self.root / "e.toml").write_text(scene)
        subprocess.run([program, "ensemble", self.root / "e.toml", "-o", self.root / "e", "--threads", "1"], check=True, capture_output=True)
        with talus.open_ensemble(self.root / "e") as e:
            self.assertEqual(len(e.members.index), 8)
            road = e.line("road")
            self.assertEqual(len(road.kinetic), 8)
            np.testing.assert_array_equal(np.sort(road.largest("kinetic")), np.sort(road.kinetic))
            told = [line for line in e.summary["lines"] if line["name"] == "road"][0] if isinstance(e.summary["lines"], list) else e.summary["lines"]["road"]
            self.assertEqual(told["crossings"], 8)
            with self.assertRaisesRegex(KeyError, "no line rode; there are road"):
                e.line("rode")
            with self.assertRaisesRegex(FileNotFoundError, "talus fragility .* makes it"):
                e.fragility
            with self.assertRaisesRegex(KeyError, "pier; there are none"):
                e.hits["pier"]
            (self.root / "e" / "fragility.json").write_text('{"structure": "B", "others": [{"structure": "A", "limits": "x"}]}')
            self.assertEqual(e.fragility, {"B": {"structure": "B"}, "A": {"structure": "A", "limits": "x"}})
        with self.assertRaisesRegex(FileNotFoundError, "talus.open_ensemble"):
            talus.open(self.root / "e")
        with self.assertRaisesRegex(talus.SceneError, "holds the results of an ensemble"):
            talus.run(SLIDE, self.root / "e")
        self.assertTrue((self.root / "e" / "ensemble.h5").exists())

    def test_largest_is_of_members_that_came_to_an_end(self):
        group = types.SimpleNamespace(member=np.array([0, 0, 1, 2, 3]), height=np.array([1.0, 3, 2, np.nan, 9]))
        road = talus.results.Crossings(group, finished=[0, 1, 2])
        np.testing.assert_array_equal(road.largest("height"), [3, 2])   # 2 nowhere above ground, 3 failed

    def test_ensemble_does_not_replace_a_run(self):
        talus.run(SLIDE, self.root / "run")
        (self.root / "e.toml").write_text(SLIDE + '\n[ensemble]\nmembers = 2\n')
        for more in [], ["--resume"]:
            told = subprocess.run([program, "ensemble", self.root / "e.toml", "-o", self.root / "run", *more], capture_output=True, text=True)
            self.assertEqual(told.returncode, 2)
            self.assertIn("holds the results of a run", told.stderr)
        self.assertEqual(talus.open(self.root / "run").status, "done")

    def test_interrupted_ensemble_says_how_many_members_are_kept(self):
        asked = 20000
        (self.root / "e.toml").write_text(SLIDE + f'\n[ensemble]\nmembers = {asked}\n')
        command = [program, "ensemble", self.root / "e.toml", "-o", self.root / "e", "--threads", "1"]
        kept = []
        for more in [], ["--resume"]:
            run = subprocess.Popen([*command, *more], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            journal, size = self.root / "e" / "journal" / "0.bin", 0
            begun = journal.stat().st_size if journal.exists() else 0
            while run.poll() is None and size <= begun + 2000:
                size = journal.stat().st_size if journal.exists() else 0
                time.sleep(0.01)
            run.send_signal(signal.SIGINT)
            told = run.communicate(timeout=60)[0]
            self.assertEqual(run.returncode, 130)
            kept.append(int(re.search(rf"(\d+) of {asked} members are finished and kept", told)[1]))
        self.assertTrue(0 < kept[0] < kept[1] < asked, kept)

    def test_what_is_not_there_is_named_with_what_is(self):
        with talus.run(SLIDE, self.root / "slide") as r:
            with self.assertRaisesRegex(KeyError, "no block B7; there are B1"):
                r.blocks["B7"]
            with self.assertRaisesRegex(KeyError, "/ledger has no heat; it has algorithmic"):
                r.ledger["heat"]
            with self.assertRaisesRegex(KeyError, "has no /ledger/heat"):
                r.unit("/ledger/heat")
            with self.assertRaisesRegex(AttributeError, "/ledger has no heat; it has algorithmic"):
                r.ledger.heat
            with self.assertRaisesRegex(IndexError, "no block 1; there are 1"):
                r.blocks[1]
            with self.assertRaisesRegex(IndexError, r"no frame 900; there are \d+"):
                r.field(900)
            with self.assertRaisesRegex(KeyError, "no structure P1; there are none"):
                r.structures["P1"]
        short = self.root / "short.h5"
        short.write_bytes((self.root / "slide" / "results.h5").read_bytes()[:-100])
        with self.assertRaisesRegex(OSError, "short.h5: cut short or damaged"):
            talus.open(short)
        for scene in (None, 5, SLIDE.encode()):
            with self.assertRaisesRegex(TypeError, "a scene is the path of a file, or its text"):
                talus.check(scene)
        with self.assertRaisesRegex(TypeError, "`set` is a dict"):
            talus.check(SLIDE, ["title=x"])
        with self.assertRaisesRegex(TypeError, "a list of values for each key"):
            talus.sweep(SLIDE, {"simulation.duration": "1 s"}, self.root / "swept")
        text = self.root / "scene.toml"
        text.write_text(SLIDE)
        for opener in (talus.open, talus.open_ensemble):
            with self.assertRaisesRegex(OSError, "scene.toml: no HDF5 file"):
                opener(text)
        with self.assertRaisesRegex(FileNotFoundError, "talus.open reads it"):
            talus.open_ensemble(self.root / "slide")

    def test_guide_runs(self):
        """The ten lines of docs/guide/python.md, on a shorter run."""
        text = (repository / "docs/guide/python.md").read_text()
        lines = re.search(r"```python\n(.*?)```", text, re.S).group(1)
        self.assertLessEqual(len([line for line in lines.splitlines() if line.strip()]), 10)
        here = os.getcwd()
        os.chdir(repository)
        try:
            exec(lines.replace('"results/pier', f'"{self.root}/pier').replace("8 s", "0.2 s"), {})
        finally:
            os.chdir(here)
        self.assertTrue((self.root / "pier/plots.png").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
