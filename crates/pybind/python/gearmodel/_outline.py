"""A gear's outline: an array that can be drawn and exported."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._native import outline_dxf, outline_svg


class Outline(np.ndarray[Any, np.dtype[np.float64]]):
    """Closed outline of a gear: points (x, y), mm, shape (n, 2), counter-clockwise, the first repeated at the end.

    Made by ``GearPair.outline``. It is an array in every respect; the methods below are for a whole outline, not for
    parts cut from it.
    """

    layer: str

    def __new__(cls, points: NDArray[np.float64], layer: str = "0") -> Outline:
        outline = np.asarray(points, dtype=np.float64).view(cls)
        if outline.ndim != 2 or outline.shape[1] != 2:
            raise ValueError(f"points have shape {outline.shape}: (n, 2) is needed")
        outline.layer = layer
        return outline

    def __array_finalize__(self, obj: Any) -> None:
        self.layer = getattr(obj, "layer", "0")

    @property
    def area_mm2(self) -> float:
        """Enclosed area, mm2."""
        x, y = np.asarray(self).T
        return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2)

    def to_dxf(self, path: str | os.PathLike[str]) -> None:
        """Writes a DXF drawing (R12, one closed polyline, mm)."""
        Path(path).write_text(outline_dxf(np.asarray(self), self.layer), encoding="ascii")

    def to_svg(self, path: str | os.PathLike[str]) -> None:
        """Writes an SVG drawing (mm, y upwards, the axis marked)."""
        Path(path).write_text(outline_svg(np.asarray(self)), encoding="utf-8")
