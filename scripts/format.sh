#!/usr/bin/env bash
# clang-format at 110 columns: format.sh check | fix | baseline
#   check     fails if a file that is not listed in scripts/unformatted.txt is not formatted, or one that is listed now is
#   fix       formats those that are not listed, and the lines that differ from HEAD in those that are
#   baseline  writes the list anew: for a merge that brings many files at once
# The list may only get shorter: whoever has a listed file to change formats it and takes it off.
set -euo pipefail
cd "$(dirname "$0")/.."
list=scripts/unformatted.txt
command -v clang-format >/dev/null || { echo "clang-format is not installed (packages.txt)" >&2; exit 77; }
mapfile -t files < <(find src tests bench python -name '*.cpp' -o -name '*.hpp' -o -name '*.inc' | LC_ALL=C sort)
unformatted() { printf '%s\0' "$@" | xargs -0 -r -n 20 -P "$(nproc)" sh -c 'for f; do clang-format --dry-run -Werror "$f" >/dev/null 2>&1 || echo "$f"; done' _ | LC_ALL=C sort; }
mapfile -t unlisted < <(printf '%s\n' "${files[@]}" | grep -vxF -f <(grep -v '^#' "$list" 2>/dev/null || true) || true)
case "${1:-check}" in
  check)
    bad=$(unformatted "${unlisted[@]}")
    gone=$(grep -v '^#' "$list" | while read -r f; do [ -e "$f" ] || echo "$f"; done)
    [ -z "$gone" ] || printf '%s: no such file, take it off %s\n' $(for f in $gone; do echo "$f" "$list"; done)
    [ -z "$bad" ] || { printf '%s is not formatted: make format\n' $bad; exit 1; }
    [ -z "$gone" ] || exit 1
    echo "${#unlisted[@]} of ${#files[@]} files checked, all formatted"
    ;;
  fix)
    [ ${#unlisted[@]} -eq 0 ] || clang-format -i "${unlisted[@]}"
    git clang-format --quiet HEAD -- src tests bench python || true
    ;;
  baseline)
    { echo "# Files that are not formatted yet (scripts/format.sh). Only ever shorter."; unformatted "${files[@]}"; } > "$list.new"
    mv "$list.new" "$list"
    echo "$(grep -vc '^#' "$list") of ${#files[@]} files are not formatted"
    ;;
  *) sed -n 2,6p "$0"; exit 2 ;;
esac
