"""A .vdb of `polestar transfer` on the stage of `polestar render`, cut open, for Cycles: twice.

As a *surface* it is the mesh of bench_cut_surface, with the colors at its vertices, since shaders of surfaces cannot
look into volumes. As a *volume* it is a Principled Volume so dense that its skin looks solid, masked by the plane.
"""

import math
import struct

import bpy
from mathutils import Matrix, Vector

# As lib/polestar/render/detail/studio.cpp has them.
KEY_RADIUS = 0.22  # tangent of the key light's angular radius
KEY_STRENGTH, DOME_STRENGTH = 0.8, 0.5  # of the light on a white surface that faces them
FLOOR_COLOR = (0.79, 0.75, 0.69)
KEY_DISTANCE = 20  # in sizes of the solid
OPACITY = 2  # optical depth of a voxel of the dense volume


class ColoredMesh:
    """An .obj with lines "v x y z r g b"."""

    def __init__(self, path):
        self.vertices, self.colors, self.faces = [], [], []
        with open(path) as file:
            for kind, *numbers in map(str.split, file):
                if kind == "v":
                    values = [float(n) for n in numbers]
                    self.vertices.append(values[:3])
                    self.colors += values[3:] + [1.0]
                else:
                    self.faces.append([int(n) - 1 for n in numbers])
        self.low, self.high = ([pick(c) for c in zip(*self.vertices)] for pick in (min, max))
        self.triangles = sum(len(face) - 2 for face in self.faces)


class View:
    """The camera of one of polestar's EXR files, from its header."""

    def __init__(self, path, width, height):
        with open(path, "rb") as file:
            header = file.read(65536)
        to_camera, to_screen = (self.matrix(header, name) for name in (b"worldToCamera", b"worldToScreen"))
        self.right, self.up, self.forward = (Vector([to_camera[row][k] for row in range(3)]) for k in range(3))
        shift = to_camera[3]
        self.position = -(self.right * shift[0] + self.up * shift[1] + self.forward * shift[2])
        self.tangent = 1 / Vector([to_screen[row][1] for row in range(3)]).length
        self.width, self.height = width, height

    @staticmethod
    def matrix(header, name):
        start = header.index(name + b"\0m44f\0") + len(name) + 6 + 4  # after the size, which is 64
        values = struct.unpack("<16f", header[start:start + 64])
        return [values[4 * row:4 * row + 4] for row in range(4)]

    def pixel_of(self, point):
        d = Vector(point) - self.position
        scale = self.height / (2 * self.tangent * self.forward.dot(d))
        return (0.5 * self.width + scale * self.right.dot(d), 0.5 * self.height - scale * self.up.dot(d))

    def direction(self, x, y):
        pixel = 2 * self.tangent / self.height
        return (self.forward + self.right * ((x - 0.5 * self.width) * pixel) +
                self.up * ((0.5 * self.height - y) * pixel))

    def key(self):
        """Towards the key light, which stands where the cut, across x, is open to."""
        side = self.right if self.right[0] > 0 else -self.right
        return (0.7 * side + 0.9 * Vector((0, 0, 1)) - 0.8 * self.forward).normalized()

    def camera(self, scene):
        data = bpy.data.cameras.new("camera")
        data.sensor_fit = "VERTICAL"
        data.angle_y = 2 * math.atan(self.tangent)
        camera = bpy.data.objects.new("camera", data)
        camera.matrix_world = Matrix.Translation(self.position) @ Matrix(
            (self.right, self.up, -self.forward)).transposed().to_4x4()
        scene.collection.objects.link(camera)
        scene.camera = camera
        scene.render.resolution_x, scene.render.resolution_y = self.width, self.height


def colored_material(kind, target):
    """A material of one shader node, which is returned with it."""
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[target])
    return material, shader


def linked(scene, name, data):
    made = bpy.data.objects.new(name, data)
    scene.collection.objects.link(made)
    return made


def import_volume(scene, path):
    volume = bpy.data.volumes.new("volume")
    volume.filepath = path
    if not volume.grids.load():
        raise RuntimeError("Blender cannot load " + path)
    return linked(scene, "volume", volume)


def surface_object(scene, solid):
    mesh = bpy.data.meshes.new("solid")
    mesh.from_pydata(solid.vertices, [], solid.faces)
    # Not `color`: on surfaces, Cycles takes that for the volumes' own.
    mesh.attributes.new("albedo", "FLOAT_COLOR", "POINT").data.foreach_set("color", solid.colors)
    material, shader = colored_material("ShaderNodeBsdfDiffuse", "Surface")
    attribute = material.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "albedo"
    material.node_tree.links.new(attribute.outputs["Color"], shader.inputs["Color"])
    mesh.materials.append(material)
    return linked(scene, "solid", mesh)


def dense_material(voxel, plane):
    material, shader = colored_material("ShaderNodeVolumePrincipled", "Volume")
    tree = material.node_tree
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Color Attribute"].default_value = "color"
    position = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], position.inputs[0])
    kept = tree.nodes.new("ShaderNodeMath")
    kept.operation = "LESS_THAN"
    tree.links.new(position.outputs["X"], kept.inputs[0])
    kept.inputs[1].default_value = plane
    density = tree.nodes.new("ShaderNodeMath")
    density.operation = "MULTIPLY"
    tree.links.new(kept.outputs[0], density.inputs[0])
    density.inputs[1].default_value = OPACITY / voxel
    tree.links.new(density.outputs[0], shader.inputs["Density"])
    return material


def add_stage(scene, view, size, floor):
    """Key light, dome and floor."""
    key = view.key()
    distance = KEY_DISTANCE * size
    lamp = bpy.data.lights.new("key", "AREA")
    lamp.shape = "DISK"
    lamp.size = 2 * KEY_RADIUS * distance
    lamp.energy = KEY_STRENGTH * (math.pi * distance)**2
    linked(scene, "key", lamp).matrix_world = Matrix.Translation(key * distance) @ key.to_track_quat(
        "Z", "Y").to_matrix().to_4x4()
    scene.world = bpy.data.worlds.new("dome")
    scene.world.color = (DOME_STRENGTH,) * 3
    wide = 40 * size
    mesh = bpy.data.meshes.new("floor")
    mesh.from_pydata([(-wide, -wide, floor), (wide, -wide, floor), (wide, wide, floor), (-wide, wide, floor)], [],
                     [(0, 1, 2, 3)])
    material, shader = colored_material("ShaderNodeBsdfDiffuse", "Surface")
    shader.inputs["Color"].default_value = (*FLOOR_COLOR, 1)
    mesh.materials.append(material)
    linked(scene, "floor", mesh)


class CyclesStage:
    """The solid as a surface and as a volume, of which one is shown."""

    def __init__(self, vdb, solid, view, threads):
        """`solid`: a ColoredMesh, whose greatest x is that of the cut."""
        for old in list(bpy.data.objects):
            bpy.data.objects.remove(old, do_unlink=True)
        self.scene = scene = bpy.context.scene
        self.view = view
        self.surface = surface_object(scene, solid)
        self.volume = import_volume(scene, vdb)
        voxel = self.volume.data.grids[0].matrix_object[0][0]
        self.volume.data.materials.append(dense_material(voxel, solid.high[0]))
        add_stage(scene, view, math.dist(solid.low, solid.high) / 2, solid.low[2])
        view.camera(scene)

        scene.render.engine = "CYCLES"
        scene.cycles.device = "CPU"
        scene.render.threads_mode = "FIXED"
        scene.render.threads = threads
        scene.render.use_persistent_data = True  # the scene is built by the first render of each kind alone
        scene.cycles.use_adaptive_sampling = False
        scene.cycles.use_denoising = False
        scene.cycles.max_bounces = 0  # direct light alone, as polestar has it
        scene.render.resolution_percentage = 100
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"

    def show(self, kind):
        self.surface.hide_render = kind != "surface"
        self.volume.hide_render = kind != "volume"

    def render(self, samples, seed, path=None, crop=None):
        """`crop`: pixels x0, y0, x1, y1 from the upper left corner."""
        scene, view = self.scene, self.view
        scene.cycles.samples, scene.cycles.seed = samples, seed
        scene.render.use_border = scene.render.use_crop_to_border = crop is not None
        if crop:
            scene.render.border_min_x, scene.render.border_max_x = crop[0] / view.width, crop[2] / view.width
            scene.render.border_min_y = 1 - crop[3] / view.height
            scene.render.border_max_y = 1 - crop[1] / view.height
        if path:
            scene.render.filepath = path
        bpy.ops.render.render(write_still=path is not None)
