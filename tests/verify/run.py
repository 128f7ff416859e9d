#!/usr/bin/env python3
"""A suite of `talus verify`: rows that fall short are those that its page in docs/results names, and no other.

    run.py TALUS SUITE PAGE OUT [--full]    quick rows, or all: of those the page may name none that holds
"""
import json
import pathlib
import re
import subprocess
import sys

talus, suite, page, out = sys.argv[1:5]
full = sys.argv[5:] == ["--full"]
command = [talus, "verify", suite, "-o", out] + ([] if full else ["--quick"])
run = subprocess.run(command, capture_output=True, text=True)
print(run.stdout + run.stderr)
if run.returncode not in (0, 1):
    sys.exit(f"{' '.join(command)} ended with {run.returncode}")
results = json.loads((pathlib.Path(out) / "verify.json").read_text())["results"]
short = {r["id"] for r in results if r["judged"] and not r["passed"]}
if (run.returncode == 1) != bool(short) or not results:
    sys.exit(f"{len(results)} rows, {len(short)} cases short, and yet exit code {run.returncode}")
section = re.search(r"What falls short.*?(?=\n[^-\n]|\Z)", pathlib.Path(page).read_text(), re.S)
named = set(re.findall(r"^- \*\*(\w+)\*\*", section.group() if section else "", re.M))
print(f"falls short: {sorted(short)}, named in {page}: {sorted(named)}")
if short - named:
    sys.exit(f"falls short, and the page does not say so: {sorted(short - named)}")
if full and named - short:
    sys.exit(f"holds, and the page says that it falls short: {sorted(named - short)}")
