#!/usr/bin/env bash
# Installs what the program and its tests need on Debian 12; the only list of packages. With --tests also the browser in which a
# test opens the page of a chart, clang-format and clang-tidy for tests/lint.sh. Does nothing where all of them are there already.
set -euo pipefail

packages=(
  g++ cmake ninja-build pkg-config
  libembree-dev libopenvdb-dev libboost-iostreams-dev libeigen3-dev libopenexr-dev libtbb-dev libosd-dev
  libtomlplusplus-dev libcli11-dev nlohmann-json3-dev libfmt-dev libpng-dev zlib1g-dev libxxhash-dev
  libgtest-dev libbenchmark-dev python3 python3-numpy
)

[[ ${1:-} == --tests ]] && packages+=(chromium clang-format-14 clang-tidy-14)

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query --show --showformat='${Status}' "$package" 2>/dev/null || true)
  [[ $status == "install ok installed" ]] || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

as_root=()
if [[ $(id -u) -ne 0 ]]; then as_root=(sudo); fi
echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
