"""Friction contacts at nodes as a case gives them, with the areas that they wear on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from sa_solver.types import Array
from workflow.analyses.rig.joint_sections import Joint, JointStiffness
from workflow.analyses.rig.places import Moved
from workflow.analyses.wear.case.sections import PressingForce
from workflow.case.fields import File, Quantity, shown
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import TableFile, read_table_file
from workflow.case.sections import at_entry, disagreement, entry
from workflow.errors import EntryError

WearingFriction = Annotated[float, Quantity("1", above=0.0, at_most=10.0)]
Area = Quantity("mm^2", above=0.0, at_most=1e8)
NodeGap = Quantity("mm", at_least=0.0, at_most=1e3)
# Columns of a file of nodes, in addition to the points.
AREA, GAP = "area", "gap"


class PadContacts(Joint):
    """A friction contact at every node of two pads that a load presses together."""

    law: Literal["friction_contact"] = entry("law at every node of the pads", "friction_contact")
    friction: WearingFriction = entry("limit of the friction force over the normal load [1]", 0.88)
    normal_load: PressingForce = entry("normal load that presses the pads together [N]", "60 N")
    stiffness: JointStiffness = entry("stiffness along the pads, stuck [N/mm]", "45 N/um")
    normal_stiffness: JointStiffness = entry("normal stiffness in contact [N/mm]", "58.5 N/um")


@dataclass(frozen=True)
class ContactTable:
    """Contents of a file about contacts by their ``points``, in its order.

    ``area`` ``(n,)`` [mm²] and ``gap`` ``(n,)`` [mm] are None if the file has no such column.
    """

    table: TableFile
    points: tuple[str, ...]
    area: Array | None
    gap: Array | None

    def order(self, points: Sequence[str]) -> list[int]:
        """Return the rows of these points.

        Raises InputFileError unless each point has one row, and there are no others.
        """
        rows = {point: row for row, point in enumerate(self.points)}
        for point, row in rows.items():
            if point not in points:
                raise self.table.refusal(row, "point", "no joint", "points of structure.joints")
        missing = [point for point in points if point not in rows]
        if missing:
            raise InputFileError(
                f"{self.table.file}: no row for {missing[0]}; allowed: one for each joint"
            )
        return [rows[point] for point in points]


def read_nodes(file: str) -> ContactTable:
    """Return the contents of a CSV file about contacts at nodes. Raises InputFileError."""
    table = read_table_file(file)
    table.require(("point",), "a column point, and area or gap")
    table.check({"point": None, AREA: Area.unit, GAP: NodeGap.unit})
    points = table.cells("point")
    for row, point in enumerate(points):
        if point in points[:row]:
            raise table.refusal(row, "point", "given twice", "every point once")
    quantities = {AREA: Area, GAP: NodeGap}
    area, gap = (
        table.column(name, quantity) if name in table.names else None
        for name, quantity in quantities.items()
    )
    return ContactTable(table, tuple(points), area, gap)


class NodeContacts(PadContacts):
    """A friction contact at every joint of a body, on an area that wears."""

    also_filled_in: ClassVar[tuple[str, ...]] = ("area",)

    law: Literal["friction_contact"] = entry("law of every joint", "friction_contact")
    normal_load: PressingForce = entry("normal load that presses all contacts together [N]", "60 N")
    pressed: Moved | None = entry(
        "points on which the normal load acts, evenly, and its direction; without it every "
        "contact carries its share of the load before it wears, whatever the structure",
        default=None,
    )
    area: Annotated[float, Area] | None = entry(
        "area of all contacts together, each having the same [mm^2]", "1 mm^2", default=None
    )
    nodes: Annotated[str, File((".csv",))] | None = entry(
        "file of each contact, instead of area; columns point, such as pad 17, area [mm^2], and "
        "with pressed the gap before wear [mm]",
        "nodes.csv",
        default=None,
    )
    sharing: Literal["even", "area"] = entry(
        "sharing of stiffness and load among the contacts: even, or by the area of each",
        "area",
        default="area",
    )

    @model_validator(mode="after")
    def _has_areas(self) -> NodeContacts:
        by_node = table = None
        if self.nodes is not None:
            with at_entry("nodes"):
                table = read_nodes(self.nodes)
            by_node = table.area
        if self.area is None and by_node is None:
            wanted = "area of all contacts together" + ("" if table else ", or nodes")
            raise disagreement(f"missing; allowed: {wanted}", "area")
        if self.area is not None and by_node is not None:
            raise disagreement(
                f"{self.area:g} mm^2: given with areas in {shown(self.nodes)}; allowed: one of "
                "them",
                *("area", "nodes"),
            )
        if self.pressed is None and table is not None and table.gap is not None:
            raise disagreement(
                f"gaps in {shown(self.nodes)}, but without pressed every contact carries a load; "
                "allowed: with pressed, points on which the normal load acts",
                *("nodes", "pressed"),
            )
        return self

    def of_points(self, points: Sequence[str]) -> tuple[Array, Array]:
        """Return area [mm²] and gap [mm] of contacts at these points ``(j,)``.

        Raises EntryError for a file of nodes with other points.
        """
        count = len(points)
        area, gap = np.full(count, (self.area or 0.0) / count), np.zeros(count)
        if self.nodes is None:
            return area, gap
        table = read_nodes(self.nodes)
        try:
            rows = table.order(points)
        except InputFileError as error:
            raise EntryError("joint.nodes", str(error)) from error
        return (
            area if table.area is None else table.area[rows],
            gap if table.gap is None else table.gap[rows],
        )
