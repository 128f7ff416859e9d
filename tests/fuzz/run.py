#!/usr/bin/env python3
"""Fuzzes targets for a given CPU time each, and tells executions, coverage and findings.

    run.py BUILD [TARGET...] [--minutes 10] [--keep]

BUILD is the directory of the preset "fuzz". New inputs gather in BUILD/corpus/TARGET, what crashes in BUILD/findings/TARGET, figures in
BUILD/fuzz-TARGET.json, from which a run that was stopped goes on. With --keep, inputs that reach new code go into tests/fuzz/corpus, the smallest that do.
"""
import argparse
import json
import pathlib
import re
import resource
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
TARGETS = ["scene", "structure_mesh", "mesh", "grid", "table", "journal", "checkpoint"]
SEGMENT = 120        # wall seconds between two looks at the clock
SLOW = 60            # wall seconds that no input may take, on a crowded machine
MOST_FINDINGS = 5


def dictionary(build):
    """The keys of a scene, as words for the fuzzer."""
    words = sorted(set(re.findall(r"`([a-z_]+)`", (HERE.parents[1] / "docs/scene.md").read_text())))
    file = build / "scene.dict"
    file.write_text("".join(f'"{w}"\n' for w in words))
    return file


def cpu():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def fuzz(build, target, seconds):
    program, corpus, findings = build / f"talus_fuzz_{target}", build / "corpus" / target, build / "findings" / target
    for folder in (corpus, findings):
        folder.mkdir(parents=True, exist_ok=True)
    words = [f"-dict={dictionary(build)}"] if target == "scene" else []
    figures = build / f"fuzz-{target}.json"
    record = {"target": target, "cpu_seconds": 0.0, "executions": 0, "edges": 0, "features": 0, "inputs": 0, "findings": 0}
    if figures.exists():
        record = json.loads(figures.read_text())
    start = cpu() - record["cpu_seconds"]
    while record["cpu_seconds"] < seconds and record["findings"] < MOST_FINDINGS:
        run = subprocess.run([program, f"-max_total_time={SEGMENT}", f"-timeout={SLOW}", f"-report_slow_units={SLOW}", "-rss_limit_mb=2048", "-print_final_stats=1", f"-artifact_prefix={findings}/", *words,
                              corpus, HERE / "corpus" / target], capture_output=True, text=True, errors="replace")
        (build / f"fuzz-{target}.log").write_text(run.stderr)
        record["executions"] += max([int(n) for n in re.findall(r"^#(\d+)", run.stderr, re.M)], default=0)
        for edges, features in re.findall(r"cov: (\d+) ft: (\d+)", run.stderr)[-1:]:
            record["edges"], record["features"] = int(edges), int(features)
        record["cpu_seconds"] = round(cpu() - start, 1)
        record["inputs"], record["findings"] = len(list(corpus.iterdir())), len(list(findings.iterdir()))
        figures.write_text(json.dumps(record) + "\n")
    return record


def keep(build, target):
    """The smallest inputs that reach what the kept corpus does not."""
    subprocess.run([build / f"talus_fuzz_{target}", "-merge=1", HERE / "corpus" / target, build / "corpus" / target], check=True, capture_output=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="of: " + ", ".join(TARGETS))
    parser.add_argument("--minutes", type=float, default=10, help="of CPU time, each target")
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    if unknown := set(options.targets) - set(TARGETS):
        parser.error(f"no such target: {', '.join(sorted(unknown))}")
    findings = 0
    for target in options.targets or TARGETS:
        record = fuzz(options.build.resolve(), target, 60 * options.minutes)
        findings += record["findings"]
        print("{target}: {executions} executions in {cpu_seconds} s of CPU time, {edges} edges, {features} features, {inputs} inputs, {findings} findings".format(**record), flush=True)
        if options.keep:
            keep(options.build.resolve(), target)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
