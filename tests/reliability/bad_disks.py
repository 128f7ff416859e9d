#!/usr/bin/env python3
"""Disks that fill up or vanish, directories that cannot be written, and resuming in the wrong directory: the program says what is wrong,
ends with its documented exit code, leaves readable results, and goes on where it can.

    bad_disks.py TALUS
"""
import fcntl
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import h5py

here = pathlib.Path(__file__).resolve().parent
scene = here / "scene.toml"
failures = []


def run(*arguments, limit=None, user=None, program=None, of=None):
    def prepare():
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        if user is not None:
            os.setuid(user)
    return subprocess.run([program or talus, "run", str(of or scene), *map(str, arguments)], capture_output=True, text=True, timeout=240, preexec_fn=prepare)


def expect(name, result, code, *words):
    text = result.stdout + result.stderr
    missing = [w for w in words if w not in text]
    if result.returncode != code or missing:
        failures.append(name)
        print(f"FAIL {name}: exit code {result.returncode} (expected {code}), missing {missing}\n{text[-1500:]}")
    else:
        print(f"ok   {name}")


def check(name, good, told=""):
    if not good:
        failures.append(name)
        print(f"FAIL {name} {told}")


def readable(directory):
    """results.h5, if there is one, reads to its last dataset."""
    file = directory / "results.h5"
    if file.exists():
        with h5py.File(file, "r") as h5:
            h5.visititems(lambda _, item: item[()] if isinstance(item, h5py.Dataset) else None)
    return True


def full_by_limit(work):
    """A limit on the size of files stands for a full disk: a write is cut short and then refused."""
    directory = work / "limit"
    result = run("-o", directory, limit=120_000)
    expect("a write is refused", result, 3, "cannot", "--resume")
    check("no half-written file stays", not list(directory.glob("*.part")), str(list(directory.glob("*.part"))))
    readable(directory)
    expect("the run goes on when there is room", run("-o", directory, "--resume"), 0, "done at t = 0.4")


def verified(work):
    """Suites take minutes: that their page could not be written is an error."""
    for limit in (100, 2000):  # the table, the page
        directory = work / f"verified-{limit}"
        ended = subprocess.run([talus, "verify", "dda/A1", "-o", directory], capture_output=True, text=True, timeout=240,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        expect(f"a page of verify beyond {limit} bytes", ended, 3, "verify.", "File too large")
        check("it says nothing of files that it did not write", "wrote" not in ended.stdout, ended.stdout)
        check("no half-written page stays", all(f.stat().st_size < limit for f in directory.iterdir()), str(list(directory.iterdir())))


def full_by_mount(work):
    """A file system of 300 kB in memory, where that is allowed."""
    directory = work / "mount"
    directory.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", directory], capture_output=True).returncode != 0:
        print("left out: a full file system (mounting is not allowed here)")
        return
    try:
        result = run("-o", directory / "out")
        expect("the disk is full", result, 3, "cannot", "--resume")
        readable(directory / "out")
        subprocess.run(["mount", "-o", "remount,size=30m", directory], check=True)
        expect("the run goes on on a larger disk", run("-o", directory / "out", "--resume"), 0, "done at t = 0.4")
        subprocess.run(["mount", "-o", "remount,ro", directory], check=True)
        expect("a read-only disk", run("-o", directory / "out"), 2, "cannot be written")
        expect("a new directory on a read-only disk", run("-o", directory / "other"), 2, "cannot be written")
    finally:
        subprocess.run(["umount", "-l", directory], check=True)


def read_only(work):
    directory = work / "locked"
    directory.mkdir()
    directory.chmod(0o555)
    work.chmod(0o755)
    # The superuser may write everywhere: another user tries, with copies, since the checkout may lie where nobody else may look.
    for file in [*pathlib.Path(talus).parent.glob("*talus*.so"), talus]:
        shutil.copy(file, work)
    shutil.copy(scene, work)
    result = run("-o", directory / "out", user=65534 if os.getuid() == 0 else None, program=work / pathlib.Path(talus).name, of=work / scene.name)
    expect("a directory without permission", result, 2, "cannot be written", "-o")
    directory.chmod(0o755)


def vanished(work):
    directory = work / "vanished"
    process = subprocess.Popen([talus, "run", str(scene), "-o", str(directory)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    journal = directory / "journal.bin"   # in the middle of the run: rows are being written
    while not (journal.exists() and journal.stat().st_size > 8192) and process.poll() is None:
        time.sleep(0.001)
    shutil.rmtree(directory, ignore_errors=True)
    text, _ = process.communicate(timeout=240)
    check("the output directory vanishes", process.returncode == 3 and "cannot" in text and str(directory) in text, f"exit code {process.returncode}: {text[-800:]}")


def wrong_run(work):
    directory = work / "other"
    expect("a run stopped early", run("-o", directory, limit=120_000), 3, "cannot")
    before = sorted((p.name, p.stat().st_mtime_ns) for p in directory.iterdir())
    expect("resuming with other values", run("-o", directory, "--resume", "--set", "block.slider.velocity=[2,0,0]"), 2, "another scene")
    (work / "elsewhere").mkdir()
    (work / "elsewhere" / "thesis.txt").write_text("mine")
    expect("a directory with other files", run("-o", work / "elsewhere"), 2, "not results of Talus")
    expect("resuming where nothing ran", run("-o", work / "nothing", "--resume"), 2, "no run to go on with")
    after = sorted((p.name, p.stat().st_mtime_ns) for p in directory.iterdir())
    check("a refusal changes nothing", before == after and not (work / "nothing").exists())
    if (directory / "checkpoint.h5").exists():
        (directory / "journal.bin").rename(work / "journal.bin")
        expect("a journal that is gone", run("-o", directory, "--resume"), 2, "is missing", "without --resume")
        (work / "journal.bin").rename(directory / "journal.bin")
        bytes_ = bytearray((directory / "checkpoint.h5").read_bytes())
        bytes_[len(bytes_) // 2] ^= 1
        (directory / "checkpoint.h5").write_bytes(bytes_)
        expect("a damaged checkpoint", run("-o", directory, "--resume"), 2, "checksum")
    else:
        check("the stopped run left a checkpoint", False)


def finished(work):
    directory = work / "finished"
    expect("a run that ends", run("-o", directory), 0, "done at t = 0.4")
    stamp = (directory / "results.h5").stat().st_mtime_ns
    expect("resuming a finished run", run("-o", directory, "--resume"), 0, "has finished")
    check("nothing is computed again", (directory / "results.h5").stat().st_mtime_ns == stamp)
    (directory / "results.h5").rename(work / "elsewhere.h5")
    expect("a finished run without its results", run("-o", directory, "--resume"), 2, "missing or damaged", "without --resume")
    (work / "elsewhere.h5").rename(directory / "results.h5")
    check("its summary says so", json.loads((directory / "summary.json").read_text())["status"] == "done")


SMALL = """schema = 1
[simulation]
duration = "0.2 s"
[[plane]]
normal = [0, 0, 1]
point = [0, 0, 0]
material = "rock"
[[material]]
name = "rock"
density = 2500
[[interface]]
between = ["*", "*"]
friction = 0.5
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [1, 1, 1]
position = [0, 0, 0.6]
"""


def nothing_lost(work):
    """What a run reads it does not replace; of two runs one has the directory; whether anybody reads the warnings changes nothing."""
    small = work / "small.toml"
    small.write_text(SMALL)
    out = work / "own"
    expect("a small run", run("-o", out, of=small), 0)
    edited = SMALL.replace("0.6", "0.7")
    (out / "scene.toml").write_text(edited)
    expect("a run of the copy in its own directory", run("-o", out, of=out / "scene.toml"), 0)
    check("the copy is as it was edited", (out / "scene.toml").read_text() == edited and (out / "results.h5").exists())
    stamp = (out / "results.h5").stat().st_mtime_ns
    start = f"simulation.initial_state={out}/results.h5"
    expect("a run that starts from what it would replace", run("-o", out, "--set", start, of=small), 2, "would replace")
    handle = os.open(out, os.O_RDONLY)   # as a run holds it
    fcntl.flock(handle, fcntl.LOCK_EX)
    for name, more in (("a second run", ()), ("a second run that resumes", ("--resume",))):
        expect(name, run("-o", out, *more, of=small), 2, "another talus is writing there")
    report = subprocess.run([talus, "report", out], capture_output=True, text=True)
    check("a report meanwhile", report.returncode == 2 and "another talus" in report.stderr, report.stderr)
    os.close(handle)
    check("the first one's results stand", (out / "results.h5").stat().st_mtime_ns == stamp)
    joints = SMALL.split("[[block]]")[0] + """[rock_mass]
material = "rock"
box = { min = [0, 0, 0], max = [1, 1, 1] }
[[rock_mass.joint_set]]
name = "J"
orientation = "90/40"
spacing = "0.5 m"
"""
    (work / "joints.toml").write_text(joints)
    cut = subprocess.run([talus, "cut", work / "joints.toml", "-o", out], capture_output=True, text=True)
    check("cutting into a run's directory", cut.returncode == 2 and "results of a run" in cut.stderr and (out / "results.h5").exists(), cut.stderr)
    for name, scene_file, code in (("a message", work / "absent.toml", 2), ("a run", small, 0)):
        for stream, error in (("full", "/dev/full"), ("closed", None)):
            command = f'exec "{talus}" run "{scene_file}" -o "{work}/unheard" 2>' + (error or "&-")
            ended = subprocess.run(["sh", "-c", command], stdout=subprocess.DEVNULL)
            check(f"{name} where the error output is {stream}", ended.returncode == code, f"exit code {ended.returncode}")
    with open("/dev/full", "w") as disk:
        for words in (["check", small], ["explain", "--all"]):
            ended = subprocess.run([talus, *words], stdout=disk, stderr=subprocess.PIPE, text=True)
            check(f"{words[0]} whose words are lost", ended.returncode == 3 and "No space left" in ended.stderr, f"exit code {ended.returncode}: {ended.stderr}")


if __name__ == "__main__":
    talus = sys.argv[1]
    work = pathlib.Path(tempfile.mkdtemp(prefix="talus-disks-"))
    try:
        for test in (full_by_limit, verified, full_by_mount, read_only, vanished, wrong_run, finished, nothing_lost):
            test(work)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    print(f"{len(failures)} failures" if failures else "all as documented")
    sys.exit(1 if failures else 0)
