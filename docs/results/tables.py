#!/usr/bin/env python3
"""Turns verify.json into Markdown tables: tables.py verify.json > table.md"""
import json
import sys

results = json.load(open(sys.argv[1], encoding="utf-8"))
print("| | case | method | quantity | expected | measured | error | allowed | order | CPU s | last resort |")
print("|---|---|---|---|---|---|---|---|---|---|---|")
for r in results["results"]:
    verdict = "absent" if not r["available"] else "pass" if r["passed"] else "**short**" if r["judged"] else "differs"
    show = lambda x, f: "" if x is None else format(x, f)
    print(f"| {verdict} | {r['id']} | {r['method']} | {r['quantity']} | {show(r['expected'], '.8g')} | {show(r['measured'], '.8g')} | {show(r['error'], '.2e')} "
          f"| {show(r['tolerance'], '.0e')} | {show(r['order'], '.2f')} | {r['cpu_seconds']:.3f} | {r['tiers']['e'] if r['tiers']['e'] and r['judged'] else ''} |")
if results["curves"]:
    print("\n| case | method | parameter | error | CPU s |\n|---|---|---|---|---|")
    for p in results["curves"]:
        error = "failed" if p["failed"] or p["error"] is None else f"{p['error']:.2e}"
        print(f"| {p['id']} | {p['method']} | {p['parameter']:g} | {error} | {p['cpu_seconds']:.4f} |")
