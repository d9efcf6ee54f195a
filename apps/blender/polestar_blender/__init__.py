"""Blender add-on: imports the .vdb of polestar, or a sequence of them, with a material that knows its grids.

errors, vdb_file, sequence and solid look at files and do without Blender; looks, cut_plane and importer make what
Blender draws; ui has the operators and the panel. render.py beside this folder uses the same modules.
"""

bl_info = {
    "name": "polestar solids",
    "author": "polestar",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > polestar (.vdb), and the sidebar of the 3D view",
    "description": "Imports solid textures and coordinates of polestar as volumes, with materials and a cut plane",
    "category": "Import-Export",
}


def register() -> None:
    from . import ui
    ui.register()


def unregister() -> None:
    from . import ui
    ui.unregister()
