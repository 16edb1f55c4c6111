"""Our scene of the view that scene.py builds in Blender: straight down, from so far away that rays are parallel; one sun."""
import math
import sys

sys.path.insert(0, __file__.rsplit("/", 1)[0])
import pack

folder, fabric, pixels, tiles = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
width = tiles * min(pack.tile_size(pack.read_fibers(folder)))
distance = 5000.0
print(
    f"""name = "cycles"
[camera]
position_mm = [0, 0, {distance}]
look_at_mm = [0, 0, 0]
up = [0, 1, 0]
fov_deg = {math.degrees(2 * math.atan(0.5 * width / distance)):.12g}
fov_axis = "horizontal"
resolution_px = [{pixels}, {pixels}]
[[light]]
type = "directional"
direction = [{math.sin(math.radians(40)):.9g}, 0, {math.cos(math.radians(40)):.9g}]
irradiance = [3, 3, 3]
[[cloth]]
flat_mm = [{12 * width}, {12 * width}]
fabric = "{fabric}"
"""
)
