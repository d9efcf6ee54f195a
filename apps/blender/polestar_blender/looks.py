"""Materials of solids: where the solid is, what is cut away, and its colors.

Everything a user may want to turn stands in the material's own nodes, found again by their names; the add-on keeps
nothing beside them. Materials go on working where the add-on is not installed.
"""

from typing import Callable, Dict, Optional, Tuple

import bpy

from .solid import COLORS, PLAIN, REST, SURFACE, Solid

# Names of nodes.
DENSITY_NODE = "polestar density"
CUT_NODE = "polestar cut"
LIMIT_NODE = "polestar cut limit"
LOOK_PROPERTY = "polestar_look"  # of the material

EVERYWHERE = 1e9  # height below which all is kept
PLAIN_COLOR = (0.6, 0.55, 0.5)

# Identifier, name and description, as Blender's enumerations want them.
LOOKS = (
    (COLORS, "Own colors", "The colors of the grid Cd or color"),
    ("shells", "Shells", "Core, mantle and crust by |rest|, the depth in the solid"),
    ("marble", "Marble", "Veins in the coordinates rest"),
    ("wood", "Wood", "Rings around the z axis of rest"),
    ("coordinates", "Coordinates", "rest itself, from -1 to 1, as red, green and blue"),
    (PLAIN, "Plain", "One color, for files with neither colors nor rest"),
)

Color = Tuple[float, float, float]
Socket = bpy.types.NodeSocket
Tree = bpy.types.NodeTree


def apply_look(obj: bpy.types.Object, solid: Solid, look: str, density: Optional[float] = None) -> None:
    """Gives the volume object a material of this look, which the solid has to have (Solid.look).

    What was set on an earlier one, density and cut plane, is carried over; the density can be given anew, in
    1/length of the object, where the solid's own is 1.
    """
    old = material_of(obj)
    if density is None:
        density = density_socket(obj).default_value if old else 1.0
    plane = cut_plane(obj) if old else None

    material = old or bpy.data.materials.new(obj.name)
    material.use_nodes = True
    material[LOOK_PROPERTY] = look
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeVolumePrincipled")
    shader.inputs["Density Attribute"].default_value = ""  # the density is linked, also where it comes from `surface`
    tree.links.new(shader.outputs[0], output.inputs["Volume"])
    tree.links.new(_color(tree, solid, look), shader.inputs["Color"])
    tree.links.new(_density(tree, solid.mask_grid, density), shader.inputs["Density"])
    _arrange(tree, output)
    if old is None:
        obj.data.materials.clear()
        obj.data.materials.append(material)
    set_cut_plane(obj, plane)


def material_of(obj: bpy.types.Object) -> Optional[bpy.types.Material]:
    """The material that `apply_look` made; None where there is none or its nodes are gone."""
    material = obj.active_material if obj.type == "VOLUME" else None
    if material is None or LOOK_PROPERTY not in material or not material.use_nodes:
        return None
    nodes = material.node_tree.nodes
    return material if all(name in nodes for name in (DENSITY_NODE, CUT_NODE, LIMIT_NODE)) else None


def density_socket(obj: bpy.types.Object) -> Socket:
    return material_of(obj).node_tree.nodes[DENSITY_NODE].outputs[0]


def cut_plane(obj: bpy.types.Object) -> Optional[bpy.types.Object]:
    """The empty that cuts: kept is what lies below it, on the other side of its z axis."""
    return material_of(obj).node_tree.nodes[CUT_NODE].object


def set_cut_plane(obj: bpy.types.Object, plane: Optional[bpy.types.Object]) -> None:
    nodes = material_of(obj).node_tree.nodes
    nodes[CUT_NODE].object = plane
    nodes[LIMIT_NODE].inputs[1].default_value = 0.0 if plane else EVERYWHERE


def _attribute(tree: Tree, name: str) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = node.label = name
    return node


def _math(tree: Tree, operation: str, *operands: object) -> Socket:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    _feed(tree, node, operands)
    return node.outputs[0]


def _vector_math(tree: Tree, operation: str, *operands: object) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    _feed(tree, node, operands)
    return node


def _feed(tree: Tree, node: bpy.types.Node, operands: Tuple[object, ...]) -> None:
    for socket, operand in zip(node.inputs, operands):
        if isinstance(operand, bpy.types.NodeSocket):
            tree.links.new(operand, socket)
        else:
            socket.default_value = operand


def _density(tree: Tree, mask_grid: str, density: float) -> Socket:
    inside = _attribute(tree, mask_grid).outputs["Fac"]
    if mask_grid == SURFACE:
        inside = _math(tree, "LESS_THAN", inside, 0.0)

    cut = tree.nodes.new("ShaderNodeTexCoord")
    cut.name, cut.label = CUT_NODE, "Cut plane"
    height = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(cut.outputs["Object"], height.inputs[0])
    kept = _math(tree, "LESS_THAN", height.outputs["Z"], 0.0)
    kept.node.name, kept.node.label = LIMIT_NODE, "Kept"

    scale = tree.nodes.new("ShaderNodeValue")
    scale.name, scale.label = DENSITY_NODE, "Density"
    scale.outputs[0].default_value = density
    return _math(tree, "MULTIPLY", _math(tree, "MULTIPLY", inside, kept), scale.outputs[0])


def _color(tree: Tree, solid: Solid, look: str) -> Socket:
    if look == COLORS:
        return _attribute(tree, solid.color_grid).outputs["Color"]
    if look == PLAIN:
        color = tree.nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = (*PLAIN_COLOR, 1.0)
        return color.outputs[0]
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = _texture(look)
    tree.links.new(_attribute(tree, REST).outputs["Vector"], group.inputs[0])
    return group.outputs[0]


def _texture(look: str) -> Tree:
    """The node group of a look: rest in, color out. One for all solids, and what a user changed in it stays."""
    name = f"polestar {look}"
    group = bpy.data.node_groups.get(name)
    if group is None:
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        _add_socket(group, "rest", "NodeSocketVector", "INPUT")
        _add_socket(group, "Color", "NodeSocketColor", "OUTPUT")
        place, output = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        group.links.new(_TEXTURES[look](group, place.outputs[0]), output.inputs[0])
        _arrange(group, output)
    return group


def _add_socket(group: Tree, name: str, kind: str, direction: str) -> None:
    if hasattr(group, "interface"):  # Blender 4.0 and later
        group.interface.new_socket(name=name, in_out=direction, socket_type=kind)
    else:
        (group.inputs if direction == "INPUT" else group.outputs).new(kind, name)


def _ramp(tree: Tree, value: Socket, stops: Tuple[Tuple[float, Color], ...], steps: bool = False) -> Socket:
    node = tree.nodes.new("ShaderNodeValToRGB")
    ramp = node.color_ramp
    ramp.interpolation = "CONSTANT" if steps else "LINEAR"
    while len(ramp.elements) < len(stops):
        ramp.elements.new(1.0)
    for element, (position, color) in zip(ramp.elements, stops):
        element.position, element.color = position, (*color, 1.0)
    tree.links.new(value, node.inputs[0])
    return node.outputs["Color"]


def _noise(tree: Tree, place: Socket, scale: float, detail: float) -> Socket:
    """In [0, 1], about 0.5."""
    node = tree.nodes.new("ShaderNodeTexNoise")
    node.inputs["Scale"].default_value, node.inputs["Detail"].default_value = scale, detail
    tree.links.new(place, node.inputs["Vector"])
    return node.outputs["Fac"]


def _shells(tree: Tree, place: Socket) -> Socket:
    depth = _vector_math(tree, "LENGTH", place).outputs["Value"]
    # The borders are a little uneven, as in nature.
    uneven = _math(tree, "MULTIPLY_ADD", _noise(tree, place, 4.0, 2.0), 0.06, -0.03)
    return _ramp(tree, _math(tree, "ADD", depth, uneven), (
        (0.0, (1.0, 0.83, 0.35)), (0.3, (0.95, 0.42, 0.08)), (0.55, (0.62, 0.1, 0.04)), (0.8, (0.2, 0.05, 0.05)),
        (0.93, (0.1, 0.22, 0.34))), steps=True)


def _marble(tree: Tree, place: Socket) -> Socket:
    # Sheets across a slanting direction, bent by noise; veins are where the sine passes through zero.
    along = _vector_math(tree, "DOT_PRODUCT", place, (7.0, 3.0, 5.0)).outputs["Value"]
    phase = _math(tree, "MULTIPLY_ADD", _noise(tree, place, 2.2, 6.0), 14.0, along)
    vein = _math(tree, "ABSOLUTE", _math(tree, "SINE", phase))
    return _ramp(tree, vein, ((0.0, (0.05, 0.06, 0.09)), (0.12, (0.3, 0.3, 0.33)), (0.45, (0.7, 0.68, 0.64)),
                              (1.0, (0.8, 0.78, 0.74))))


def _wood(tree: Tree, place: Socket) -> Socket:
    across = _vector_math(tree, "MULTIPLY", place, (1.0, 1.0, 0.0)).outputs["Vector"]
    radius = _vector_math(tree, "LENGTH", across).outputs["Value"]
    stretched = _vector_math(tree, "MULTIPLY", place, (1.0, 1.0, 0.3)).outputs["Vector"]
    wobbling = _math(tree, "MULTIPLY_ADD", _noise(tree, stretched, 1.5, 2.0), 0.25, radius)
    ring = _math(tree, "FRACT", _math(tree, "MULTIPLY", wobbling, 11.0))
    return _ramp(tree, ring, ((0.0, (0.62, 0.36, 0.16)), (0.6, (0.46, 0.22, 0.08)), (0.9, (0.2, 0.075, 0.025)),
                              (1.0, (0.55, 0.3, 0.13))))


def _coordinates(tree: Tree, place: Socket) -> Socket:
    return _vector_math(tree, "MULTIPLY_ADD", place, (0.5,) * 3, (0.5,) * 3).outputs["Vector"]


_TEXTURES: Dict[str, Callable[[Tree, Socket], Socket]] = {
    "shells": _shells, "marble": _marble, "wood": _wood, "coordinates": _coordinates}


def _arrange(tree: Tree, output: bpy.types.Node) -> None:
    """Columns by the longest way to the output, so that the editor shows what feeds what."""
    column: Dict[str, int] = {output.name: 0}
    waiting = [output]
    while waiting:
        node = waiting.pop()
        for link in (link for socket in node.inputs for link in socket.links):
            if column.get(link.from_node.name, -1) <= column[node.name]:
                column[link.from_node.name] = column[node.name] + 1
                waiting.append(link.from_node)
    rows: Dict[int, int] = {}
    for node in tree.nodes:
        place = column.get(node.name, 0)
        node.location = (-240 * place, -200 * rows.get(place, 0))
        rows[place] = rows.get(place, 0) + 1
