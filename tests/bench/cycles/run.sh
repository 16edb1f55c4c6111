#!/usr/bin/env bash
# An outside yardstick: the same fibers, light and view in Blender's Cycles (Principled Hair on curves), in our path tracer and in
# our fast method; processor time per sample, noise of a sample, and their product. Needs the Debian package blender (and
# python3-numpy), which nothing else here does. Figures: docs/performance.md.
#
#   tests/bench/cycles/run.sh [FABRIC.toml] [OUTPUT_FOLDER]
#   PIXELS=128 SPP=32 TILES=4 BOUNCES=12 in the environment; a few minutes of one core
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
root="$(cd "$here/../../.." && pwd)"
heddle="$root/build/release/heddle"
fabric="$(realpath "${1:-$here/fabric.toml}")"
out="${2:-out/cycles}"
pixels="${PIXELS:-128}" spp="${SPP:-32}" tiles="${TILES:-4}" bounces="${BOUNCES:-12}"
command -v blender >/dev/null || { echo "blender is missing: apt-get install blender python3-numpy" >&2; exit 1; }
mkdir -p "$out"
out="$(realpath "$out")"

"$heddle" precompute "$fabric" -o "$out/fabric.pack" --quiet >/dev/null
# Both read the view from one file; `scene` prints our scene with its width.
/usr/bin/python3 "$here/view.py" "$out/fabric.pack" "$fabric" "$pixels" "$tiles" > "$out/scene.toml"

render() {  # NAME METHOD SPP [OPTION ...]
  local name="$1" method="$2" count="$3"
  shift 3
  "$heddle" render "$out/scene.toml" -o "$out/$name.exr" --method "$method" --spp "$count" --quiet "$@" >/dev/null
}
render path path "$spp" --bounces "$bounces"
render path-all path "$spp"
render exact exact $((4 * spp))
for shape in THICK RIBBONS; do
  blender -b --factory-startup -P "$here/scene.py" -- "$out/fabric.pack" "$out/cycles-$shape" "$pixels" "$tiles" "$spp" "$bounces" \
    "$shape" > "$out/blender-$shape.log" 2>&1 || { tail -20 "$out/blender-$shape.log" >&2; exit 1; }
done
/usr/bin/python3 "$here/report.py" "$heddle" "$out" "$pixels" "$bounces"
