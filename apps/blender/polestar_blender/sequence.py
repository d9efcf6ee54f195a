"""Numbered files of a sequence, as Blender finds them: the digits stand last in the name, name_0001.vdb."""

import os
import re
from dataclasses import dataclass
from typing import List

from .errors import SolidError

_NUMBERED = re.compile(r"^(?P<stem>.*?)(?P<digits>\d+)(?P<suffix>\.[^.\d][^.]*)$")


@dataclass(frozen=True)
class Sequence:
    folder: str
    stem: str
    digits: int  # that numbers are filled up to with zeros
    suffix: str
    numbers: List[int]  # of the files that are there, ascending

    def path(self, number: int) -> str:
        return os.path.join(self.folder, f"{self.stem}{number:0{self.digits}d}{self.suffix}")

    @property
    def first(self) -> int:
        return self.numbers[0]

    @property
    def last(self) -> int:
        return self.numbers[-1]

    def gaps(self) -> List[int]:
        there = set(self.numbers)
        return [n for n in range(self.first, self.last + 1) if n not in there]

    def require_no_gaps(self) -> None:
        gaps = self.gaps()
        if gaps:
            raise SolidError(f"{len(gaps)} of {self.last - self.first + 1} frames are missing between "
                             f"{self.path(self.first)} and {self.path(self.last)}: {in_ranges(gaps)}. "
                             "A file that is no frame is imported alone without Sequence")


def in_ranges(numbers: List[int]) -> str:
    """Ascending numbers as 2, 5-7."""
    runs: List[List[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)


def is_numbered(path: str) -> bool:
    return _NUMBERED.match(os.path.basename(path)) is not None


def find_sequence(path: str) -> Sequence:
    """The sequence that a numbered file belongs to; the file itself need not be there.

    Numbers have as many digits as the file's, or more where they overflow. Raises SolidError when the name has no
    number before its suffix, or no file of the sequence is there.
    """
    folder, name = os.path.split(path)
    match = _NUMBERED.match(name)
    if match is None:
        raise SolidError(f"{path} has no number before its suffix, as in name_0001.vdb")
    stem, digits, suffix = match["stem"], len(match["digits"]), match["suffix"]
    try:
        names = os.listdir(folder or ".")
    except OSError as error:
        raise SolidError(f"cannot read the folder {folder}: {error.strerror}") from error
    numbers = []
    for other in names:
        found = _NUMBERED.match(other)
        if found and (found["stem"], found["suffix"]) == (stem, suffix):
            number = int(found["digits"])
            if found["digits"] == f"{number:0{digits}d}":
                numbers.append(number)
    if not numbers:
        raise SolidError(f"cannot find {path}, nor any other number of that name")
    return Sequence(folder, stem, digits, suffix, sorted(numbers))


_PLACE = re.compile(r"(?P<signs>#+)|%(0(?P<c>\d+))?d|\$F(?P<houdini>\d*)")


def has_place(path: str) -> bool:
    """Is there a place for a frame's number in the file's name: ####, %04d, %d, $F4 or $F?"""
    return _PLACE.search(os.path.basename(path)) is not None


def at_frame(path: str, number: int) -> str:
    """The path with the number in its place."""
    folder, name = os.path.split(path)

    def filled(place: "re.Match[str]") -> str:
        digits = len(place["signs"] or "") or int(place["c"] or place["houdini"] or 1)
        return f"{number:0{digits}d}"

    return os.path.join(folder, _PLACE.sub(filled, name))
