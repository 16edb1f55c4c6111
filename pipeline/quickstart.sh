#!/usr/bin/env bash
# From a fresh Debian 12 machine to pictures: installs the packages, builds, runs the main job on the quickstart scene.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

echo "1/3  packages"
bash pipeline/install_packages.sh

echo "2/3  build"
cmake --preset release >/dev/null
cmake --build build/release --target heddle

echo "3/3  configs/scenes/quickstart.toml"
build/release/heddle run configs/scenes/quickstart.toml -o out/quickstart
