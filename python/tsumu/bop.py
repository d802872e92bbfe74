"""BOP scene folders in, BOP results out, so that results can be compared (https://bop.felk.cvut.cz, format of the challenge).

    python -m tsumu.bop SCENE_FOLDER… --models MODELS --out METHOD_DATASET-test.csv [--objects 1 5]

A scene folder holds `scene_camera.json` and `depth/000000.png`; MODELS holds `obj_000001.ply` …, in millimetres. Needs Pillow.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .bins import Bin
from .catalog import Catalog
from .errors import BadInput, TsumuError
from .frames import needed

#: Columns of a result file.
COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t", "time")
#: Tsumu looks from above, a camera along +z: half a turn about x, both ways.
_TURN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Estimate:
    """One row of a result."""

    #: Number of the scene.
    scene: int
    #: Number of the image.
    image: int
    #: Number of the object.
    object: int
    #: Confidence, in [0, 1].
    score: float
    #: (3, 3) rotation of camera_from_model.
    rotation: npt.NDArray[np.float64]
    #: (3,) translation of camera_from_model, millimetres.
    translation_mm: npt.NDArray[np.float64]
    #: Seconds spent on the whole image; the same in all its rows.
    seconds: float


def models(folder: str | os.PathLike[str], objects: Iterable[int] | None = None) -> Catalog:
    """The objects of a BOP models folder as block types named `1`, `2` … Raises `BadInput`."""
    found = {int(m[1]): path for path in Path(folder).glob("obj_*.ply") if (m := re.fullmatch(r"obj_(\d+)\.ply", path.name))}
    wanted = sorted(found if objects is None else objects)
    missing = [number for number in wanted if number not in found]
    if missing or not wanted:
        raise BadInput(f"{folder}: has no obj_{missing[0] if missing else 1:06d}.ply")
    return Catalog.of_files({str(number): found[number] for number in wanted}, unit="mm")


def images(scene: str | os.PathLike[str]) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Number and cloud of each image of a scene: (N, 3) metres in the camera's frame. Raises `BadInput` with file and key."""
    file = Path(scene) / "scene_camera.json"
    try:
        cameras: Any = json.loads(file.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise BadInput(f"{file}: {error}") from error
    if not isinstance(cameras, dict):
        raise BadInput(f"{file}: an object with one key an image is needed, e.g. {{\"0\": {{\"cam_K\": …}}}}")
    if strange := [key for key in cameras if not re.fullmatch(r"[0-9]+", key)]:
        raise BadInput(f"{file}: the key `{strange[0]}` is not the number of an image")
    for key in sorted(cameras, key=int):
        yield int(key), cloud_of(Path(scene) / "depth" / f"{int(key):06d}.png", cameras[key], file)


def cloud_of(depth_file: Path, camera: dict[str, Any], named: Path) -> npt.NDArray[np.float64]:
    """The cloud of a depth image: (N, 3) metres in the camera's frame, x right, y down, z forward."""
    image = needed("PIL.Image", "pillow")
    try:
        depth = np.asarray(image.open(depth_file), dtype="f8")
        fx, _, cx, _, fy, cy, *_ = (float(v) for v in camera["cam_K"])
        scale = float(camera["depth_scale"])
    except OSError as error:
        raise BadInput(f"{depth_file}: {error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise BadInput(f"{named}: the image of {depth_file.name} needs cam_K (9 numbers) and depth_scale: {error!r}") from error
    if depth.ndim != 2:
        raise BadInput(f"{depth_file}: has {depth.ndim} axes, an image of one channel is needed")
    row, column = np.nonzero(depth)
    z = depth[row, column] * scale / 1000.0
    return np.column_stack([(column - cx) * z / fx, (row - cy) * z / fy, z])


def solve(scene: str | os.PathLike[str], bin: Bin) -> Iterator[Estimate]:
    """Looks at every image of a scene with a bin of `models`."""
    number = scene_number(scene)
    for image, cloud in images(scene):
        if not len(cloud):
            continue  # Nothing was measured, so nothing is there to find.
        start = time.perf_counter()
        look = bin.look(cloud @ _TURN.T, sensor_positions=[0.0, 0.0, 0.0])
        seconds = time.perf_counter() - start
        for grasp in look:
            turned = _TURN @ grasp.pose[:3]
            yield Estimate(number, image, int(grasp.type), grasp.confidence, turned[:, :3], turned[:, 3] * 1000.0, seconds)


def scene_number(scene: str | os.PathLike[str]) -> int:
    """The number a scene folder is called by. Raises `BadInput`."""
    name = Path(scene).resolve().name
    if not name.isdigit():
        raise BadInput(f"{scene}: a scene folder is called by its number, e.g. 000001")
    return int(name)


def write(file: str | os.PathLike[str], estimates: Iterable[Estimate]) -> int:
    """Writes a result file, whole or not at all; how many rows it has. Raises `BadInput` where it cannot be written."""
    rows = 0
    aside = Path(f"{os.fspath(file)}.part")
    try:
        opened = aside.open("w", encoding="ascii", newline="")
    except OSError as error:
        raise BadInput(f"{file}: {error.strerror}; give a file in a folder that is there and may be written to") from error
    try:
        with opened as out:
            table = csv.writer(out, lineterminator="\n")
            table.writerow(COLUMNS)
            for e in estimates:
                rotation = " ".join(f"{v:.9g}" for v in e.rotation.ravel())
                translation = " ".join(f"{v:.9g}" for v in e.translation_mm)
                table.writerow([e.scene, e.image, e.object, f"{e.score:.6g}", rotation, translation, f"{e.seconds:.4f}"])
                rows += 1
    except BaseException:
        aside.unlink()
        raise
    aside.replace(file)
    return rows


def main(words: Sequence[str] | None = None) -> int:
    """`python -m tsumu.bop`."""
    parser = argparse.ArgumentParser(prog="python -m tsumu.bop", description="BOP scene folders in, a BOP result file out.")
    parser.add_argument("scenes", nargs="+", help="scene folders, called by their numbers")
    parser.add_argument("--models", required=True, help="folder with obj_000001.ply …, millimetres")
    parser.add_argument("--objects", nargs="+", type=int, help="numbers of the objects that may be there [default: all]")
    parser.add_argument("--out", required=True, help="the result file")
    parser.add_argument("--weights", help="weights of your own")
    args = parser.parse_args(words)
    try:
        with Bin(models(args.models, args.objects), weights=args.weights) as bin:
            rows = write(args.out, (e for scene in args.scenes for e in solve(scene, bin)))
    except TsumuError as error:
        parser.exit(2 if isinstance(error, BadInput) else 1, f"{parser.prog}: {error}\n")
    print(f"{rows} estimates: {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
