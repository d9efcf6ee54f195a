"""Opens a .vdb in Blender as an artist would and checks that `rest` is seen where it belongs.

    blender -b --factory-startup --python-exit-code 3 --python blender_rest.py -- FILE.vdb EXPECTED.json OUT_FOLDER

EXPECTED.json holds `points` (mesh units) and `ball` (their ball coordinates), as `polestar eval --json` prints them.
All points lie on the planes named by `planes`, a list of [axis, value] such as ["z", 0.25]; a plane is rendered for
each, seen along its axis by an orthographic camera: a thin slab that emits the color 0.5 + 0.5 rest. Each point's
pixel must then show its ball coordinates, half a voxel further on every axis, which is where Blender puts volumes.

Prints one line of JSON: the grids, and the errors of the colors, in ball coordinates. Exits with 3 (Blender's
--python-exit-code) when the file does not open as it should or the colors are wrong.
"""

import json
import os
import sys

import bpy
from mathutils import Matrix, Vector

RESOLUTION = 160  # pixels across the view
SAMPLES = 8
TOLERANCE_EACH = 0.03  # of one point's colors; render noise and the slab's thickness
TOLERANCE_MEAN = 0.006  # of the mean over all points: half a voxel of shift would show here
GRIDS = {"surface": "FLOAT", "density": "FLOAT", "rest": "VECTOR_FLOAT"}


def require(condition, message):
    if not condition:
        raise RuntimeError(message)


def load_volume(path):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj, do_unlink=True)
    volume = bpy.data.volumes.new("solid")
    volume.filepath = path
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("solid", volume))
    require(volume.grids.load(), "Blender cannot load %s: %s" % (path, volume.grids.error_message))
    types = {grid.name: grid.data_type for grid in volume.grids}
    for name, kind in GRIDS.items():
        require(types.get(name) == kind, "grid %s is %s, not %s" % (name, types.get(name), kind))
    matrices = {tuple(x for row in grid.matrix_object for x in row) for grid in volume.grids}
    require(len(matrices) == 1, "the grids have %d different transforms" % len(matrices))
    return volume, types


def slab_material(axis, value, half_width):
    """Emission of 0.5 + 0.5 rest, weighted by a hat across the slab: the integral along the axis is the color."""
    material = bpy.data.materials.new("slab")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()

    def node(kind, **settings):
        made = tree.nodes.new(kind)
        for key, setting in settings.items():
            setattr(made, key, setting)
        return made

    def math(operation, first, second):
        made = node("ShaderNodeMath", operation=operation)
        for socket, source in zip(made.inputs, (first, second)):
            if isinstance(source, float):
                socket.default_value = source
            else:
                tree.links.new(source, socket)
        return made.outputs[0]

    position = node("ShaderNodeSeparateXYZ")
    tree.links.new(node("ShaderNodeNewGeometry").outputs["Position"], position.inputs[0])
    offset = math("ABSOLUTE", math("SUBTRACT", position.outputs["xyz".index(axis)], value), 0.0)
    hat = math("MAXIMUM", math("SUBTRACT", 1.0, math("DIVIDE", offset, half_width)), 0.0)
    strength = math("DIVIDE", hat, half_width)

    color = node("ShaderNodeVectorMath", operation="MULTIPLY_ADD")
    tree.links.new(node("ShaderNodeAttribute", attribute_name="rest").outputs["Vector"], color.inputs[0])
    color.inputs[1].default_value = (0.5, 0.5, 0.5)
    color.inputs[2].default_value = (0.5, 0.5, 0.5)
    emission = node("ShaderNodeEmission")
    tree.links.new(color.outputs[0], emission.inputs["Color"])
    tree.links.new(strength, emission.inputs["Strength"])
    tree.links.new(emission.outputs[0], node("ShaderNodeOutputMaterial").inputs["Volume"])
    return material


def prepare_scene():
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.cycles.volume_step_rate = 0.5
    scene.render.threads_mode = "FIXED"
    scene.render.threads = 2
    scene.render.resolution_x = scene.render.resolution_y = RESOLUTION
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"  # linear floats
    scene.render.image_settings.color_depth = "32"
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    return scene


class View:
    """Orthographic camera that looks against an axis, right-handed: z shows x to the right and y up."""

    def __init__(self, scene, axis, center, width):
        k = "xyz".index(axis)
        self.right, self.up, back = (Vector([float(i == j) for i in range(3)]) for j in ((k + 1) % 3, (k + 2) % 3, k))
        self.center, self.width = Vector(center), width
        data = bpy.data.cameras.new("view")
        data.type = "ORTHO"
        data.ortho_scale = width
        data.clip_start, data.clip_end = 0.01 * width, 10 * width
        camera = bpy.data.objects.new("view", data)
        camera.matrix_world = Matrix.Translation(self.center + 2 * width * back) @ Matrix(
            (self.right, self.up, back)).transposed().to_4x4()
        scene.collection.objects.link(camera)
        scene.camera = camera

    def pixel(self, point):
        from_center = Vector(point) - self.center
        return tuple(int((0.5 + from_center.dot(side) / self.width) * RESOLUTION) for side in (self.right, self.up))


def render(scene, path):
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    require(os.path.exists(path), "Blender rendered nothing")
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    return list(image.pixels)  # rows from below, four channels


def shown_rest(pixels, column, row):
    """Ball coordinates that the 3 x 3 pixels around a pixel show."""
    total = [0.0, 0.0, 0.0]
    for y in range(row - 1, row + 2):
        for x in range(column - 1, column + 2):
            start = 4 * (y * RESOLUTION + x)
            for k in range(3):
                total[k] += pixels[start + k] / 9
    return [2 * value - 1 for value in total]


def main():
    path, expected_path, folder = sys.argv[sys.argv.index("--") + 1:]
    with open(expected_path) as file:
        expected = json.load(file)
    points, balls = expected["points"], expected["ball"]
    volume, types = load_volume(path)
    voxel = volume.grids[0].matrix_object[0][0]
    scene = prepare_scene()
    low, high = ([pick(p[k] for p in points) for k in range(3)] for pick in (min, max))
    center = [0.5 * (a + b) for a, b in zip(low, high)]
    width = 1.2 * max(b - a for a, b in zip(low, high))

    errors = []
    for axis, value in expected["planes"]:
        k = "xyz".index(axis)
        # Blender shows the plane half a voxel further, and each point of it.
        volume.materials.clear()
        volume.materials.append(slab_material(axis, value + 0.5 * voxel, 1.5 * voxel))
        view = View(scene, axis, center, width)
        pixels = render(scene, os.path.join(folder, "rest_%s.exr" % axis))
        for point, ball in zip(points, balls):
            if abs(point[k] - value) > 1e-6 * width:
                continue
            column, row = view.pixel([x + 0.5 * voxel for x in point])
            errors.append([a - b for a, b in zip(shown_rest(pixels, column, row), ball)])

    require(len(errors) >= len(points), "some points lie on none of the planes")
    worst = max(abs(e) for error in errors for e in error)
    mean = [sum(error[k] for error in errors) / len(errors) for k in range(3)]
    print(json.dumps({"grids": types, "points": len(errors), "worst": worst, "mean": mean}))
    require(worst < TOLERANCE_EACH, "a color is off by %.3f in ball coordinates" % worst)
    require(max(map(abs, mean)) < TOLERANCE_MEAN, "the colors are off by %s on the mean" % mean)


main()
