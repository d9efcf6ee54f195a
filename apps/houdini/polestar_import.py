"""Builds the network that brings a .vdb of polestar's, or a sequence, into Houdini.

In Houdini's Python shell, or in a shelf tool:

    import sys
    sys.path.append("FOLDER OF THIS FILE")
    import polestar_import
    polestar_import.import_solid(hou.node("/obj"), "$HIP/kiwi_####.vdb")
    polestar_import.import_solid(hou.node("/obj"), "$HIP/asteroid.vdb", look="marble")
"""

import os
import re
from typing import TYPE_CHECKING, List

if TYPE_CHECKING:
    import hou

SNIPPETS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "vex")

# What primitive wrangles do with the name of a VDB, by which wrangles and shaders find it.
BLENDERS_NAME = 'if (s@name == "color") s@name = "Cd";\n'
WITHOUT_COLORS = 'if (s@name == "color" || s@name == "Cd") removeprim(0, @primnum, 1);\n'
# A Volume Wrangle writes into VDBs that are there, and makes none: colors begin as a copy of rest.
COLORS_OF_REST = 'if (s@name == "rest") s@name = "Cd";\nelse removeprim(0, @primnum, 1);\n'


def looks() -> List[str]:
    """Names of the snippets in vex/."""
    return sorted(os.path.splitext(name)[0] for name in os.listdir(SNIPPETS) if name.endswith(".vfl"))


def snippet(look: str) -> str:
    """Raises ValueError when there is no such look."""
    if look not in looks():
        raise ValueError(f"there is no look {look!r}; there are {', '.join(looks())}")
    with open(os.path.join(SNIPPETS, look + ".vfl"), encoding="utf-8") as file:
        return file.read()


def houdini_path(path: str) -> str:
    """name_####.vdb as Houdini writes it, name_$F4.vdb."""
    return re.sub("#+", lambda place: f"$F{len(place[0])}", path)


def import_solid(parent: "hou.Node", path: str, look: str = "", points: str = "") -> "hou.Node":
    """A geometry object below `parent` whose node OUT has the VDBs of the file, and returns that node.

    `path` may have Houdini's variables, and #### or $F4 for the frame. Without a look, colors are the file's own; a
    look, one of looks(), computes Cd from rest instead. `points` is the path of a SOP with points of the unit ball,
    for the look seeds. Raises ValueError for an unknown look.
    """
    code = snippet(look) if look else ""
    geometry = parent.createNode("geo", "polestar_solid")
    file = geometry.createNode("file", "solid")
    file.parm("file").set(houdini_path(path))
    file.parm("missingframe").set("error")
    if look:
        last = _computed_colors(geometry, file, code, points)
    else:
        last = _primitive_wrangle(geometry, "names", file, BLENDERS_NAME)
    out = geometry.createNode("null", "OUT")
    out.setInput(0, last)
    out.setDisplayFlag(True)
    out.setRenderFlag(True)
    geometry.layoutChildren()
    return out


def _computed_colors(geometry: "hou.Node", file: "hou.Node", code: str, points: str) -> "hou.Node":
    merge = geometry.createNode("merge", "with_colors")
    merge.setInput(0, _primitive_wrangle(geometry, "without_colors", file, WITHOUT_COLORS))
    merge.setInput(1, _primitive_wrangle(geometry, "colors", file, COLORS_OF_REST))
    wrangle = geometry.createNode("volumewrangle", "look")
    wrangle.setInput(0, merge)
    wrangle.parm("snippet").set(code)
    if points:
        source = geometry.createNode("object_merge", "points")
        source.parm("objpath1").set(points)
        wrangle.setInput(1, source)
    return wrangle


def _primitive_wrangle(geometry: "hou.Node", name: str, source: "hou.Node", code: str) -> "hou.Node":
    wrangle = geometry.createNode("attribwrangle", name)
    wrangle.setInput(0, source)
    wrangle.parm("class").set("primitive")
    wrangle.parm("snippet").set(code)
    return wrangle
