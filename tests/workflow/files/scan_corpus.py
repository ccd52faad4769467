"""Small scans in instrument file formats, packed from the descriptions of the formats.

Nothing of the readers is used, and heights are known: :data:`LINES` in um, the lines along x one
after the other, 0.5 um apart along x and 0.75 um along y. SurfaceTopography 1.27.1 reads the same
heights and pitch from each binary file except `zipped.sur`, which it does not accept.
Sources: ISO 25178-71 (.sdf), ISO 25178-72 (.x3p), Digital Surf's file format of 2009 (.sur), the
specification of AL3D 1.0 (.al3d), digitalmetrology.com/omnisurf3d-file-format (.os3d), Gwyddion's
user guide (.gwy, text) and its modules sensofar, sensofarx, rmitmd, opdfile and keyence.
"""

import hashlib
import io
import struct
import zipfile
import zlib

import numpy as np

NX, NY = 7, 5
DX, DY = 0.5, 0.75
# Eighths of a micron, higher along x and y, with nothing that looks the same when it is mirrored.
STEPS = (np.arange(NX) ** 2)[None, :] + 3 * np.arange(NY)[:, None]
WHOLE = STEPS / 8.0
LINES = WHOLE.copy()
LINES[1, 2] = np.nan
GONE = np.isnan(LINES)


def filled(missing, code, scale=1.0):
    """Return heights as numbers of a file, with the missing point in the file's notation."""
    return np.where(GONE, missing, np.nan_to_num(LINES) * scale).astype(code).tobytes()


def zipped(files, before=b""):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return before + stream.getvalue()


def x3p(kind="D"):
    """Return metres as doubles, or counts of 1e-7 m with a file of the valid points."""
    data = {"D": filled(np.nan, "<f8", 1e-6), "I": (STEPS + 0 * GONE).astype("<i2").tobytes()}[kind]
    step, link = ("1", "") if kind == "D" else ("1.25e-7", "<ValidPointsLink>v</ValidPointsLink>")
    axis = "<{0}><AxisType>{1}</AxisType><DataType>{2}</DataType><Increment>{3}</Increment></{0}>"
    axes = [("CX", "I", "D", DX * 1e-6), ("CY", "I", "D", DY * 1e-6), ("CZ", "A", kind, step)]
    main = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1>'
        "<Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>"
        + "".join(axis.format(*each) for each in axes)
        + f"</Axes></Record1><Record3><MatrixDimension><SizeX>{NX}</SizeX><SizeY>{NY}</SizeY>"
        f"<SizeZ>1</SizeZ></MatrixDimension><DataLink><PointDataLink>d</PointDataLink>"
        f"<MD5ChecksumPointData>{hashlib.md5(data).hexdigest()}</MD5ChecksumPointData>{link}"
        "</DataLink></Record3></p:ISO5436_2>"
    ).encode()
    files = {"main.xml": main, "d": data}
    if kind == "I":
        files["v"] = np.packbits(~GONE.ravel(), bitorder="little").tobytes()
    files["md5checksum.hex"] = f"{hashlib.md5(main).hexdigest()} *main.xml"
    return zipped(files)


def sur(unit="µm", per_micron=1.0, inverted=0, pressed=False):
    """Return counts of an eighth of a micron in any unit, or the same compressed."""
    counts = np.where(GONE, -3, STEPS).astype("<i4").tobytes()
    stream = struct.pack("<3I", 1, len(counts), len(zlib.compress(counts))) + zlib.compress(counts)
    units = [text.encode("latin-1").ljust(16) for text in ("X", "Y", "Z", "mm", "mm", unit)]
    units += [text.encode("latin-1").ljust(16) for text in ("mm", "mm", unit)]
    head = struct.pack("<12s4h30s30s", b"DSCOMPRESSED" if pressed else b"DIGITAL SURF", 0, 1, 1, 2,
                       b"part".ljust(30), b"us".ljust(30))  # fmt: skip
    head += struct.pack("<5hf4xh", 0, 0, 0, 1, 0, 0.0, 32)
    head += struct.pack("<5i", -1, int(STEPS.max()), NX, NY, NX * NY)
    head += struct.pack("<3f", DX * 1e-3, DY * 1e-3, per_micron / 8.0) + b"".join(units)
    head += struct.pack("<3f3h12x7hfI", 1, 1, 1, 0, inverted, 0, 0, 0, 0, 1, 1, 2024, 0, 0.0,
                        len(stream) if pressed else 0)  # fmt: skip
    head += struct.pack("<6x2h128s5f13s13s", 0, 0, b"", 0, 0, 0, 0, 0, b"", b"")
    assert len(head) == 512
    return head + (stream if pressed else counts)


def al3d():
    tags = {"Version": 1, "TagCount": 8, "Rows": NY, "Cols": NX, "PixelSizeXMeter": DX * 1e-6}
    tags |= {"PixelSizeYMeter": DY * 1e-6, "InvalidPixelValue": 3e15, "NumberOfPlanes": 0}
    tags |= {"DepthImageOffset": 900, "TextureImageOffset": 0}
    head = b"AliconaImaging\0\r\n"
    for key, value in tags.items():
        head += struct.pack("<20s30s2s", key.encode(), str(value).encode(), b"\r\n")
    rows = np.zeros((NY, NX + NX % 2), dtype="<f4")  # of multiples of 8 bytes
    rows[:, :NX] = np.where(GONE, np.float32(3e15), 1e-6 * WHOLE)
    return head.ljust(900, b"\0") + rows.tobytes()


def sdf_text():
    head = {"ManufacID": "us", "CreateDate": "010120240000", "ModDate": "010120240000"}
    head |= {"NumPoints": NX, "NumProfiles": NY, "Xscale": DX * 1e-6, "Yscale": DY * 1e-6}
    head |= {"Zscale": 1.25e-7, "Zresolution": -1, "Compression": 0, "DataType": 5, "CheckType": 0}
    rows = [" ".join("BAD" if gone else str(z) for z, gone in zip(*row, strict=True))
            for row in zip(STEPS, GONE, strict=True)]  # fmt: skip
    lines = ["aISO-1.0", *(f"{key} = {value}" for key, value in head.items()), "*", *rows, "*", "*"]
    return "\r\n".join(lines).encode()


def sdf_binary():
    head = struct.pack("<8s10s12s12s2H", b"bISO-1.0", b"us".ljust(10), b"010120240000",
                       b"010120240000", NX, NY)  # fmt: skip
    head += struct.pack("<4d3B", DX * 1e-6, DY * 1e-6, 1.25e-7, -1.0, 0, 5, 0)
    return head + np.where(GONE, -32768, STEPS).astype("<i2").tobytes()


def plu():
    head = b"2024-01-01 00:00:00".ljust(128, b"\0") + struct.pack("<I256s", 0, b"test")
    head += struct.pack("<3I7f", NY, NX, NX, 1.0, DX, DY, 0.0, 0.0, 2.0, 0.0)
    head += struct.pack("<10IdfII", 3, 3, 0, 14, 3, NX, NY, NY, NX, 1, 0.1, 50.0,
                        10, 0)  # fmt: skip
    head += struct.pack("<8BI", 1, 1, 251, 6, 0, 0, 0, 0, 1) + struct.pack("<2I", NY, NX)
    return head + filled(1000001, "<f4") + struct.pack("<2f", 0.0, WHOLE.max())


def plux():
    index = (
        "<xml><GENERAL><DATE>2024-01-01 00:00:00</DATE>"
        f"<IMAGE_SIZE_X>{NX}</IMAGE_SIZE_X><IMAGE_SIZE_Y>{NY}</IMAGE_SIZE_Y>"
        f"<FOV_X>{DX}</FOV_X><FOV_Y>{DY}</FOV_Y></GENERAL><INFO><ITEM_0><NAME>Device</NAME>"
        "<VALUE>S neox</VALUE></ITEM_0></INFO><LAYER_0><FILENAME_Z>LAYER_0.raw</FILENAME_Z>"
        "</LAYER_0></xml>"
    )
    return zipped({"index.xml": index, "LAYER_0.raw": filled(np.nan, "<f4")})


def os3d():
    head = b"OmniSurf3D" + struct.pack("<3i4s", 1, 0, 4, b"part") + struct.pack("<i19s", 19,
                                                       b"2024-01-01 00:00:00")  # fmt: skip
    head += struct.pack("<2i4d", NX, NY, DX, DY, 0.0, 0.0)
    return head + filled(-3.4028235e38, "<f4") + b"\0"


def tmd(comment=b"Created by TrueMap v6\r\n\0"):
    """Return a file with all lengths in mm, including heights."""
    head = b"Binary TrueMap Data File v2.0\r\n\0" + comment
    head += struct.pack("<2I4f", NX, NY, 1e-3 * NX * DX, 1e-3 * NY * DY, 0.0, 0.0)
    return head + (1e-3 * WHOLE).astype("<f4").tobytes()


def opd(name=b"Raw", pixels=4):
    """Return heights in wavelengths of 500 nm over `Mult`, columns from the last line up."""
    scale, missing = {4: (2.0, 1e38), 2: (2000.0, 32767)}[pixels]
    mult = {4: 1, 2: 1000}[pixels]
    raw = np.where(GONE, missing, np.nan_to_num(LINES) * scale)[::-1].T
    blocks = [(b"Preview", 15, b"\1\2"), (b"Wavelength", 7, struct.pack("<f", 500.0)),
              (b"Mult", 6, struct.pack("<h", mult)), (b"Aspect", 7, struct.pack("<f", DY / DX)),
              (b"Title", 5, b"part\0"), (b"Pixel_size", 7, struct.pack("<f", 1e-3 * DX)),
              (name, 3, struct.pack("<3H", NX, NY, pixels)
               + raw.astype({4: "<f4", 2: "<i2"}[pixels]).tobytes())]  # fmt: skip
    entries = [(b"Directory", 1, 24 * (len(blocks) + 1))]
    entries += [(name, kind, len(content)) for name, kind, content in blocks]
    head = b"".join(struct.pack("<16shiH", *entry, 0xFFFF) for entry in entries)
    return b"\1\0" + head + b"".join(content for *_, content in blocks)


def gwy():
    """Return heights in metres in the second channel, with a mask; volts in the first."""

    def item(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + value

    def thing(name, *items):
        return name.encode() + b"\0" + struct.pack("<I", len(b"".join(items))) + b"".join(items)

    def unit(text):
        return thing("GwySIUnit", item("unitstr", "s", text.encode() + b"\0"))

    def field(numbers, z):
        sizes = [("xres", "i", NX), ("yres", "i", NY), ("xreal", "d", NX * DX * 1e-6),
                 ("yreal", "d", NY * DY * 1e-6)]  # fmt: skip
        items = [item(name, kind, struct.pack("<" + kind, of)) for name, kind, of in sizes]
        data = struct.pack("<I", numbers.size) + numbers.astype("<f8").tobytes()
        units = [item("si_unit_xy", "o", unit("m")), item("si_unit_z", "o", unit(z))]
        return thing("GwyDataField", *items, *units, item("data", "D", data))

    return b"GWYP" + thing(
        "GwyContainer",
        item("/0/data/title", "s", b"Phase\0"),
        item("/0/data", "o", field(-WHOLE, "V")),
        item("/3/data/title", "s", b"Height\0"),
        item("/3/data", "o", field(1e-6 * WHOLE, "m")),
        item("/3/mask", "o", field(1.0 * GONE, "")),
    )


def vk4():
    """Return counts of 125 nm; the file cannot mark a missing point."""
    places = dict.fromkeys(range(17), 0) | {0: 84, 6: 400, 16: 2000}
    head = b"VK4_" + bytes(8) + struct.pack("<18I", *places.values(), 0)
    conditions = np.zeros(70, dtype="<u4")
    conditions[:7] = 280, 2024, 1, 1, 0, 0, 0
    conditions[42:45] = 1e6 * DX, 1e6 * DY, 125000  # pm
    image = struct.pack("<7I768x", NX, NY, 32, 0, 4 * NX * NY, 0, 0)
    file = (head + conditions.tobytes()).ljust(400, b"\0") + image + STEPS.astype("<u4").tobytes()
    return file.ljust(2000, b"\0") + struct.pack("<I8sI8s", 4, b"p\0a\0r\0t\0", 4, b"l\0e\0n\0s\0")


BINARY = {
    "doubles.x3p": x3p(),
    "counts.x3p": x3p("I"),
    "microns.sur": sur(),
    "metres.sur": sur("m", 1e-6),
    "zipped.sur": sur("nm", 1e3, pressed=True),
    "s.al3d": al3d(),
    "text.sdf": sdf_text(),
    "binary.sdf": sdf_binary(),
    "s.plu": plu(),
    "s.plux": plux(),
    "s.os3d": os3d(),
    "s.tmd": tmd(),
    "floats.opd": opd(),
    "counts.opd": opd(b"RAW_DATA", 2),
    "s.gwy": gwy(),
    "s.vk4": vk4(),
    "s.vk6": zipped({"Vk4File": vk4()}, b"VK6" + bytes(60)),
    "s.vk7": zipped({"Vk4File": vk4()}, b"VK7" + bytes(60)),
}
WITHOUT_GAPS = ".tmd", ".vk4", ".vk6", ".vk7"

_HEIGHTS = [["nan" if gone else repr(float(z)) for z, gone in zip(*row, strict=True)]
            for row in zip(WHOLE, GONE, strict=True)]  # fmt: skip
_POINTS = [(DX * i, DY * j, z) for j, row in enumerate(_HEIGHTS) for i, z in enumerate(row)]


def points(heading, separator=",", comma=False, end="\n"):
    """Return a table of x, y and z in um."""
    rows = [separator.join(map(str, point)) for point in _POINTS]
    text = end.join([heading, *rows] if heading else rows) + end
    return text.replace(".", ",") if comma else text


def gwyddion(words, per_micron=1e-6):
    """Return lines along x below Gwyddion's header in some language."""
    channel, width, height, unit = words
    lines = ["\t".join("nan" if z == "nan" else f"{float(z) * per_micron:.9g}" for z in row)
             for row in _HEIGHTS]  # fmt: skip
    head = [f"# {channel} Topography", f"# {width} {NX * DX} µm", f"# {height} {NY * DY} µm"]
    return "\n".join([*head, f"# {unit} m", *lines]) + "\n"


ENGLISH = "Channel:", "Width:", "Height:", "Value units:"
GERMAN = "Kanal:", "Breite:", "Höhe:", "Einheiten:"
TEXT = {
    "excel_utf16.csv": points("x [µm],y [µm],z [µm]", end="\r\n").encode("utf-16"),
    "utf16_big.csv": b"\xfe\xff" + points("x [µm],y [µm],z [µm]").encode("utf-16-be"),
    "utf16_no_mark.csv": points("x [µm],y [µm],z [µm]").encode("utf-16-le"),
    "latin1.csv": points("x [µm],y [µm],z [µm]", end="\r\n").encode("latin-1"),
    "marked.csv": points("x [um],y [um],z [um]").encode("utf-8-sig"),
    "excel_german.csv": points("x [µm];y [µm];z [µm]", ";", True, "\r\n").encode("latin-1"),
    "labview.txt": points("x (µm)\ty (µm)\tz (µm)", "\t", end="\r\n").encode("latin-1"),
    "keyence.csv": points("x in µm,y in µm,z in µm").encode("utf-16"),
    "blanks.txt": points("  x [um]   y [um]  z [um]", "   ").encode(),
    "gwyddion.txt": gwyddion(ENGLISH).encode(),
    "gwyddion_german.txt": gwyddion(GERMAN).encode("latin-1"),
}
# Files without units, and what is beside them.
BARE = {
    "points.txt": (points("", " "), "um", None),
    "points.xyz": (points("", "\t"), "um", (DX, DY)),
    "points.csv": (points(""), "um", None),
    "matrix.txt": ("\n".join("  ".join(r) for r in zip(*_HEIGHTS, strict=True)), "um", (DX, DY)),
    "matrix.csv": ("\n".join(";".join(r) for r in zip(*_HEIGHTS, strict=True)), "um", (DX, DY)),
}
# What cannot be read, and a part of what is said of it: why, and what to do.
REFUSED = {
    "empty.txt": (gwyddion(ENGLISH).partition(" m\n")[0].encode() + b" m\n", "empty", "rows"),
    "no_unit.txt": (points("", " ").encode(), "without a unit", "headings such as x [mm]"),
    "tabs_german.txt": (points("x [um]\ty [um]\tz [um]", "\t", True).encode(), "a decimal comma",
                        "semicolons"),
    "volts.txt": (gwyddion(ENGLISH).replace("units: m", "units: V").encode(), "unit 'V'",
                  "lengths"),
    "zygo.xyz": (b"Zygo XYZ Data File - Format 1\n0 0 No Data\n", "unknown column", "allowed: x"),
    "words.txt": (points("x [um] y [um] z [um]", " ").replace("nan", "***").encode(), "'***'",
                  "nothing where one is missing"),
    "marks.txt": (gwyddion(ENGLISH).replace("# Width", "# Pitch").encode(), "unit and pitch",
                  "state both"),
    "binary.txt": (bytes(range(256)), "cannot be read", "UTF-8, UTF-16 or Latin-1"),
    "s.nms": (b"", "no scan in a supported format", "export it as .x3p"),
    "s.zmg": (b"Zeta-Instruments", "no scan in a supported format", "export it as .x3p"),
    "s.zon": (b"KPK0", "no scan in a supported format", "export it as .x3p"),
    "inverted.sur": (sur(inverted=1), "inverted", "export"),
    "surfalize.tmd": (tmd(b"Exported by surfalize\r\n\0"), "surfalize up to", "save it as .x3p"),
    "cut.plu": (plu()[:-80], "incomplete or damaged", "allowed: a scan"),
    "cut.opd": (opd()[:-80], "incomplete or damaged", "allowed: a scan"),
    "profile.plu": (plu()[:428] + b"\1" + plu()[429:], "type 1", "export an area"),
    "misnamed.opd": (plu(), "does not begin with a directory", "allowed: a scan"),
    "uncalibrated.opd": (opd().replace(b"Wavelength", b"Wavelengtx"), "no Wavelength",
                         "calibrated"),
    "counts.os3d": (os3d().replace(filled(-3.4028235e38, "<f4"), STEPS.astype("<i4").tobytes()),
                    "e-48 mm", "damaged"),
    "damaged.plux": (plux().replace(b"\0\0", b"\0\1", 60), "damaged, or of another kind", "scan"),
    "far.os3d": (os3d().replace(struct.pack("<d", DX), struct.pack("<d", DX * 1e6)), "apart",
                 "another unit"),
}  # fmt: skip
