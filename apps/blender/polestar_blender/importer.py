"""Makes a volume object of a .vdb or of a sequence of them, after a look at every file."""

import math
import os
from dataclasses import dataclass
from typing import List, Optional, Tuple

import bpy

from . import looks
from .errors import SolidError
from .sequence import Sequence, find_sequence, is_numbered
from .solid import AUTO, Solid, inspect

# Optical depth of a voxel: details of the size of voxels stay sharp, and a skin looks like one.
OPTICAL_DEPTH = 2.0


@dataclass(frozen=True)
class ImportOptions:
    look: str = AUTO  # or one of looks.LOOKS
    y_up: bool = False  # the file's y points up; Blender's z does
    sequence: bool = True  # a numbered file stands for all of its sequence
    frames: Optional[Tuple[int, ...]] = None  # of a sequence, that have to be there; default: all from first to last,
    allow_gaps: bool = False  # or else those that are


@dataclass(frozen=True)
class Imported:
    object: bpy.types.Object
    sequence: Optional[Sequence]
    warnings: List[str]


def import_solid(context: bpy.types.Context, path: str, options: ImportOptions = ImportOptions()) -> Imported:
    """Raises SolidError, and leaves the scene as it was, when a file is not as it should be."""
    sequence = _sequence_of(path) if options.sequence else None
    files = _files(path, sequence, options)
    solids = [inspect(file) for file in files]
    look = solids[0].look(options.look)
    for solid in solids[1:]:
        solid.look(look)
        _require_alike(solids[0], solid)

    obj = _volume_object(files[0], sequence)
    context.collection.objects.link(obj)
    _load(context, obj)
    looks.apply_look(obj, solids[0], look, OPTICAL_DEPTH / voxel_size(obj))
    set_y_up(obj, options.y_up)
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    return Imported(obj, sequence, solids[0].warnings() + _differing_transforms(obj))


def set_y_up(obj: bpy.types.Object, y_up: bool) -> None:
    """Turns the object so that its y axis, or else its z axis, points up."""
    obj.rotation_mode = "XYZ"
    obj.rotation_euler = (math.pi / 2 if y_up else 0.0, 0.0, 0.0)


def _sequence_of(path: str) -> Optional[Sequence]:
    """None for a file that is alone."""
    if not is_numbered(path):
        return None
    sequence = find_sequence(path)
    return sequence if len(sequence.numbers) > 1 or not os.path.exists(path) else None


def _files(path: str, sequence: Optional[Sequence], options: ImportOptions) -> List[str]:
    if sequence is None:
        return [path]
    if options.frames is None and not options.allow_gaps:
        sequence.require_no_gaps()
    return [sequence.path(frame) for frame in options.frames or sequence.numbers]


def _require_alike(first: Solid, other: Solid) -> None:
    """One material is for all frames."""
    for name in (first.mask_grid, first.color_grid):
        if name is not None and name not in other.grids:
            raise SolidError(f"{other.path} has no grid {name}, which {first.path} has")


def _volume_object(path: str, sequence: Optional[Sequence]) -> bpy.types.Object:
    name = sequence.stem.rstrip("._-") if sequence else os.path.splitext(os.path.basename(path))[0]
    volume = bpy.data.volumes.new(name or "solid")
    volume.filepath = os.path.abspath(path)
    volume.render.precision = "FULL"  # halves, Cycles' default, are too coarse for rest: steps of 5e-4 at the skin
    if sequence is not None:
        # Frame n of the scene shows file n; before and after, the first and the last.
        volume.is_sequence = True
        volume.frame_start = sequence.first
        volume.frame_offset = sequence.first - 1
        volume.frame_duration = sequence.last - sequence.first + 1
        volume.sequence_mode = "EXTEND"
    return bpy.data.objects.new(volume.name, volume)


def _load(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Until the scene was evaluated a sequence does not know which of its frames it shows."""
    context.view_layer.update()
    volume = obj.data
    if not volume.grids.load():
        path, message = volume.filepath, volume.grids.error_message
        bpy.data.objects.remove(obj)
        bpy.data.volumes.remove(volume)
        raise SolidError(f"Blender cannot load {path}: {message}")


def voxel_size(obj: bpy.types.Object) -> float:
    return obj.data.grids[0].matrix_object.to_scale().x


def _differing_transforms(obj: bpy.types.Object) -> List[str]:
    transforms = {tuple(value for row in grid.matrix_object for value in row) for grid in obj.data.grids}
    if len(transforms) < 2:
        return []
    return [f"the grids of {obj.data.filepath} have {len(transforms)} different transforms: Blender moves each by half "
            "of its own voxel, so that they slide against each other"]
