"""The plane that cuts a solid open: an empty that the user moves and turns."""

from typing import Tuple

import bpy
from mathutils import Matrix, Vector

from . import looks

ARROW_SHARE = 0.6  # of the box's diagonal: out of the solid, wherever the plane is


def box_of(obj: bpy.types.Object) -> Tuple[Vector, float]:
    """Middle and diagonal of the object's box, in its own coordinates."""
    corners = [Vector(corner) for corner in obj.bound_box]
    return sum(corners, Vector()) / len(corners), (corners[6] - corners[0]).length


def set_cut(obj: bpy.types.Object, normal: Vector, offset: float = 0.0) -> bpy.types.Object:
    """Takes away what lies beyond a plane, in the direction of `normal`, and returns the plane's empty.

    Both are in the object's coordinates; the plane goes through the middle of its box, or `offset` farther out. It is
    a child of the object and goes along with it.
    """
    center, diagonal = box_of(obj)
    plane = looks.cut_plane(obj)
    if plane is None:
        plane = bpy.data.objects.new(f"{obj.name} cut", None)
        plane.empty_display_type = "SINGLE_ARROW"
        plane.empty_display_size = ARROW_SHARE * diagonal
        plane.parent = obj
        for collection in obj.users_collection:
            collection.objects.link(plane)
        looks.set_cut_plane(obj, plane)
    normal = normal.normalized()
    plane.matrix_local = (Matrix.Translation(center + offset * normal) @
                          normal.to_track_quat("Z", "Y").to_matrix().to_4x4())
    return plane


def remove_cut(obj: bpy.types.Object) -> None:
    plane = looks.cut_plane(obj)
    looks.set_cut_plane(obj, None)
    if plane is not None:
        bpy.data.objects.remove(plane, do_unlink=True)
