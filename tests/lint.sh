#!/usr/bin/env bash
# Checks of the source text. Without arguments: clang-format on every file, which CI demands. With files, or --all: clang-tidy on
# them, half a minute each (apt-get install clang-tidy-14).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sources() { find formats fibers precompute render pipeline tests \( -name '*.cpp' -o -name '*.h' -o -name '*.c' \) -print | sort; }

if [[ $# -eq 0 ]]; then
  echo "clang-format"
  sources | xargs clang-format-14 --dry-run --Werror
  exit
fi

# Compile commands without precompiled headers, which are in GCC's own form.
cmake --preset release -B build/tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
if [[ $1 == --all ]]; then files=$(sources | grep '\.cpp$'); else files=$(printf '%s\n' "$@"); fi
echo "clang-tidy on $(wc -l <<<"$files") files"
xargs -P "$(nproc)" -n 1 clang-tidy-14 -p build/tidy --quiet --warnings-as-errors='*' <<<"$files" 2> >(grep -v 'warnings generated' >&2)
