"""File > Import > polestar (.vdb), and the panel in the sidebar (N) of the 3D view."""

from typing import Set

import bpy
from bpy_extras.io_utils import ImportHelper
from mathutils import Vector

from . import looks
from .cut_plane import remove_cut, set_cut
from .errors import SolidError
from .importer import ImportOptions, import_solid, set_y_up
from .solid import AUTO, inspect

DONE, CANCELLED = {"FINISHED"}, {"CANCELLED"}

_AUTO_LOOK = (AUTO, "What the file has", "Its own colors where there are any, else shells by its rest")
_UP_AXES = (("z", "z up", "The file's z axis points up"), ("y", "y up", "The file's y axis points up"))


class ImportSolid(bpy.types.Operator, ImportHelper):
    """Import a .vdb of polestar's, or a numbered sequence of them, with a material"""

    bl_idname = "import_scene.polestar"
    bl_label = "Import polestar"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".vdb"
    filter_glob: bpy.props.StringProperty(default="*.vdb", options={"HIDDEN"})
    look: bpy.props.EnumProperty(name="Look", items=(_AUTO_LOOK, *looks.LOOKS), default=AUTO)
    up: bpy.props.EnumProperty(name="Up", items=_UP_AXES, default="z")
    sequence: bpy.props.BoolProperty(
        name="Sequence", default=True, description="A numbered file, name_0001.vdb, stands for all of its sequence")
    allow_gaps: bpy.props.BoolProperty(
        name="Allow gaps", default=False,
        description="Import a sequence although frames are missing; Blender draws nothing there")

    def execute(self, context: bpy.types.Context) -> Set[str]:
        path = bpy.path.abspath(self.filepath)
        try:
            imported = import_solid(context, path, ImportOptions(
                self.look, self.up == "y", self.sequence, allow_gaps=self.allow_gaps))
        except SolidError as error:
            self.report({"ERROR"}, str(error))
            return CANCELLED
        for warning in imported.warnings:
            self.report({"WARNING"}, warning)
        if imported.sequence is not None:
            self.report({"INFO"}, f"frames {imported.sequence.first} to {imported.sequence.last}")
        return DONE


class _OfSolid(bpy.types.Operator):
    """What can be done with an imported solid"""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return solid_object(context) is not None


class SetLook(_OfSolid):
    """Draw the solid with other colors; density and cut plane stay"""

    bl_idname = "polestar.set_look"
    bl_label = "Look"

    look: bpy.props.EnumProperty(name="Look", items=looks.LOOKS)

    def execute(self, context: bpy.types.Context) -> Set[str]:
        obj = solid_object(context)
        try:
            solid = inspect(bpy.path.abspath(obj.data.filepath))
            looks.apply_look(obj, solid, solid.look(self.look))
        except SolidError as error:
            self.report({"ERROR"}, str(error))
            return CANCELLED
        return DONE


class AddCut(_OfSolid):
    """Cut the solid open: an empty marks the plane, its arrow points to what is taken away"""

    bl_idname = "polestar.add_cut"
    bl_label = "Add Cut Plane"

    normal: bpy.props.FloatVectorProperty(name="Normal", default=(1.0, 0.0, 0.0), subtype="XYZ")
    offset: bpy.props.FloatProperty(name="Offset", unit="LENGTH")

    def execute(self, context: bpy.types.Context) -> Set[str]:
        if not any(self.normal):
            self.report({"ERROR"}, "the normal of the cut plane is zero")
            return CANCELLED
        set_cut(solid_object(context), Vector(self.normal), self.offset)
        return DONE


class RemoveCut(_OfSolid):
    """Draw the whole solid again"""

    bl_idname = "polestar.remove_cut"
    bl_label = "Remove Cut Plane"

    def execute(self, context: bpy.types.Context) -> Set[str]:
        remove_cut(solid_object(context))
        return DONE


class SetUp(_OfSolid):
    """Turn the object so that this axis of the file points up"""

    bl_idname = "polestar.set_up"
    bl_label = "Up Axis"

    up: bpy.props.EnumProperty(name="Up", items=_UP_AXES)

    def execute(self, context: bpy.types.Context) -> Set[str]:
        set_y_up(solid_object(context), self.up == "y")
        return DONE


class SolidPanel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_polestar"
    bl_label = "polestar"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "polestar"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column()
        obj = solid_object(context)
        if obj is None:
            column.label(text="No solid is selected")
            column.operator(ImportSolid.bl_idname)
            return
        names = {look: name for look, name, _ in looks.LOOKS}
        column.operator_menu_enum(SetLook.bl_idname, "look",
                                  text=f"Look: {names[looks.material_of(obj)[looks.LOOK_PROPERTY]]}")
        column.prop(looks.density_socket(obj), "default_value", text="Density")
        plane = looks.cut_plane(obj)
        column.separator()
        if plane is None:
            column.operator(AddCut.bl_idname)
        else:
            column.prop(plane, "location", text="Cut at")
            column.prop(plane, "rotation_euler", text="Turned by")
            column.operator(RemoveCut.bl_idname)
        column.separator()
        column.label(text="Up axis of the file")
        column.row().operator_enum(SetUp.bl_idname, "up")
        if obj.data.is_sequence:
            column.separator()
            column.label(text=f"Frames {obj.data.frame_start} to {obj.data.frame_start + obj.data.frame_duration - 1}")


def solid_object(context: bpy.types.Context) -> "bpy.types.Object | None":
    """The active object, or the solid whose cut plane is active."""
    obj = context.object
    if obj is not None and obj.type == "EMPTY" and obj.parent is not None:
        obj = obj.parent
    return obj if obj is not None and looks.material_of(obj) is not None else None


def _menu_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(ImportSolid.bl_idname, text="polestar (.vdb)")


_CLASSES = (ImportSolid, SetLook, AddCut, RemoveCut, SetUp, SolidPanel)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(_menu_entry)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu_entry)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
