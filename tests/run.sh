#!/usr/bin/env bash
# Installs the packages, builds everything and runs every test. The last line is ctest's.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash pipeline/install_packages.sh --tests
cmake --preset release >/dev/null
cmake --build build/release
ctest --test-dir build/release --output-on-failure -j "$(nproc)" "$@"
