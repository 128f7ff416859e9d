#!/bin/sh
# Runs every case, evaluates it, and compares its figures with its expected.toml.
#
# usage: cases/run_all.sh [--reduced] [--only CASE] [--talus PROGRAM] [--out DIR] [--jobs N]
#   --reduced   shorter and fewer runs, which show that every case still works (expected.toml has figures of their own)
#   --only      one case: a folder of cases/
#   --talus     the program (build/release/talus)
#   --out       where results go (results/cases)
#   --jobs      runs at a time (as many as there are cores); more than one: of one thread each, which changes no bit of their results
# Exit code 1 if a run fails or a figure misses.
set -u
here=$(cd "$(dirname "$0")" && pwd)
talus=$here/../build/release/talus out=results/cases reduced= only= jobs=$(nproc)
python=${PYTHON:-/usr/bin/python3}
while [ $# -gt 0 ]; do
  case $1 in
    --reduced) reduced=--reduced ;;
    --only) only=$2; shift ;;
    --talus) talus=$2; shift ;;
    --out) out=$2; shift ;;
    --jobs) jobs=$2; shift ;;
    *) sed -n '2,11p' "$0"; exit 2 ;;
  esac
  shift
done
mkdir -p "$out"
failures=0
threads=$([ "$jobs" -gt 1 ] && echo "--threads 1")
runs=$(mktemp) || exit 1
trap 'rm -f "$runs"' EXIT

# run NAME SCENE [options]: one of the runs to be made (no blanks in any)
run() { [ $pass = judge ] || echo "$*${threads:+ $threads}" >> "$runs"; }   # a blank at the end would join two lines

# judge CASE PROGRAM [arguments]: once all have run, evaluates into CASE.json and compares
judge() {
  [ $pass = judge ] || return 0
  case_=$1; shift
  echo "--- $case_"
  "$python" "$@" -o "$out/$case_.json" && "$python" "$here/compare.py" "$here/$case_" "$out/$case_.json" $reduced || failures=$((failures + 1))
}

wanted() { [ -z "$only" ] || [ "$only" = "$1" ]; }
span() { [ -n "$reduced" ] && echo "$2" || echo "$1"; }   # full or reduced value

every_case() {
  # The longest first, so that no core waits for one of them at the end.
  for case in k4580-viaduct-damage k4580-boulder k4580-rock-mass; do
    wanted $case || continue
    directories=
    if [ $case = k4580-viaduct-damage ] && [ -z "$reduced" ]; then
      run $case-rocks $case/rock-mass-deep.toml
      directories=$out/$case-rocks
    fi
    for slope in $(span "shallow deep before" "deep"); do
      case $case in
        k4580-boulder) short="--set simulation.duration=8" ;;
        k4580-rock-mass) short="--set simulation.duration=0.2" ;;
        *) short="--set simulation.duration=0.06 --set structure.viaduct.cell_size=0.5 --set block.boulder.position=[0,108,14.1] --set block.boulder.velocity=[0,5,-11]" ;;   # just above the deck
      esac
      run "$case-$slope" "$case/$slope.toml" $(span "" "$short")
      directories="$out/$case-$slope $directories"
    done
    case $case in
      k4580-viaduct-damage) judge $case "$here/k4580/evaluate_damage.py" $directories ;;
      *) judge $case "$here/k4580/evaluate.py" "${case#k4580-}" $directories ;;
    esac
  done

  if wanted lab-14-blocks; then
    directories=
    for run_ in $(span "a-20 a-25 a-30 a-35 a-40 a-45 a-50 b-20 b-25 b-30 b-35 b-40 b-45 b-50" "a-20 a-30 b-50"); do
      run "lab-$run_" "lab-14-blocks/$run_.toml" $(span "" "--set simulation.duration=$([ "$run_" = a-20 ] && echo 0.2 || echo 0.15)")
      directories="$directories $out/lab-$run_"
    done
    judge lab-14-blocks "$here/lab-14-blocks/evaluate.py" $directories
  fi

  for case in wanzhou-trajectories wanzhou-energy; do
    wanted $case || continue
    run "$case-physical" "$case/physical.toml" $(span "" "--set simulation.duration=0.6")
    run "$case-1988" "$case/paper.toml" $(span "" "--set simulation.duration=0.3")
    judge $case "$here/wanzhou-trajectories/evaluate.py" $([ $case = wanzhou-energy ] && echo --energy) "$out/$case-physical" "$out/$case-1988"
  done

  if wanted tirol-pier; then
    run tirol-pier tirol-pier/scene.toml $(span "" "--set simulation.duration=5.0")
    judge tirol-pier "$here/tirol-pier/evaluate.py" "$out/tirol-pier"
  fi

  if wanted viaduct-impact; then
    run viaduct-impact viaduct-impact/scene.toml $(span "" "--set simulation.duration=0.18 --set structure.viaduct.cell_size=0.5")
    judge viaduct-impact "$here/viaduct-impact/evaluate.py" "$out/viaduct-impact"
  fi

  if wanted protective-gallery; then
    run gallery-bare protective-gallery/bare.toml $(span "" "--set simulation.duration=0.01")
    run gallery-cushion protective-gallery/cushion.toml $(span "" "--set simulation.duration=0.06")
    judge protective-gallery "$here/protective-gallery/evaluate.py" "$out/gallery-bare" "$out/gallery-cushion"
  fi

  if wanted pier-destruction; then
    run pier-destruction pier-destruction/scene.toml $(span "" "--set simulation.duration=0.2 --set structure.pier.cell_size=0.6")
    judge pier-destruction "$here/pier-destruction/evaluate.py" "$out/pier-destruction"
  fi

  if wanted experiments; then
    judge experiments "$here/experiments/evaluate.py" --talus "$talus" --out "$out/experiments" --jobs "$jobs" $reduced
  fi
}

pass=run
every_case
xargs -r -L 1 -P "$jobs" "$here/run_one.sh" "$talus" "$out" < "$runs"
while read -r name _; do
  [ ! -e "$out/$name.failed" ] || failures=$((failures + 1))
done < "$runs"
pass=judge
every_case

[ $failures = 0 ] && echo "every case ran and every figure holds" || echo "$failures failures"
[ $failures = 0 ]
