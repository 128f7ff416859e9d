#!/usr/bin/env bash
# Writes the tables and plots of docs/results/ anew, suite by suite: results.sh BUILD
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
for suite in dda fem coupling stability invariants; do
  out=$build/verify-$suite
  code=0
  SECONDS=0
  "$build/talus" verify "$suite" -o "$out" > "$out.txt" || code=$?
  # 1: a row fell short, which its table tells. Anything else is no result, and must not pass for one.
  if [ "$code" -gt 1 ]; then
    told="code $code"
    [ "$code" -le 128 ] || told="signal $((code - 128)) ($(kill -l "$code"))"
    echo "talus verify $suite ended by $told; the last it told:" >&2
    tail -1 "$out.txt" >&2
    exit "$code"
  fi
  echo "$suite: $(grep ' passed, ' "$out.txt"), $SECONDS s"
  python3 docs/results/tables.py "$out/verify.json" "docs/results/verification-$suite.md" "$suite"
  for plot in "$out"/*.svg; do
    [ ! -e "docs/results/${plot##*/}" ] || cp "$plot" docs/results/
  done
done
