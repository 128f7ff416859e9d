#!/usr/bin/env bash
# Installs Debian's Bullet and ODE and builds their drivers: bench/peers/build.sh DIRECTORY
set -euo pipefail
out=${1:?usage: bench/peers/build.sh DIRECTORY}
here=$(cd "$(dirname "$0")" && pwd)
packages=(libbullet-dev libode-dev python3-scipy)
missing=()
for p in "${packages[@]}"; do dpkg -s "$p" > /dev/null 2>&1 || missing+=("$p"); done
if [ ${#missing[@]} -gt 0 ]; then
  root=(); [ "$(id -u)" = 0 ] || root=(sudo)
  "${root[@]}" apt-get install -y --no-install-recommends "${missing[@]}"
fi
mkdir -p "$out"
flags="-std=c++20 -O3 -march=native -I$here"
g++ $flags -DBT_USE_DOUBLE_PRECISION "$here/bullet.cpp" -o "$out/bullet64" -I/usr/include/bullet \
  -lBulletDynamics-float64 -lBulletCollision-float64 -lLinearMath-float64
g++ $flags "$here/ode.cpp" -o "$out/ode" $(pkg-config --cflags --libs ode)
