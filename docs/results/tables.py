#!/usr/bin/env python3
"""Turns verify.json into Markdown tables.

    tables.py verify.json                 prints them
    tables.py verify.json PAGE.md SUITE   puts those of one suite below the line "<!-- generated -->" of the page
"""
import json
import sys


def show(x, form):
    return "" if x is None else format(x, form)


def tables(report, suite=None):
    lines = ["| | case | method | quantity | expected | measured | error | allowed | order | CPU s | last resort |", "|---|---|---|---|---|---|---|---|---|---|---|"]
    cases = set()
    for r in report["results"]:
        if suite and r["suite"] != suite:
            continue
        cases.add(r["id"])
        verdict = "absent" if not r["available"] else "pass" if r["passed"] else "**short**" if r["judged"] else "differs"
        last = r["solutions"]["convex"] if r["solutions"]["convex"] and r["judged"] else ""
        lines.append(f"| {verdict} | {r['id']} | {r['method']} | {r['quantity']} | {show(r['expected'], '.8g')} | {show(r['measured'], '.8g')} | {show(r['error'], '.2e')} "
                     f"| {show(r['tolerance'], '.0e')} | {show(r['order'], '.2f')} | {r['cpu_seconds']:.3f} | {last} |")
    curves = [p for p in report["curves"] if not suite or p["id"] in cases]
    if curves:
        lines += ["", "| case | method | parameter | error | CPU s |", "|---|---|---|---|---|"]
    for p in curves:
        error = "failed" if p["failed"] or p["error"] is None else f"{p['error']:.2e}"
        lines.append(f"| {p['id']} | {p['method']} | {p['parameter']:g} | {error} | {p['cpu_seconds']:.4f} |")
    return "\n".join(lines) + "\n"


MARK = "<!-- generated -->\n"
report = json.load(open(sys.argv[1], encoding="utf-8"))
if len(sys.argv) == 2:
    print(tables(report), end="")
else:
    page, suite = sys.argv[2:4]
    text = open(page, encoding="utf-8").read()
    if MARK not in text:
        sys.exit(f"{page} has no line {MARK.strip()}")
    open(page, "w", encoding="utf-8").write(text[:text.index(MARK) + len(MARK)] + "\n" + tables(report, suite))
