"""Readers of instrument files that surfalize 0.19 reads wrongly or not at all.

Surfalize reads the two counts before the heights of ``.plu`` as heights, takes the millimetres of
``.tmd`` for micrometres, and knows only some blocks of ``.opd``. The layouts follow the
documentation of Gwyddion (modules sensofar, rmitmd and opdfile).
"""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import Scan
from sa_solver.types import Array

# Sensofar stores heights and steps in um; Wyko stores the wavelength in nm and the step in mm.
MICRON, NANOMETRE = 1e-3, 1e-6
PLU_TOPOGRAPHY, PLU_MISSING = 3, 1000001.0
TMD_MAGIC = b"Binary TrueMap Data File v2.0"
OPD_HEIGHTS = "RAW DATA", "RAW_DATA", "OPD", "Raw", "SAMPLE_DATA"
OPD_ARRAY, OPD_BLOCK = 3, 24
# Data types of numbers by kind of block and size, and of pixels by size.
OPD_NUMBERS = {(6, 2): "<h", (6, 4): "<i", (7, 4): "<f", (8, 8): "<d", (12, 4): "<i"}
OPD_PIXELS = {1: "u1", 2: "<i2", 4: "<f4"}
# Smallest pixel value that means missing; Wyko writes 1e38, which is slightly less in 4 bytes.
OPD_MISSING = {1: np.inf, 2: 32766.0, 4: 9.9e37}


def read_plu(data: bytes) -> Scan:
    """Return the first layer of a Sensofar ``.plu`` file."""
    step_x, step_y = struct.unpack_from("<2f", data, 404)
    (kind,) = struct.unpack_from("<I", data, 428)
    if kind != PLU_TOPOGRAPHY:
        raise InputError(f"a measurement of type {kind}: export an area (type {PLU_TOPOGRAPHY})")
    heights = _lines(data, 508, "<f4", *reversed(struct.unpack_from("<2I", data, 500)))
    heights[heights == PLU_MISSING] = np.nan
    return Scan(MICRON * heights, (MICRON * step_x, MICRON * step_y))


def read_tmd(data: bytes) -> Scan:
    """Return a scan of TrueMap ``.tmd``, whose lengths are all in mm."""
    if not data.startswith(TMD_MAGIC):
        raise InputError(f"it does not begin with '{TMD_MAGIC.decode()}'")
    title = data.index(b"\0") + 1
    comment = data.index(b"\0", title) + 1
    if b"surfalize" in data[title:comment]:
        raise InputError(
            "surfalize up to version 0.19 wrote it, in um where the format has mm: save it as .x3p"
        )
    nx, ny, size_x, size_y = struct.unpack_from("<2I2f", data, comment)
    return Scan(_lines(data, comment + 24, "<f4", nx, ny), (size_x / nx, size_y / ny))


def read_opd(data: bytes) -> Scan:
    """Return the heights of a Wyko ``.opd`` file."""
    name, (_, length, _) = data[2:18], struct.unpack_from("<hiH", data, 18)
    if name.rstrip(b"\0") != b"Directory":
        raise InputError("it does not begin with a directory")
    numbers: dict[str, float] = {}
    heights, place = None, 2 + length
    for at in range(2 + OPD_BLOCK, 2 + length, OPD_BLOCK):
        block = data[at : at + 16].split(b"\0")[0].decode("latin-1")
        kind, size, _ = struct.unpack_from("<hiH", data, at + 16)
        if kind == OPD_ARRAY and block in OPD_HEIGHTS and heights is None:
            heights = _opd_pixels(data, place)
        elif code := OPD_NUMBERS.get((kind, size)):
            (numbers[block],) = struct.unpack_from(code, data, place)
        place += max(size, 0)
    missing = [key for key in ("Wavelength", "Pixel_size") if key not in numbers]
    if heights is None or missing:
        raise InputError(f"no {', '.join(missing) or 'heights'} in it: export it calibrated")
    step, aspect = numbers["Pixel_size"], numbers.get("Aspect", 1.0)
    scale = NANOMETRE * numbers["Wavelength"] / numbers.get("Mult", 1.0)
    return Scan(scale * heights, (step, step * aspect))


def _opd_pixels(data: bytes, place: int) -> Array:
    """Return pixels ``(nx, ny)``, stored column by column from the last line up."""
    nx, ny, size = struct.unpack_from("<3H", data, place)
    if size not in OPD_PIXELS:
        raise InputError(f"heights of {size} bytes each, which is not supported")
    pixels = _lines(data, place + 6, OPD_PIXELS[size], ny, nx).T[:, ::-1]
    return np.where(pixels < OPD_MISSING[size], pixels, np.nan)


def _lines(data: bytes, place: int, code: str, nx: int, ny: int) -> Array:
    """Return numbers ``(nx, ny)`` that are stored line by line, x first."""
    there = (len(data) - place) // np.dtype(code).itemsize
    if not 0 < nx * ny <= there:
        raise InputError(f"{there} of {nx} x {ny} heights in it: it is incomplete or damaged")
    numbers = np.frombuffer(data, code, nx * ny, place)
    return numbers.reshape(ny, nx).T.astype(np.float64)


READERS: dict[str, Callable[[bytes], Scan]] = {".opd": read_opd, ".plu": read_plu, ".tmd": read_tmd}
