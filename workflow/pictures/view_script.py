"""Shows a run of fretscale in ParaView 5.11 or newer.

    paraview --script=view.py            in a window, from the folder of this file
    pvbatch view.py picture.png          as a picture, without one

``SCENE`` says what is shown; change it, or what is built from it, as you like.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

from paraview import simple

SCENE: dict[str, Any] = {}

# Pixels of a picture; size of an exaggerated motion relative to the model; and margin around the
# model for texts and colour bars.
SIZE, SHARE, ROOM = (1800, 1100), 0.1, 1.15
# Largest number of times that colour ranges are taken from; width of lines in pixels.
TIMES, LINE = 12, 6
# Places to split, by the number of views: "|" puts the halves next to each other, "-" below each
# other. The halves of place n are 2n + 1 and 2n + 2.
CUTS: dict[int, list[tuple[int, str]]] = {
    1: [],
    2: [(0, "|")],
    3: [(0, "|"), (2, "-")],
    4: [(0, "|"), (1, "-"), (2, "-")],
}


def folder() -> Path:
    """Return the folder of this file, which ParaView's window does not pass to a script."""
    here = [Path(str(globals()["__file__"])).parent] if globals().get("__file__") else []
    command = Path("/proc/self/cmdline")
    if command.exists():
        words = command.read_bytes().decode(errors="replace").split("\0")
        named = [word.partition("=")[2] or word for word in words if word.endswith(".py")]
        here += [Path(word).parent for word in named]
    first = SCENE["views"][0]["shown"][0]["file"]
    for place in (*here, Path(), Path("paraview")):
        if (place / first).exists():
            return place.resolve()
    raise SystemExit(f"{first}: not found; start ParaView in the folder of this script")


class ShownFile:
    """File that is shown, with the ranges of its arrays over its times."""

    def __init__(self, path: Path) -> None:
        self.reader = simple.PVDReader(registrationName=path.name, FileName=str(path))
        self.times = [float(time) for time in self.reader.TimestepValues]
        picked = max(1, math.ceil(len(self.times) / TIMES))
        self._looked_at = sorted({*self.times[::picked], self.times[-1]})

    def extent(self) -> list[float]:
        """Return the lengths of the sides of the model."""
        self.reader.UpdatePipeline(self.times[-1])
        bounds = self.reader.GetDataInformation().GetBounds()
        return [bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]]

    def span(self, name: str) -> tuple[float, float]:
        """Return the smallest and largest value of an array, or vector length, over the times."""
        found = []
        for time in self._looked_at:
            self.reader.UpdatePipeline(time)
            array = self.reader.PointData.GetArray(name)
            if array is not None:
                found.append(array.GetRange(-1 if array.GetNumberOfComponents() > 1 else 0))
        return min((low for low, _ in found), default=0.0), max((h for _, h in found), default=0.0)


class ScriptView:
    """View of the window: sources, each with its colours and its motion."""

    def __init__(self, view: Any, title: str) -> None:
        self.view, self._title = view, title
        self._extents, self._moved = [0.0, 0.0, 0.0], False
        view.OrientationAxesVisibility = 1

    def show(self, series: ShownFile, shown: dict[str, Any]) -> None:
        """Show a series, moved along a vector and coloured by an array if it has these."""
        self._extents = [max(pair) for pair in zip(self._extents, series.extent())]  # noqa: B905
        source = series.reader
        if shown.get("warp"):
            largest = series.span(shown["warp"])[1]
            # Displacements are never scaled down.
            least = 1.0 if shown["warp"].endswith("[mm]") else 0.0
            factor = shown.get("factor") or max(self._factor(largest), least)
            vectors = ["POINTS", shown["warp"]]
            source = simple.WarpByVector(Input=source, Vectors=vectors, ScaleFactor=factor)
            self._moved = True
            motion = shown["warp"].partition(" [")[0]
            if factor != 1.0 and f"{motion} x" not in self._title:
                self._title += f", {motion} x {factor:g}"
        display = simple.Show(source, self.view)
        display.LineWidth, display.PointSize = LINE, LINE
        if shown.get("colour"):
            self._colour(display, series, shown["colour"])

    def _factor(self, largest: float) -> float:
        """Return 1, 2 or 5 times a power of ten as a scale that makes the motion well visible."""
        wanted = SHARE * math.dist(self._extents, (0.0, 0.0, 0.0)) / largest if largest else 1.0
        power = 10.0 ** math.floor(math.log10(wanted))
        return max(step * power for step in (1, 2, 5) if step == 1 or step * power <= wanted)

    def _colour(self, display: Any, series: ShownFile, name: str) -> None:
        simple.ColorBy(display, ("POINTS", name))
        colours = simple.GetColorTransferFunction(name)
        low, high = series.span(name)
        known = COLOURED.get(name, (low, high))
        low, high = COLOURED[name] = min(low, known[0]), max(high, known[1])
        # A uniform field needs a range of some width.
        colours.RescaleTransferFunction(low, high if high > low else low + (abs(low) or 1.0))
        display.SetScalarBarVisibility(self.view, True)
        bar = simple.GetScalarBar(colours, self.view)
        bar.Title, bar.ComponentTitle = name, ""

    def label(self, series: ShownFile, time_is: str) -> None:
        """Show the title and the time."""
        title = simple.Text(registrationName=self._title, Text=self._title)
        label = simple.Show(title, self.view)
        label.WindowLocation, label.FontSize = "Upper Center", 16
        if len(series.times) > 1:
            text = f"{time_is.replace(' [1]', '')}: {{time:g}}"
            time = simple.AnnotateTimeFilter(Input=series.reader, Format=text)
            simple.Show(time, self.view).WindowLocation = "Lower Left Corner"

    def aim(self) -> None:
        """Look at the model from above and the side, or straight at a plane that stays plane."""
        flat = [extent < 1e-6 * max(self._extents) for extent in self._extents]
        away, up = [0.3, -0.7, 1.0], [0.0, 0.0, 1.0]
        if flat[1]:
            away = [0.0, -1.0, 0.0]
        elif flat[2] and not self._moved:
            away, up = [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]
        self.view.CameraFocalPoint, self.view.CameraPosition = [0.0, 0.0, 0.0], away
        self.view.CameraViewUp, self.view.CameraParallelProjection = up, 1
        simple.ResetCamera(self.view)
        # ParaView fits the model to the height, even if the view is narrower than high.
        width, height = self.view.ViewSize
        self.view.CameraParallelScale *= ROOM * max(1.0, height / max(width, 1))


# Ranges of the colours of each array, which all views share.
COLOURED: dict[str, tuple[float, float]] = {}


def cut_window(count: int) -> tuple[Any, list[Any]]:
    """Return the window, or a page of it, split into ``count`` views, and the views."""
    empty = simple.GetActiveView() and not simple.GetSources()
    window = simple.GetLayout() if empty else simple.CreateLayout()
    places = {0}
    for place, how in CUTS[count]:
        split = window.SplitHorizontal if how == "|" else window.SplitVertical
        first = split(place, 0.5)
        places = places - {place} | {first, first + 1}
    views = []
    for number in sorted(places):
        view = window.GetView(number)
        if view is None:
            view = simple.CreateRenderView()
            window.AssignView(number, view)
        views.append(view)
    return window, views


def main() -> None:
    """Build the views, go to the first time, and write the picture that was requested."""
    simple.LoadPalette("WhiteBackground")
    here = folder()
    opened: dict[str, ShownFile] = {}
    window, places = cut_window(len(SCENE["views"]))
    views = []
    for place, wanted in zip(places, SCENE["views"]):  # noqa: B905
        view = ScriptView(place, wanted["title"])
        for shown in wanted["shown"]:
            if shown["file"] not in opened:
                opened[shown["file"]] = ShownFile(here / shown["file"])
            view.show(opened[shown["file"]], shown)
        view.label(opened[wanted["shown"][0]["file"]], SCENE["time"])
        views.append(view)
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = SCENE["begin"]
    if len(sys.argv) > 1:
        window.SetSize(*SIZE)
    simple.RenderAllViews()
    for view in views:
        view.aim()
    simple.RenderAllViews()
    if len(sys.argv) > 1:
        simple.SaveScreenshot(sys.argv[1], window, ImageResolution=list(SIZE))


main()
