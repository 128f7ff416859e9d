#!/usr/bin/env bash
# clang-tidy: lint.sh BUILD all | lint.sh BUILD changed [BASE]
# "changed" takes the sources that differ from BASE (main's merge base with HEAD, else the commit before),
# headers by the sources that include them.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1 which=${2:-all}
command -v clang-tidy >/dev/null || { echo "clang-tidy is not installed (packages.txt)" >&2; exit 77; }
[ -f "$build/compile_commands.json" ] ||
  { echo "$build has no compile_commands.json: make build" >&2; exit 2; }
if [ "$which" = changed ]; then
  base=${3:-$(git merge-base HEAD origin/main 2>/dev/null || true)}
  [ -n "$base" ] && [ "$(git rev-parse "$base")" != "$(git rev-parse HEAD)" ] || base=HEAD~1
  mapfile -t touched < <({
    git diff --name-only --diff-filter=d "$base" -- src
    git ls-files --others --exclude-standard -- src
  } | sort -u)
  files=()
  for f in "${touched[@]}"; do
    case "$f" in
      *.cpp) files+=("$f") ;;
      # One source that includes it stands for a header: clang-tidy reports headers by HeaderFilterRegex.
      *.hpp)
        user=$({ grep -rl --include="*.cpp" "\"${f#src/}\"" src || true; } | sed -n 1p)
        [ -z "$user" ] || files+=("$user") ;;
    esac
  done
  mapfile -t files < <(printf '%s\n' "${files[@]}" | sed '/^$/d' | sort -u)
else
  mapfile -t files < <(find src -name '*.cpp' | sort)
fi
[ ${#files[@]} -gt 0 ] || { echo "nothing to look at"; exit 0; }
# Without the headers that GCC has precompiled: a file is read with those that it names.
commands=$(mktemp -d)
trap 'rm -rf "$commands"' EXIT
sed -E 's| -Winvalid-pch -include [^ ]*/cmake_pch\.hxx||' "$build/compile_commands.json" \
  > "$commands/compile_commands.json"
echo "clang-tidy: ${#files[@]} files"
# -fopenmp and the like are GCC's; unknown warnings of another compiler are no findings.
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "${JOBS:-$(nproc)}" clang-tidy -p "$commands" --quiet \
  --extra-arg=-Wno-unknown-warning-option --extra-arg=-Wno-unused-command-line-argument 2>/dev/null
