#!/usr/bin/env python3
"""Checks the pages: links lead somewhere, nothing outside docs/decisions names a decision by number or a build by its commit, the
decisions are few and indexed, CONTRIBUTING.md names files that exist, and what pages and comments cite stands in docs/references.bib.

    pages.py REPOSITORY    checks a source tree
    pages.py --self-test   plants faults and checks that each is seen
"""
import pathlib
import re
import sys
import tempfile

LINK = re.compile(r"\]\(([^)\s]+)\)")
NUMBERED = re.compile(r"\bdecisions?[ /]+0?\d{3,4}\b", re.IGNORECASE)
COMMIT = re.compile(r"(?<![.\w-])(?=[0-9]*[a-f])(?=[a-f]*[0-9])(?![0-9]+e[0-9]+)[0-9a-f]{7,8}(?![\w.+-])")
BUILD = re.compile(r"\b(builds? (of|by) [0-9a-f]{6,}|by (an?|the) (earlier|former|later) build|the build before|by earlier builds)\b")
MOST_DECISIONS = 35
FILE = re.compile(r"`([\w./*-]+\.(?:cpp|hpp|py|supp)|(?:src|tests|docs|report|scripts|python)/[\w./*-]*)`")
GROUP = re.compile(r"\[([^\[\]]*)\]")
CITATION = re.compile(r"[a-z]+(?:-[a-z]+)*(?:18|19|20)\d\d[a-z]?")


def texts(root):
    """Files that a reader may see: pages, sources, scripts; (path, whether it is a page)."""
    for path in sorted(root.rglob("*")):
        parts = path.relative_to(root).parts
        if not path.is_file() or {".git", "build", "results", "node_modules", "corpus"} & set(parts[:-1]) and parts[0] != "docs":
            continue
        if path.suffix == ".md":
            yield path, True
        elif path.suffix in {".cpp", ".hpp", ".inc", ".py", ".ts", ".toml", ".sh", ".mjs"} and parts[0] in {"src", "tests", "bench", "cases", "report", "scripts", "python"}:
            yield path, False


def missing_files(root, text):
    """Names in backticks that no file of the tree has; a name alone may be anywhere in it."""
    for name in FILE.findall(text):
        anywhere = () if "/" in name else (path for folder in ("src", "tests", "python") for path in (root / folder).rglob(name))
        if not any(root.glob(name.rstrip("/"))) and not any(True for _ in anywhere):
            yield name


def cited(line):
    """Keys of references in square brackets: [leine2014], [fib2013, 5.1; mander1988]."""
    for group in GROUP.findall(line):
        yield from (part for part in re.split(r"[,;]\s*", group) if CITATION.fullmatch(part))


def problems(root):
    found = []
    bibliography = root / "docs/references.bib"
    known = set(re.findall(r"@\w+\{([\w-]+),", bibliography.read_text(encoding="utf-8"))) if bibliography.exists() else set()
    contributing = root / "CONTRIBUTING.md"
    if contributing.exists():
        found += [f"CONTRIBUTING.md: no file {name}" for name in missing_files(root, contributing.read_text(encoding="utf-8"))]
    decisions = root / "docs/decisions"
    for path, page in texts(root):
        if path.name == "pages.py":
            continue
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            continue   # inputs of tests may be in any encoding
        decided = decisions in path.parents
        for number, line in enumerate(lines, 1):
            place = f"{path.relative_to(root)}:{number}"
            if not decided and NUMBERED.search(line):
                found.append(f"{place}: names a decision by its number")
            if page and (BUILD.search(line) or COMMIT.search(re.sub(r"\([^)]*\)|`[^`]*`", "", line))):
                found.append(f"{place}: names a build")
            if page or line.lstrip().startswith("//"):
                found += [f"{place}: docs/references.bib has no {key}" for key in cited(line) if key not in known]
            if not page:
                continue
            for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
                file = target.split("#")[0]
                if file and ":" not in file and not (path.parent / file).exists():
                    found.append(f"{place}: no file {target}")
    pages = sorted(p.name for p in decisions.glob("*.md") if p.name != "README.md")
    if len(pages) > MOST_DECISIONS:
        found.append(f"docs/decisions: {len(pages)} pages, at most {MOST_DECISIONS}: merge by topic")
    index = (decisions / "README.md").read_text(encoding="utf-8") if (decisions / "README.md").exists() else ""
    found += [f"docs/decisions/README.md: does not list {name}" for name in pages if f"({name})" not in index]
    return found


def self_test():
    planted = {
        "docs/a.md": "See [b](b.md).",
        "docs/c.md": "As decision 0012 says.",
        "docs/d.md": "Measured by ca10d80, 3 s.",
        "docs/e.md": "The build before took 3 s; by the build of 3.",
        "src/f.cpp": "// decision 0007",
        "src/h.hpp": "/// After [nobody1999, 3.2].",
        "CONTRIBUTING.md": "Start at `gone.hpp`.",
        "docs/decisions/g.md": "# Not in the index",
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in planted.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text.replace("The build", "Here the build") + "\n", encoding="utf-8")
        told = problems(root)
    for name in planted:
        if not any(name in t or pathlib.Path(name).name in t for t in told):
            sys.exit(f"not seen: {name}\n" + "\n".join(told))
    print(f"{len(planted)} planted faults seen")


if __name__ == "__main__":
    if sys.argv[1] == "--self-test":
        self_test()
    else:
        told = problems(pathlib.Path(sys.argv[1]).resolve())
        print("\n".join(told))
        sys.exit(1 if told else 0)
