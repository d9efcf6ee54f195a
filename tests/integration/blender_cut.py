"""Opens a .vdb in Blender as an artist would and renders slabs of it, colored by its grids, with Cycles.

    blender -b --factory-startup --python-exit-code 3 --python blender_cut.py -- JOB.json

JOB.json holds
    file      the .vdb
    sequence  true: the file is the first of a sequence, which Blender's own import makes one volume
    addon     empty, or our add-on, packed: it is installed and imports that sequence instead
    grids     the grids that every frame must have, by name, with Blender's word for their type; all with one transform
    bounds    a .json to write: the lowest and the highest corner of the volume's box, for every picture
    cuts      a list of pictures, each with
        out            an OpenEXR file to write: scene-linear, the slab's colors premultiplied by alpha
        frame          of the scene
        attribute      name of the grid that gives the color
        shader         "emission": shines in the color scale * attribute + offset (two more keys), alpha 0;
                       "principled": Blender's Principled Volume in the attribute's color, as dense as
                       `density` says, where that is 1 with an optical_depth (one more key) across the slab;
                       "imported": the add-on's material, as dense as that
        camera         4 x 4, camera to world, Blender's axes; pinhole
        field_of_view  vertical, radians
        size           width and height, pixels
        slab           [near, far]: depths along the view direction between which the volume is seen
        plane          null, or point and normal of the add-on's cut plane

Exits with 3 (Blender's --python-exit-code) when the file does not open as it should.
"""

import glob
import json
import math
import os
import re
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from blender_addon import install  # noqa: E402

SAMPLES = 8
STEP_RATE = 0.25  # of ray marching: a few steps in a slab of half a voxel


def require(condition, message):
    if not condition:
        raise RuntimeError(message)


def frames_of(file):
    """The files of its sequence, by their numbers."""
    stem = re.sub(r"\d+\.vdb$", "", file)
    return {int(other[len(stem):-len(".vdb")]): other for other in glob.glob(glob.escape(stem) + "[0-9]*.vdb")}


def load_volume(job):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj, do_unlink=True)
    if job["addon"]:
        install(job["addon"])
        bpy.ops.import_scene.polestar(filepath=job["file"])
    elif job["sequence"]:
        # As a file browser hands them over, all selected.
        bpy.ops.object.volume_import(filepath=job["file"], directory=os.path.dirname(job["file"]),
                                     files=[{"name": os.path.basename(file)} for file in frames_of(job["file"]).values()])
    else:
        volume = bpy.data.volumes.new("solid")
        volume.filepath = job["file"]
        obj = bpy.data.objects.new("solid", volume)
        bpy.context.scene.collection.objects.link(obj)
        return obj
    return bpy.context.object


def show_frame(solid, job, frame):
    """Returns the volume's box there."""
    bpy.context.scene.frame_set(frame)
    check_grids(solid.data, job["grids"])
    file = frames_of(job["file"]).get(frame) if job["sequence"] or job["addon"] else job["file"]
    shown = solid.data.grids.frame_filepath
    require(shown == file, "frame %d shows %s, not %s" % (frame, shown, file))
    corners = solid.evaluated_get(bpy.context.evaluated_depsgraph_get()).bound_box
    return [[find(corner[axis] for corner in corners) for axis in range(3)] for find in (min, max)]


def check_grids(volume, expected):
    require(volume.grids.load(), "Blender cannot load %s: %s" % (volume.filepath, volume.grids.error_message))
    types = {grid.name: grid.data_type for grid in volume.grids}
    for name, kind in expected.items():
        require(types.get(name) == kind, "grid %s is %s, not %s" % (name, types.get(name), kind))
        require(volume.grids[name].load(), "Blender cannot load the voxels of %s" % name)
    matrices = {tuple(x for row in grid.matrix_object for x in row) for grid in volume.grids}
    require(len(matrices) == 1, "the grids have %d different transforms" % len(matrices))


def material_of(kind, target):
    """A material of one shader node, which is returned with it."""
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[target])
    return material, shader


def emission(cut, thickness):
    """Light of a slab adds up to the mean of the color across it."""
    material, shader = material_of("ShaderNodeEmission", "Volume")
    tree = material.node_tree
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = cut["attribute"]
    color = tree.nodes.new("ShaderNodeVectorMath")
    color.operation = "MULTIPLY_ADD"
    tree.links.new(attribute.outputs["Vector"], color.inputs[0])
    color.inputs[1].default_value = [cut["scale"]] * 3
    color.inputs[2].default_value = [cut["offset"]] * 3
    tree.links.new(color.outputs[0], shader.inputs["Color"])
    shader.inputs["Strength"].default_value = 1 / thickness
    return material


def principled(cut, thickness):
    material, shader = material_of("ShaderNodeVolumePrincipled", "Volume")
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Color Attribute"].default_value = cut["attribute"]
    shader.inputs["Density"].default_value = cut["optical_depth"] / thickness  # times the grid `density`, by default
    return material


SHADERS = {"emission": emission, "principled": principled}


def dress(solid, cut, thickness):
    if cut["shader"] == "imported":
        nodes = solid.active_material.node_tree.nodes
        nodes["polestar density"].outputs[0].default_value = cut["optical_depth"] / thickness
    else:
        solid.data.materials.clear()
        solid.data.materials.append(SHADERS[cut["shader"]](cut, thickness))


def move_cut_plane(solid, plane):
    if not solid.children:
        bpy.ops.polestar.add_cut()
    empty, = solid.children
    empty.matrix_world = Matrix.Translation(plane["point"]) @ Vector(
        plane["normal"]).to_track_quat("Z", "Y").to_matrix().to_4x4()


def prepare_scene():
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.filter_width = 1
    scene.cycles.volume_step_rate = STEP_RATE
    scene.cycles.max_bounces = 0  # single scattering: the albedo is the color
    scene.render.threads_mode = "FIXED"
    scene.render.threads = 2
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "OPEN_EXR"  # scene-linear floats
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.color_depth = "32"
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)

    # Without shadows every voxel gets the same light: so much that a white one, which spreads it over the
    # sphere of directions, sends 1 to the camera.
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 4 * math.pi
    sun.cycles.cast_shadow = False
    scene.collection.objects.link(bpy.data.objects.new("sun", sun))

    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit = "VERTICAL"
    scene.collection.objects.link(camera)
    scene.camera = camera

    # Where the slab ends. The camera's own far end would leave the volume black that reaches beyond it.
    wall = bpy.data.objects.new("wall", bpy.data.meshes.new("wall"))
    wall.data.from_pydata([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)], [], [(0, 1, 2, 3)])
    wall.data.materials.append(material_of("ShaderNodeHoldout", "Surface")[0])
    wall.visible_shadow = wall.visible_volume_scatter = False
    wall.parent = camera
    scene.collection.objects.link(wall)
    return scene, camera, wall


def render(scene, camera, wall, solid, cut):
    near, far = cut["slab"]
    dress(solid, cut, far - near)
    if cut["plane"] is not None:
        move_cut_plane(solid, cut["plane"])
    camera.matrix_world = Matrix(cut["camera"])
    camera.data.angle_y = cut["field_of_view"]
    require(abs(camera.data.angle_y - cut["field_of_view"]) < 1e-6, "Blender has no such field of view")
    camera.data.clip_start, camera.data.clip_end = near, 2 * far
    wall.scale = (far, far, far)  # which fills any field of view below a right angle
    scene.render.resolution_x, scene.render.resolution_y = cut["size"]
    scene.render.filepath = cut["out"]
    bpy.ops.render.render(write_still=True)
    require(os.path.exists(cut["out"]), "Blender rendered nothing")


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    solid = load_volume(job)
    stage = prepare_scene()
    bounds = []
    for cut in job["cuts"]:
        bounds.append(show_frame(solid, job, cut["frame"]))
        render(*stage, solid, cut)
    with open(job["bounds"], "w") as file:
        json.dump(bounds, file)


main()
