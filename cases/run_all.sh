#!/bin/sh
# Runs every case of the paper and evaluates it.
#
# usage: cases/run_all.sh [--reduced] [TALUS] [OUT]
#   --reduced   shorter and fewer runs, to show that every case still works (not the cases' results)
#   TALUS       the program (build/release/talus)
#   OUT         where results go (results/cases)
set -u
reduced=0
if [ "${1:-}" = "--reduced" ]; then reduced=1; shift; fi
here=$(cd "$(dirname "$0")" && pwd)
talus=${1:-$here/../build/release/talus}
out=${2:-results/cases}
python=${PYTHON:-/usr/bin/python3}
mkdir -p "$out"
failures=0

# run NAME SCENE [options]: a run that fails is told and counted, the others go on
run() {
  name=$1; scene=$2; shift 2
  if "$talus" run "$here/$scene" -o "$out/$name" "$@" > "$out/$name.log" 2>&1; then
    echo "$name: $(grep ' at t = ' "$out/$name.log" | tail -1)"
  else
    code=$?
    echo "$name: exit code $code: $(grep -v '^ ' "$out/$name.log" | head -3 | tr '\n' ' ')"
    case $name in *-1988*) ;; *) failures=$((failures + 1)) ;; esac   # the 1988 scheme's failures are part of the comparison
  fi
}
evaluate() {
  echo "--- $1"; shift
  "$python" "$@" || failures=$((failures + 1))
}

if [ $reduced = 1 ]; then angles="20 30 50"; lab="0.2 s"; fall="1 s"; fall10="3 s"; boulder="12 s"; mass="1 s"; damage="0.1 s"; else
  angles="20 25 30 35 40 45 50"; lab="0.3 s"; fall="2 s"; fall10="6 s"; boulder="38 s"; mass="38 s"; damage="26 s"; fi

for reading in a b; do
  for angle in $angles; do run "lab-$reading-$angle" "lab-14-blocks/$reading-$angle.toml" --set "simulation.duration=$lab"; done
done
evaluate "lab-14-blocks" "$here/lab-14-blocks/evaluate.py" "$out"/lab-[ab]-[0-9][0-9]

run wanzhou-physical wanzhou-trajectories/physical.toml --set "simulation.duration=$fall"
run wanzhou-1988 wanzhou-trajectories/paper.toml --set "simulation.duration=$fall"
evaluate "wanzhou-trajectories" "$here/wanzhou-trajectories/evaluate.py" "$out/wanzhou-physical" "$out/wanzhou-1988"
run wanzhou-energy-physical wanzhou-energy/physical.toml --set "simulation.duration=$fall10"
run wanzhou-energy-1988 wanzhou-energy/paper.toml --set "simulation.duration=$fall10"
evaluate "wanzhou-energy" "$here/wanzhou-trajectories/evaluate.py" --energy "$out/wanzhou-energy-physical" "$out/wanzhou-energy-1988"

for case in boulder rock-mass; do
  seconds=$boulder; [ $case = rock-mass ] && seconds=$mass
  for slope in before shallow deep; do run "k4580-$case-$slope" "k4580-$case/$slope.toml" --set "simulation.duration=$seconds"; done
  evaluate "k4580-$case" "$here/k4580/evaluate.py" $case "$out/k4580-$case-before" "$out/k4580-$case-shallow" "$out/k4580-$case-deep" -o "$out/k4580-$case.json"
done
"$talus" cut "$here/k4580-rock-mass/before.toml" -o "$out/k4580-cut" || failures=$((failures + 1))

run k4580-viaduct-damage k4580-viaduct-damage/shallow.toml --set "simulation.duration=$damage"

[ $failures = 0 ] && echo "every case ran" || echo "$failures failures"
[ $failures = 0 ]
