"""Reads what a .vdb says of its grids, without their voxels and without Blender.

Blender itself is no help here: it draws a file that lacks a grid, or whose grid is empty, as nothing, without a word,
and a truncated file aborts it. So files are looked at before Blender gets them. The layout is that of OpenVDB's
file format 222 to 225, which OpenVDB 3 and later write: a header, then for every grid its descriptor with the
places where it begins and ends, its metadata and its transform. Only their
beginnings are read.
"""

import os
import struct
from dataclasses import dataclass
from typing import BinaryIO, Dict, List

from .errors import SolidError

MAGIC = 0x56444220
FIRST_FORMAT = 222  # from here on compression is told grid by grid
UUID_LENGTH = 36
HALF_SUFFIX = "_HalfFloat"
NAME_END = "\x1e"  # what follows in a descriptor's name tells grids of one name apart
LONGEST_STRING = 1 << 20

# How OpenVDB writes the metadata that is looked at.
_NUMBERS = {"bool": "<?", "int32": "<i", "int64": "<q", "float": "<f", "double": "<d",
            "vec3i": "<3i", "vec3s": "<3f", "vec3d": "<3d"}


@dataclass(frozen=True)
class Grid:
    name: str
    type: str  # OpenVDB's, such as Tree_float_5_4_3
    half: bool
    metadata: Dict[str, object]
    transform: str  # the kind of map, such as UniformScaleTranslateMap

    @property
    def is_float(self) -> bool:
        return self.type.startswith("Tree_float_")

    @property
    def is_vector(self) -> bool:
        return self.type.startswith("Tree_vec3s_")

    @property
    def is_empty(self) -> bool:
        """No voxel is active. A file written without statistics does not say; then it counts as filled."""
        return self.metadata.get("file_voxel_count", 1) == 0


def read_grids(path: str) -> List[Grid]:
    """The grids of a .vdb, in the file's order.

    Raises SolidError when the file cannot be read, is not a .vdb, or ends too early.
    """
    try:
        with open(path, "rb") as file:
            return _Reader(file, path).grids()
    except OSError as error:
        raise SolidError(f"cannot read {path}: {error.strerror or error}") from error


class _Reader:
    def __init__(self, file: BinaryIO, path: str) -> None:
        self._file = file
        self._path = path
        self._size = os.fstat(file.fileno()).st_size

    def grids(self) -> List[Grid]:
        if self._size < 8 or self._numbers("<q")[0] != MAGIC:
            raise SolidError(f"{self._path} is not a .vdb")
        version = self._numbers("<I")[0]
        if version < FIRST_FORMAT:
            raise SolidError(f"{self._path} is a .vdb of the old format {version}: "
                             "write it anew with OpenVDB 3 or later")
        has_offsets = self._numbers("<II?")[2]
        self._bytes(UUID_LENGTH)
        self._metadata()
        count = self._numbers("<i")[0]
        if count > 1 and not has_offsets:
            raise SolidError(f"{self._path} was written as a stream, without the places of its grids: "
                             "write it to a file, not to a pipe")
        return [self._grid(has_offsets) for _ in range(count)]

    def _grid(self, has_offsets: bool) -> Grid:
        name = self._text().split(NAME_END)[0]
        kind = self._text()
        self._text()  # the grid whose tree it shares
        begin, _, end = self._numbers("<3q")
        if has_offsets and not 0 < begin <= end <= self._size:
            raise self._truncated()
        if has_offsets:
            self._file.seek(begin)
        self._numbers("<I")  # compression
        metadata = self._metadata()
        transform = self._text()
        if has_offsets:
            self._file.seek(end)
        half = kind.endswith(HALF_SUFFIX)
        return Grid(name, kind[:-len(HALF_SUFFIX)] if half else kind, half, metadata, transform)

    def _metadata(self) -> Dict[str, object]:
        values: Dict[str, object] = {}
        for _ in range(self._numbers("<I")[0]):
            name, kind = self._text(), self._text()
            raw = self._bytes(self._numbers("<I")[0])
            if kind == "string":
                values[name] = raw.decode("utf-8", "replace")
            elif kind in _NUMBERS and len(raw) == struct.calcsize(_NUMBERS[kind]):
                numbers = struct.unpack(_NUMBERS[kind], raw)
                values[name] = numbers if len(numbers) > 1 else numbers[0]
        return values

    def _text(self) -> str:
        return self._bytes(self._numbers("<I")[0]).decode("utf-8", "replace")

    def _numbers(self, layout: str) -> tuple:
        return struct.unpack(layout, self._bytes(struct.calcsize(layout)))

    def _bytes(self, count: int) -> bytes:
        found = self._file.read(count) if count <= LONGEST_STRING else b""
        if len(found) != count:
            raise self._truncated()
        return found

    def _truncated(self) -> SolidError:
        return SolidError(f"{self._path} is truncated or damaged: copy or write it anew")
