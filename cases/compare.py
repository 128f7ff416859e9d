#!/usr/bin/env python3
"""Compares the figures of a case with its expected.toml; fails on a miss.

usage: compare.py CASE FIGURES.json [--reduced]      (CASE: a folder of cases/)

expected.toml lists [[figure]]:
  key        dotted path in FIGURES.json, e.g. "before.d"
  here       what we reached: a number, a text or a truth value
  tolerance  largest difference from `here` that passes (numbers); left out: equality. `at_most`, `at_least`: bounds in place of `here`
  paper      what the paper says, shown beside it; never compared
  source     where `here` or the bound comes from
  reduced    true: a figure of the reduced run; otherwise of the full one
"""
import json
import os
import sys
import tomllib


def find(figures, key):
    for part in key.split("."):
        figures = figures[int(part)] if isinstance(figures, list) else figures[part]
    return figures


def verdict(figure, value):
    if "at_most" in figure or "at_least" in figure:
        return isinstance(value, (int, float)) and figure.get("at_least", float("-inf")) <= value <= figure.get("at_most", float("inf"))
    if isinstance(figure["here"], bool) or isinstance(figure["here"], str):
        return value == figure["here"]
    return isinstance(value, (int, float)) and abs(value - figure["here"]) <= figure.get("tolerance", 0)


def expectation(figure):
    if "here" not in figure:
        return " and ".join(f"{word} {figure[key]:g}" for key, word in (("at_least", "at least"), ("at_most", "at most")) if key in figure)
    here = figure["here"]
    return f"{here:g} +- {figure.get('tolerance', 0):g}" if isinstance(here, (int, float)) and not isinstance(here, bool) else str(here)


def main():
    case, path = [a for a in sys.argv[1:] if not a.startswith("-")][:2]
    reduced = "--reduced" in sys.argv
    with open(os.path.join(case, "expected.toml"), "rb") as f:
        expected = [e for e in tomllib.load(f)["figure"] if e.get("reduced", False) == reduced]
    with open(path) as f:
        figures = json.load(f)
    misses = 0
    for e in expected:
        try:
            value = find(figures, e["key"])
        except (KeyError, IndexError, TypeError):
            value = None
        good = verdict(e, value)
        misses += not good
        shown = f"{value:.6g}" if isinstance(value, float) else str(value)
        paper = f"; paper: {e['paper']}" if "paper" in e else ""
        print(f"{'ok  ' if good else 'MISS'} {os.path.basename(os.path.normpath(case))} {e['key']}: {shown} {e.get('unit', '')} (expected {expectation(e)}{paper})")
    if not expected:
        print(f"MISS {case}: expected.toml lists no {'reduced' if reduced else 'full'} figure")
        misses = 1
    sys.exit(1 if misses else 0)


if __name__ == "__main__":
    main()
