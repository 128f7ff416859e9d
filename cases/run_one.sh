#!/bin/sh
# One run of run_all.sh, which calls it: run_one.sh TALUS OUT NAME SCENE [options]. Prints how it ended; a run that fails leaves OUT/NAME.failed.
talus=$1 out=$2 name=$3 scene=$4
shift 4
rm -f "$out/$name.failed"
if "$talus" run "$(dirname "$0")/$scene" -o "$out/$name" "$@" > "$out/$name.log" 2>&1; then
  echo "$name: $(grep ' at t = ' "$out/$name.log" | tail -1)"
else
  code=$?
  echo "$name: exit code $code: $(grep -v '^ ' "$out/$name.log" | head -3 | tr '\n' ' ')"
  case $name in *-1988*) ;; *) : > "$out/$name.failed" ;; esac   # the 1988 scheme's failures are part of the comparison
fi
exit 0
