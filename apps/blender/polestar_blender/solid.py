"""What a file of polestar's has to offer, and whether that is enough for a look."""

from dataclasses import dataclass
from typing import Dict, List, Optional

from .errors import SolidError
from .vdb_file import Grid, read_grids

COLOR_GRIDS = ("Cd", "color")
DENSITY, SURFACE, REST = "density", "surface", "rest"
FRUSTUM = "NonlinearFrustumMap"

COLORS, PLAIN, AUTO = "colors", "plain", "auto"


@dataclass(frozen=True)
class Solid:
    path: str
    grids: Dict[str, Grid]

    @property
    def color_grid(self) -> Optional[str]:
        return next((name for name in COLOR_GRIDS if name in self.grids), None)

    @property
    def mask_grid(self) -> str:
        """Tells where the solid is: `density`, or `surface` where it is negative."""
        return DENSITY if DENSITY in self.grids else SURFACE

    def look(self, wanted: str) -> str:
        """The look itself, or for `auto` the one that suits the grids. Raises SolidError when they do not have it."""
        if wanted == AUTO:
            wanted = COLORS if self.color_grid else "shells" if REST in self.grids else PLAIN
        if wanted == COLORS and self.color_grid is None:
            raise SolidError(f"{self.path} has no colors: neither Cd nor color among {self._names()}. "
                             "Fill it with polestar transfer, or take a look that is driven by rest")
        if wanted not in (COLORS, PLAIN) and REST not in self.grids:
            raise SolidError(f"{self.path} has no rest among {self._names()}: take what polestar map wrote, "
                             f"or the look {COLORS} or {PLAIN}")
        return wanted

    def warnings(self) -> List[str]:
        found = []
        if REST in self.grids and self.grids[REST].half:
            found.append(f"rest of {self.path} is stored in half floats: its steps of 5e-4 show as bands")
        if self.mask_grid == SURFACE and REST not in self.grids and self.color_grid is None:
            found.append(f"{self.path} has its voxels near the surface alone: Cycles draws it hollow when it is cut")
        return found

    def _names(self) -> str:
        return ", ".join(self.grids)


def inspect(path: str) -> Solid:
    """Raises SolidError when the file is none, or has a grid that Blender would draw as nothing."""
    solid = Solid(path, {grid.name: grid for grid in read_grids(path)})
    if not solid.grids:
        raise SolidError(f"{path} holds no grids")
    if solid.mask_grid not in solid.grids:
        raise SolidError(f"{path} has neither density nor surface among {', '.join(solid.grids)}: "
                         "there is nothing to draw")
    for grid in solid.grids.values():
        _require_usable(path, grid)
    return solid


def _require_usable(path: str, grid: Grid) -> None:
    is_float, is_vector = grid.name in (DENSITY, SURFACE), grid.name in (REST, *COLOR_GRIDS)
    if not (is_float or is_vector):
        return
    if grid.is_empty:
        raise SolidError(f"the grid {grid.name} of {path} is empty: Blender would draw nothing")
    if (is_float and not grid.is_float) or (is_vector and not grid.is_vector):
        raise SolidError(f"the grid {grid.name} of {path} is of type {grid.type}, not "
                         f"{'float' if is_float else 'vec3s'}")
    if grid.transform == FRUSTUM:
        raise SolidError(f"the grid {grid.name} of {path} is a frustum, which Blender shrinks to a dot: resample it")
