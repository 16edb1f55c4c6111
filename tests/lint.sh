#!/usr/bin/env bash
# Checks of the source text: clang-format on every file, clang-tidy on the files given, or else on those that differ from the
# commit before (at most 16, evenly chosen: a file takes half a minute). `tests/lint.sh --all` runs clang-tidy on everything.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sources() { find formats fibers precompute render pipeline tests \( -name '*.cpp' -o -name '*.h' -o -name '*.c' \) -print | sort; }

echo "clang-format"
sources | xargs clang-format-14 --dry-run --Werror

# Compile commands without precompiled headers, which are in GCC's own form.
cmake --preset release -B build/tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null

if [[ ${1:-} == --all ]]; then
  files=$(sources | grep '\.cpp$')
elif [[ $# -gt 0 ]]; then
  files=$(printf '%s\n' "$@")
else
  changed=$(git diff --name-only --diff-filter=d HEAD~1 -- '*.cpp' 2>/dev/null || true)
  files=$(awk -v most=16 '{line[NR] = $0} END {n = NR < most ? NR : most; for (k = 0; k < n; ++k) print line[1 + int(k * NR / n)]}' <<<"$changed")
  [[ -n $changed ]] || files=""
fi
[[ -n $files ]] || exit 0
echo "clang-tidy on $(wc -l <<<"$files") files"
xargs -P "$(nproc)" -n 1 clang-tidy-14 -p build/tidy --quiet --warnings-as-errors='*' <<<"$files" 2> >(grep -v 'warnings generated' >&2)
