"""Our add-on, installed as its users do it: from its zip, by Blender's preferences."""

import bpy


def install(archive):
    bpy.ops.preferences.addon_install(filepath=archive, overwrite=True)
    bpy.ops.preferences.addon_enable(module="polestar_blender")
