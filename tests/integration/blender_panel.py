"""Uses the add-on's operators as its panel does.

    blender -b --factory-startup --python-exit-code 3 --python blender_panel.py -- JOB.json

JOB.json holds `addon` (the packed add-on), `full` (a .vdb with colors and rest) and `bare` (one with neither). Exits
with 3 at the first thing that is not as it should be.
"""

import json
import math
import os
import sys
import types

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from blender_addon import install  # noqa: E402


def require(condition, message):
    if not condition:
        raise AssertionError(message)


def nodes():
    return bpy.context.object.active_material.node_tree.nodes


def error_of(operator, **arguments):
    try:
        operator(**arguments)
    except RuntimeError as error:
        return str(error)
    return ""


class Layout:
    """Stands in for the panel's layout, of which there is none without a window."""

    def __init__(self):
        self.shown = []

    def column(self):
        return self

    row = column

    def separator(self):
        pass

    def label(self, text):
        self.shown.append(text)

    def prop(self, owner, name, text):
        require(hasattr(owner, name), "%s has no %s" % (owner, name))
        self.shown.append(text)

    def operator(self, name):
        category, operator = name.split(".")
        getattr(getattr(bpy.ops, category), operator).get_rna_type()  # raises for an unknown one
        self.shown.append(name)

    def operator_menu_enum(self, name, prop, text):
        self.operator(name)
        self.shown.append(text)

    def operator_enum(self, name, prop):
        self.operator(name)


def panel():
    """What the sidebar shows."""
    layout = Layout()
    bpy.types.VIEW3D_PT_polestar.draw(types.SimpleNamespace(layout=layout), bpy.context)
    return layout.shown


def check_looks(path):
    require("import_scene.polestar" in panel(), "the panel does not offer to import")
    bpy.ops.import_scene.polestar(filepath=path)
    require(bpy.context.object.active_material["polestar_look"] == "colors", "not the file's own colors")
    nodes()["polestar density"].outputs[0].default_value = 7
    require({"Look: Own colors", "Density", "polestar.add_cut"} <= set(panel()), "the panel lacks something")
    bpy.ops.polestar.add_cut(normal=(0, 0, 1))
    require({"Cut at", "polestar.remove_cut"} <= set(panel()), "the panel does not show the cut plane")
    plane, = bpy.context.object.children
    for look in ("shells", "marble", "wood", "coordinates", "plain", "colors"):
        bpy.ops.polestar.set_look(look=look)
        require(bpy.context.object.active_material["polestar_look"] == look, look)
        require(nodes()["polestar density"].outputs[0].default_value == 7, "the density was forgotten")
        require(nodes()["polestar cut"].object == plane, "the cut plane was forgotten")
        require(nodes()["polestar cut limit"].inputs[1].default_value == 0, "the plane does not cut")
        shader = next(node for node in nodes() if node.type == "PRINCIPLED_VOLUME")
        require(shader.inputs["Color"].is_linked and shader.inputs["Density"].is_linked, "the shader is not linked")


def check_placing():
    obj = bpy.context.object
    bpy.ops.polestar.set_up(up="y")
    bpy.context.view_layer.update()
    require(math.isclose(obj.matrix_world.col[1].z, 1, abs_tol=1e-6), "y does not point up")
    bpy.ops.polestar.set_up(up="z")
    require(tuple(obj.rotation_euler) == (0, 0, 0), "z does not point up")
    bpy.ops.polestar.remove_cut()
    require(not obj.children and nodes()["polestar cut"].object is None, "the plane is still there")
    require(nodes()["polestar cut limit"].inputs[1].default_value > 1e6, "something is still cut away")
    require("normal" in error_of(bpy.ops.polestar.add_cut, normal=(0, 0, 0)), "a plane without a normal")


def check_errors(path):
    bpy.ops.import_scene.polestar(filepath=path)
    require(bpy.context.object.active_material["polestar_look"] == "plain", "not plain")
    require("no rest" in error_of(bpy.ops.polestar.set_look, look="marble"), "marble without rest")
    require("no colors" in error_of(bpy.ops.polestar.set_look, look="colors"), "colors without a grid")
    require(bpy.context.object.active_material["polestar_look"] == "plain", "a failed look changed the material")


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    install(job["addon"])
    check_looks(job["full"])
    check_placing()
    check_errors(job["bare"])
    bpy.ops.preferences.addon_disable(module="polestar_blender")
    require(bpy.context.object.active_material.node_tree.nodes.get("polestar density"), "the material is gone")
    require(not hasattr(bpy.types, "VIEW3D_PT_polestar"), "the panel is still there")


main()
