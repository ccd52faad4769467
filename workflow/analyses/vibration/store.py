"""Datasets and tables of vibration cases, with their units."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from sa_solver.types import Array
from workflow.shell.store import replacing

# Datasets larger than this are worth packing.
LARGE = 4096
# Unit and description of datasets, by name.
Described = Mapping[str, tuple[str, str]]


def put(file: h5py.File, place: str, values: Mapping[str, Array], known: Described) -> h5py.Group:
    """Write the datasets of a group, each with its unit and description."""
    for name, own in values.items():
        packed = {"compression": "gzip", "compression_opts": 1} if own.size > LARGE else {}
        dataset = file.create_dataset(f"{place}/{name}", data=own, **packed)
        dataset.attrs["unit"], dataset.attrs["description"] = known[name]
    return file[place]


def write_table(path: Path, curves: Mapping[str, Array], known: Described) -> None:
    """Curves as columns of a CSV file, of what has several values at a point one for each."""
    columns: dict[str, Array] = {}
    for name, values in curves.items():
        unit = known[name][0]
        if values.ndim == 1:
            columns[f"{name} [{unit}]"] = values
        else:
            columns |= {f"{name}_{n} [{unit}]": own for n, own in enumerate(values.T, start=1)}
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in np.column_stack(list(columns.values())):
            writer.writerow([f"{value:.9g}" for value in row])
