#!/usr/bin/env bash
# clang-format at 110 columns over all C++ files: format.sh check | fix
#   check   fails if a file is not formatted, and names it
#   fix     formats all
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-format >/dev/null || { echo "clang-format is not installed (packages.txt)" >&2; exit 77; }
mapfile -t files < <(
  find src tests bench python \( -name '*.cpp' -o -name '*.hpp' -o -name '*.inc' \) | LC_ALL=C sort)
unformatted() {
  printf '%s\0' "${files[@]}" | xargs -0 -n 20 -P "$(nproc)" \
    sh -c 'for f; do clang-format --dry-run -Werror "$f" >/dev/null 2>&1 || echo "$f"; done' _ | LC_ALL=C sort
}
case "${1:-check}" in
  check)
    bad=$(unformatted)
    [ -z "$bad" ] || { printf '%s is not formatted: make format\n' $bad; exit 1; }
    echo "${#files[@]} files checked, all formatted"
    ;;
  fix) printf '%s\0' "${files[@]}" | xargs -0 -n 40 -P "$(nproc)" clang-format -i ;;
  *) sed -n 2,4p "$0"; exit 2 ;;
esac
