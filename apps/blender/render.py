"""Renders a .vdb of polestar's, or frames of a sequence, in Blender without a window.

    blender -b --factory-startup --python-exit-code 1 --python render.py -- FILE.vdb -o OUT.png [options]

Exits with 0 when all pictures are there, 1 for an error of its own, 2 for wrong arguments, and 3 when a file is
missing, cannot be read or written, or lacks what the picture needs: Blender alone draws a blank picture then and exits
with 0. Pictures appear whole or not at all.
"""

import argparse
import math
import os
import sys
import traceback
from dataclasses import dataclass
from typing import List, Optional, Tuple

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from polestar_blender import looks  # noqa: E402
from polestar_blender.cut_plane import box_of, set_cut  # noqa: E402
from polestar_blender.errors import SolidError  # noqa: E402
from polestar_blender.importer import ImportOptions, import_solid, voxel_size  # noqa: E402
from polestar_blender.sequence import at_frame, has_place, is_numbered  # noqa: E402
from polestar_blender.solid import AUTO  # noqa: E402

INTERNAL, USAGE, INPUT_OUTPUT = 1, 2, 3

FORMATS = {".png": "PNG", ".jpg": "JPEG", ".exr": "OPEN_EXR"}
EEVEE = ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE")  # 4.2 to 4.5, and all others

FIELD_OF_VIEW = math.radians(26)
MARGIN = 1.05  # about the solid's box in the picture
PADDING = 3  # voxels between the solid and its box
VOLUME_BOUNCES = 4  # light that goes on inside: without it dense colors are dull
# In sizes of the solid, so that pictures do not depend on its units.
KEY_DISTANCE, KEY_SIZE, FLOOR_SIZE = 6.0, 2.5, 40.0
# A dense volume sends back a few times less light than a surface of its color: the floor is dark, the light strong.
KEY_IRRADIANCE, DOME = 9.0, 1.6
FLOOR_COLOR = (0.11, 0.105, 0.1)


@dataclass(frozen=True)
class Cut:
    normal: Vector
    offset: float  # in [-1, 1], from the middle to the far end


def parsed_frames(text: str) -> Tuple[int, ...]:
    """1-48, 1-240x2 or 7; both ends included."""
    span, _, step = text.partition("x")
    first, _, last = span.partition("-")
    try:
        frames = tuple(range(int(first), int(last or first) + 1, int(step or 1)))
    except ValueError:
        frames = ()
    if not frames:
        raise argparse.ArgumentTypeError(f"{text!r} are no frames: write 1-48, 1-240x2 or 7")
    return frames


def parsed_size(text: str) -> Tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) > 0 and int(height) > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is no size: write 640x480")
    return int(width), int(height)


def parsed_numbers(text: str) -> List[float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if not all(map(math.isfinite, numbers)):
        numbers = []
    return numbers


def parsed_direction(text: str) -> Vector:
    numbers = parsed_numbers(text)
    if len(numbers) != 3 or not any(numbers):
        raise argparse.ArgumentTypeError(f"{text!r} is no direction: write x,y,z")
    return Vector(numbers).normalized()


def parsed_cut(text: str) -> Cut:
    """As polestar render has them: x, -y, z,0.2 or nx,ny,nz[,offset]."""
    axis, _, rest = text.partition(",")
    sign = -1.0 if axis.startswith("-") else 1.0
    if axis.lstrip("+-") in ("x", "y", "z"):
        normal = [0.0, 0.0, 0.0]
        normal["xyz".index(axis[-1])] = sign
        numbers = normal + (parsed_numbers(rest) if rest else [0.0])
    else:
        numbers = parsed_numbers(text)
        numbers += [0.0] if len(numbers) == 3 else []
    if len(numbers) != 4 or not any(numbers[:3]) or not -1 <= numbers[3] <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no plane: write x, -y, z,0.2 or nx,ny,nz[,offset]")
    return Cut(Vector(numbers[:3]).normalized(), numbers[3])


def positive(text: str) -> float:
    numbers = parsed_numbers(text)
    if len(numbers) != 1 or numbers[0] <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is no positive number")
    return numbers[0]


def count(text: str) -> int:
    if not text.isdigit() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is no count")
    return int(text)


def arguments(words: List[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="render.py", description="Renders a .vdb of polestar's in Blender",
        epilog="Example: blender -b --factory-startup --python-exit-code 1 --python render.py -- "
               "kiwi.####.vdb -o kiwi.####.png --frames 1-48 --cut x")
    parser.add_argument("file", metavar="FILE", help="a .vdb; with --frames name.####.vdb or one of its files")
    parser.add_argument("-o", "--output", metavar="OUT", required=True,
                        help="the .png, .jpg or .exr to write; with --frames name.####.png")
    parser.add_argument("--frames", type=parsed_frames, metavar="RANGE", help="1-48, 1-240x2")
    parser.add_argument("--look", choices=[AUTO] + [name for name, *_ in looks.LOOKS], default=AUTO,
                        help="colors are the file's own, plain is one color, all others are driven by rest")
    parser.add_argument("--cut", type=parsed_cut, metavar="PLANE",
                        help="take away what lies beyond: x, -y, z,0.2 or nx,ny,nz[,offset]")
    parser.add_argument("--density", type=positive, metavar="D", help="1/length; default 2 a voxel")
    parser.add_argument("--up", choices=("y", "z"), default="z", help="the axis of the file that points up")
    parser.add_argument("--view", type=parsed_direction, metavar="x,y,z", help="direction that the camera looks along")
    parser.add_argument("--size", type=parsed_size, metavar="WxH", default=(640, 480))
    parser.add_argument("--samples", type=count, metavar="N", default=64)
    parser.add_argument("--engine", choices=("cycles", "eevee"), default="cycles")
    parser.add_argument("-j", "--threads", type=count, metavar="N",
                        default=int(os.environ.get("SLURM_CPUS_PER_TASK", 0)) or None)
    parser.add_argument("--overwrite", action="store_true", help="replace outputs that exist")
    args = parser.parse_args(words)
    if os.path.splitext(args.output)[1] not in FORMATS:
        parser.error(f"{args.output} has to end in one of {', '.join(FORMATS)}")
    if has_place(args.output) != (args.frames is not None):
        parser.error("--frames and a place for the number, as in name.####.png, go together")
    if args.frames is None and has_place(args.file):
        parser.error(f"{args.file} has a place for a number, which --frames has to give")
    if args.frames is not None and not (has_place(args.file) or is_numbered(args.file)):
        parser.error(f"{args.file} has no place for a number: write name.####.vdb")
    return args


def outputs_of(args: argparse.Namespace) -> List[str]:
    """Raises SolidError unless all of them can be written."""
    paths = [at_frame(args.output, frame) for frame in args.frames] if args.frames else [args.output]
    for path in paths:
        if os.path.exists(path) and not args.overwrite:
            raise SolidError(f"{path} exists already: name another file, or add --overwrite")
    temporary = temporary_of(paths[0])
    try:
        open(temporary, "xb").close()
        os.remove(temporary)
    except OSError as error:
        raise SolidError(f"cannot write {paths[0]}: {error.strerror}") from error
    return paths


def temporary_of(path: str) -> str:
    """Beside it, with its suffix, from which Blender takes the format."""
    folder, name = os.path.split(path)
    stem, suffix = os.path.splitext(name)
    return os.path.join(folder or ".", f".{stem}.{os.getpid()}{suffix}")


def empty_scene() -> bpy.types.Scene:
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj, do_unlink=True)
    return bpy.context.scene


def set_engine(scene: bpy.types.Scene, args: argparse.Namespace) -> None:
    if args.engine == "cycles":
        scene.render.engine = "CYCLES"
        scene.cycles.samples = args.samples
        scene.cycles.use_denoising = False  # Debian's Blender has no denoiser
        scene.cycles.volume_bounces = VOLUME_BOUNCES
        return
    for name in EEVEE:
        try:
            scene.render.engine = name
            break
        except TypeError:  # not of this Blender
            continue
    scene.eevee.taa_render_samples = args.samples
    # As fine as it gets: its cells have to resolve a skin.
    scene.eevee.volumetric_tile_size = "2"
    scene.eevee.volumetric_samples = 256
    scene.eevee.volumetric_sample_distribution = 0


def set_output(scene: bpy.types.Scene, args: argparse.Namespace) -> None:
    scene.render.resolution_x, scene.render.resolution_y = args.size
    scene.render.resolution_percentage = 100
    scene.render.use_file_extension = False
    scene.render.image_settings.file_format = FORMATS[os.path.splitext(args.output)[1]]
    scene.view_settings.view_transform = "Standard"
    if args.threads:
        scene.render.threads_mode, scene.render.threads = "FIXED", args.threads


def left_corners(solid: bpy.types.Object) -> List[Vector]:
    """Corners of what is left of the solid's box, in the world: those that are cut away come back to the plane."""
    corners = [Vector(corner) for corner in solid.bound_box]
    plane = looks.cut_plane(solid)
    if plane is not None:
        through, normal = plane.matrix_local.translation, plane.matrix_local.col[2].to_3d()
        corners = [corner - max(0.0, normal.dot(corner - through)) * normal for corner in corners]
    return [solid.matrix_world @ corner for corner in corners]


def add(scene: bpy.types.Scene, name: str, data: bpy.types.ID) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    return obj


def add_stage(scene: bpy.types.Scene, solid: bpy.types.Object, view: Vector) -> None:
    """Camera, key light, dome and floor, about the solid as it is now."""
    corners = left_corners(solid)
    center, size = sum(corners, Vector()) / 8, box_of(solid)[1]
    right = view.cross(Vector((0, 0, 1)))
    right = right.normalized() if right.length > 1e-6 else Vector((1, 0, 0))
    up = right.cross(view)

    camera, distance = add_camera(scene, corners, right, up, view)
    camera.matrix_world = facing(center - distance * view, right, up, view)
    scene.eevee.volumetric_start, scene.eevee.volumetric_end = max(distance - size, distance / 100), distance + size
    add_key(scene, center, size, (0.8 * up - 0.75 * right - 0.65 * view).normalized())
    scene.world = bpy.data.worlds.new("dome")
    scene.world.color = (DOME,) * 3
    add_floor(scene, min(corner.z for corner in corners) + PADDING * voxel_size(solid), FLOOR_SIZE * size)


def add_camera(scene: bpy.types.Scene, corners: List[Vector], right: Vector, up: Vector,
               view: Vector) -> Tuple[bpy.types.Object, float]:
    """With how far from the corners' middle it shows them all."""
    camera = add(scene, "camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit = "VERTICAL"
    camera.data.angle_y = FIELD_OF_VIEW
    tangent = math.tan(FIELD_OF_VIEW / 2)
    slopes = ((right, tangent * scene.render.resolution_x / scene.render.resolution_y), (up, tangent))
    center = sum(corners, Vector()) / len(corners)
    distance = max(MARGIN * abs(axis.dot(corner - center)) / slope - view.dot(corner - center)
                   for corner in corners for axis, slope in slopes)
    camera.data.clip_start, camera.data.clip_end = distance / 100, 100 * distance
    scene.camera = camera
    return camera, distance


def add_key(scene: bpy.types.Scene, center: Vector, size: float, towards: Vector) -> None:
    lamp = bpy.data.lights.new("key", "AREA")
    lamp.shape, lamp.size = "DISK", KEY_SIZE * size
    lamp.energy = KEY_IRRADIANCE * math.pi * (KEY_DISTANCE * size)**2
    key = add(scene, "key", lamp)
    key.matrix_world = (Matrix.Translation(center + KEY_DISTANCE * size * towards) @
                        towards.to_track_quat("Z", "Y").to_matrix().to_4x4())


def add_floor(scene: bpy.types.Scene, height: float, wide: float) -> None:
    mesh = bpy.data.meshes.new("floor")
    mesh.from_pydata([(x * wide, y * wide, height) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], [],
                     [(0, 1, 2, 3)])
    mesh.materials.append(floor_material())
    add(scene, "floor", mesh)


def facing(place: Vector, right: Vector, up: Vector, view: Vector) -> Matrix:
    return Matrix.Translation(place) @ Matrix((right, up, -view)).transposed().to_4x4()


def floor_material() -> bpy.types.Material:
    material = bpy.data.materials.new("floor")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*FLOOR_COLOR, 1)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def view_of(solid: bpy.types.Object, cut: Optional[Cut]) -> Vector:
    """Where the camera looks: onto the cut, a little from aside and from above."""
    if cut is None:
        return Vector((-0.45, 0.8, -0.4)).normalized()
    normal = solid.matrix_world.to_3x3() @ cut.normal
    aside = Vector((0, 0, 1)).cross(normal)
    aside = aside.normalized() if aside.length > 1e-6 else Vector((1, 0, 0))
    return (-normal + 0.4 * aside - Vector((0, 0, 0.35))).normalized()


def prepare(args: argparse.Namespace) -> bpy.types.Scene:
    scene = empty_scene()
    path = at_frame(args.file, args.frames[0]) if args.frames else args.file
    imported = import_solid(bpy.context, path, ImportOptions(
        args.look, args.up == "y", sequence=args.frames is not None, frames=args.frames))
    for warning in imported.warnings:
        print(f"render.py: warning: {warning}", file=sys.stderr)
    solid = imported.object
    if args.density is not None:
        looks.density_socket(solid).default_value = args.density
    if args.cut is not None:
        set_cut(solid, args.cut.normal, args.cut.offset * reach(solid, args.cut.normal))
    set_engine(scene, args)
    set_output(scene, args)
    bpy.context.view_layer.update()
    add_stage(scene, solid, args.view or view_of(solid, args.cut))
    return scene


def reach(solid: bpy.types.Object, normal: Vector) -> float:
    """From the middle of the box to its farthest corner in this direction."""
    center, _ = box_of(solid)
    return max(normal.dot(Vector(corner) - center) for corner in solid.bound_box)


def render(scene: bpy.types.Scene, path: str) -> None:
    temporary = temporary_of(path)
    scene.render.filepath = temporary
    try:
        bpy.ops.render.render(write_still=True)
        if not os.path.exists(temporary) or os.path.getsize(temporary) == 0:
            raise SolidError(f"Blender wrote no picture for {path}: see its own messages")
        os.replace(temporary, path)
    except RuntimeError as error:
        raise SolidError(f"Blender cannot render {path}: {error}") from error
    except OSError as error:
        raise SolidError(f"cannot write {path}: {error.strerror}") from error
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def main(words: List[str]) -> int:
    args = arguments(words)
    try:
        outputs = outputs_of(args)
        scene = prepare(args)
        for number, path in zip(args.frames or (scene.frame_current,), outputs):
            scene.frame_set(number)
            render(scene, path)
    except SolidError as error:
        print(f"render.py: error: {error}", file=sys.stderr)
        return INPUT_OUTPUT
    except Exception:  # Blender itself would exit with 0
        traceback.print_exc()
        return INTERNAL
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []))
