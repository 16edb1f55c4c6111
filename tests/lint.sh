#!/usr/bin/env bash
# Checks of the source text:
#   tests/lint.sh                  clang-format on every file
#   tests/lint.sh FILE…            clang-tidy on these .cpp files, half a minute each
#   tests/lint.sh --all            clang-tidy on everything, many files as one
#   tests/lint.sh --since REV      clang-tidy on what changed since a revision; the .cpp file stands for its header. Up to 8 files:
#                                  after larger changes use --all by hand
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

most=8

sources() { find formats fibers precompute render pipeline tests \( -name '*.cpp' -o -name '*.h' -o -name '*.c' \) -print | sort; }

changed_since() {
  git diff --name-only --diff-filter=d "$1" -- formats fibers precompute render pipeline tests | sed -n 's/\.h$/.cpp/p; /\.cpp$/p' |
    sort -u | while read -r file; do if [[ -f $file ]]; then echo "$file"; fi; done
}

# Compile commands without precompiled headers, which are in GCC's own form. Warnings stay warnings.
configure() { env -u CI cmake --preset release -B "$1" -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -D CMAKE_UNITY_BUILD="$2" >/dev/null; }

# tidy FOLDER OPTION…: clang-tidy on the files that standard input names.
tidy() {
  xargs -P "$(nproc)" -n 1 clang-tidy-14 -p "$1" --quiet --warnings-as-errors='*' --extra-arg=-Wno-unknown-warning-option "${@:2}" \
    2> >(grep -v 'warnings generated' >&2)
}

case ${1-} in
  "")
    echo "clang-format"
    sources | xargs clang-format-14 --dry-run --Werror
    exit ;;
  --all)
    configure build/tidy-all ON
    echo "clang-tidy on everything"
    find build/tidy-all -name 'unity_*.cxx' | sort |
      tidy build/tidy-all --header-filter='/(formats|fibers|precompute|render|pipeline|tests)/' --checks=-bugprone-suspicious-include
    exit ;;
  --since)
    files=$(changed_since "$2")
    count=$(grep -c . <<<"$files" || true)
    if [[ $count -gt $most ]]; then
      echo "clang-tidy: $count files changed since $2, more than $most: not run"
      exit
    fi ;;
  *) files=$(printf '%s\n' "$@") ;;
esac
[[ -n $files ]] || exit 0

configure build/tidy OFF
echo "clang-tidy on $(wc -l <<<"$files") files"
tidy build/tidy <<<"$files"
