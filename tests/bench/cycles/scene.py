"""Run by `blender -b --factory-startup -P scene.py -- PACK PREFIX PIXELS TILES SPP BOUNCES SHAPE`.

The fibers of a pack as Curves with Principled Hair under a sun 40 degrees from the normal, seen straight down; two pictures
(PREFIX-1.exr, PREFIX-2.exr) and PREFIX.json with the processor time of each at SPP and at a quarter of it, whose difference
leaves out what a picture takes to set up. One Blender unit is a millimetre.
"""
import json
import math
import os
import resource
import sys
import time

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import pack

folder, prefix, pixels, tiles, spp, bounces, shape = sys.argv[sys.argv.index("--") + 1 :]
pixels, tiles, spp, bounces = int(pixels), float(tiles), int(spp), int(bounces)

fibers = pack.read_fibers(folder)
tile_w, tile_h = pack.tile_size(fibers)
width = tiles * min(tile_w, tile_h)
points, first = fibers["points_mm"].astype(np.float64), fibers["first_point"].astype(np.int64)
lengths = np.diff(first)

# Copies of the tile that fill the picture and two tiles around it. World = fabric space with the same origin as our flat swatch.
across, along = int(math.ceil(width / tile_w / 2)) + 2, int(math.ceil(width / tile_h / 2)) + 2
offsets = np.array([(i * tile_w, j * tile_h, 0) for i in range(-across, across) for j in range(-along, along)])
vertices = (points[None] + offsets[:, None]).reshape(-1, 3)
is_last = np.zeros(len(points), bool)
is_last[first[1:] - 1] = True
starts = np.flatnonzero(~is_last)
edges = np.stack([starts, starts + 1], 1)
edges = (edges[None] + (np.arange(len(offsets)) * len(points))[:, None, None]).reshape(-1, 2)

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
mesh = bpy.data.meshes.new("axes")
mesh.vertices.add(len(vertices))
mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
mesh.edges.add(len(edges))
mesh.edges.foreach_set("vertices", edges.astype(np.int32).ravel())
radii = np.repeat(fibers["radius_mm"], lengths)
mesh.attributes.new("fiber_radius", "FLOAT", "POINT").data.foreach_set("value", np.tile(radii, len(offsets)).astype(np.float32))
source = bpy.data.objects.new("axes", mesh)
scene.collection.objects.link(source)
source.hide_render = True

# Principled Hair: R's variance along the fiber is (0.726 r + 0.812 r^2)^2 and TT's a quarter of it, around it a logistic
# distribution of scale 0.265 r + 1.194 r^2 (both without their last, high power). Absorption per radius: a mean chord is
# pi / 2 radii long. fabric.toml has these two constants in its colours: reflectance F averaged over the fiber's width, R and TRT
# together F + (1 - F)^2 F c^2, TT (1 - F)^2 c.
INDEX, COLOR = 1.55, (0.8, 0.6, 0.4)
beta, _, gamma, _ = (float(x) for x in fibers["scattering"][0][6:])
positive_root = lambda a, b, c: (-b + math.sqrt(b * b + 4 * a * c)) / (2 * a)
material = bpy.data.materials.new("fiber")
material.use_nodes = True
nodes = material.node_tree.nodes
nodes.clear()
hair = nodes.new("ShaderNodeBsdfHairPrincipled")
hair.parametrization = "ABSORPTION"
hair.inputs["Absorption Coefficient"].default_value = [-math.log(c) / (math.pi / 2) for c in COLOR]
hair.inputs["IOR"].default_value = INDEX
hair.inputs["Roughness"].default_value = min(1, positive_root(0.812, 0.726, beta))
hair.inputs["Radial Roughness"].default_value = min(1, positive_root(1.194, 0.265, gamma * math.sqrt(3) / math.pi))
hair.inputs["Offset"].default_value = 0
hair.inputs["Random Color"].default_value = 0
hair.inputs["Random Roughness"].default_value = 0
output = nodes.new("ShaderNodeOutputMaterial")
material.node_tree.links.new(hair.outputs[0], output.inputs["Surface"])

curves = bpy.data.objects.new("fibers", bpy.data.hair_curves.new("fibers"))
scene.collection.objects.link(curves)
curves.data.materials.append(material)
group = bpy.data.node_groups.new("fibers", "GeometryNodeTree")
group.outputs.new("NodeSocketGeometry", "Geometry")
make = group.nodes.new
info, to_curve = make("GeometryNodeObjectInfo"), make("GeometryNodeMeshToCurve")
set_radius, named = make("GeometryNodeSetCurveRadius"), make("GeometryNodeInputNamedAttribute")
set_material, end = make("GeometryNodeSetMaterial"), make("NodeGroupOutput")
info.inputs["Object"].default_value = source
named.data_type = "FLOAT"
named.inputs["Name"].default_value = "fiber_radius"
set_material.inputs["Material"].default_value = material
link = group.links.new
link(info.outputs["Geometry"], to_curve.inputs["Mesh"])
link(to_curve.outputs["Curve"], set_radius.inputs["Curve"])
link(next(o for o in named.outputs if o.enabled), set_radius.inputs["Radius"])
link(set_radius.outputs["Curve"], set_material.inputs["Geometry"])
link(set_material.outputs["Geometry"], end.inputs[0])
curves.modifiers.new("fibers", "NODES").node_group = group

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.data.type = "ORTHO"
camera.data.ortho_scale = width
camera.data.clip_end = 100
camera.location = (0, 0, 10)
scene.collection.objects.link(camera)
scene.camera = camera
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.data.angle = 3, 0  # irradiance, as ours
sun.rotation_euler = (0, math.radians(40), 0)
scene.collection.objects.link(sun)

scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.use_adaptive_sampling = False
scene.cycles.use_denoising = False
scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
scene.cycles.pixel_filter_type = "BOX"
scene.cycles.max_bounces = bounces
for kind in ("diffuse", "glossy", "transmission", "transparent_max"):
    setattr(scene.cycles, kind + "_bounces", bounces)
scene.cycles_curves.shape = "THICK" if shape == "THICK" else "RIBBONS"
scene.render.resolution_x = scene.render.resolution_y = pixels
scene.render.resolution_percentage = 100
scene.render.film_transparent = True
scene.render.threads_mode = "AUTO"
scene.view_settings.view_transform = "Standard"
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_mode = "RGB"
scene.render.image_settings.color_depth = "32"


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


runs = []
for seed, samples in ((1, spp), (2, spp), (3, max(1, spp // 4))):
    scene.cycles.seed, scene.cycles.samples = seed, samples
    scene.render.filepath = f"{prefix}-{seed}.exr"
    before, clock = processor_seconds(), time.monotonic()
    bpy.ops.render.render(write_still=True)
    runs.append({"seed": seed, "spp": samples, "core_seconds": processor_seconds() - before, "seconds": time.monotonic() - clock})
with open(prefix + ".json", "w") as file:
    json.dump({"segments": len(edges), "blender": bpy.app.version_string, "runs": runs}, file, indent=2)
