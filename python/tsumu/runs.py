"""Run folders: made, opened, verified, compared, scored."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _tsumu
from .errors import BadInput
from .planning import Plan
from .progress import Progress, asked
from .recognition import Recognition
from .site import Site, text_of


class Run:
    """A run folder with what it holds."""

    def __init__(self, folder: Path, site: Site, recognition: Recognition, plan: Plan | None) -> None:
        #: Where its files lie.
        self.folder = folder
        #: Its site, with the seed and the settings the run was made with.
        self.site = site
        #: Its blocks, as its files have them: corrected by hand perhaps.
        self.recognition = recognition
        #: Its plan; None where there is none.
        self.plan = plan

    @classmethod
    def open(
        cls,
        folder: str | os.PathLike[str],
        site: str | os.PathLike[str] | None = None,
        *,
        progress: Progress | bool | None = None,
    ) -> Run:
        """Opens a run folder, or the run of a site folder. `site`: its site folder, where the run does not lie in it.

        Raises `BadInput` for a folder that holds no whole run.
        """
        with asked(progress, None) as how:
            inner, found, planned = _tsumu.open_run(os.fspath(folder), text_of(site), how)
        opened = Site(inner)
        place = Path(folder)
        place = place / "run" if (place / "site.toml").is_file() else place
        return cls(place, opened, Recognition(found, opened), None if planned is None else Plan(planned, opened))

    @property
    def manifest(self) -> dict[str, Any]:
        """Versions, seed, settings, hash of every input and output; empty for a folder that was put together by hand."""
        file = self.folder / "manifest.json"
        found: dict[str, Any] = json.loads(file.read_text("utf-8")) if file.is_file() else {}
        return found

    def write_report(self, file: str | os.PathLike[str]) -> None:
        """Writes its page, one HTML file."""
        with asked(None, None) as how:
            _tsumu.present(self.site._inner, os.fspath(self.folder), os.fspath(file), None, how)

    def export(self, folder: str | os.PathLike[str]) -> None:
        """Writes the exports for GIS, CAD, BIM and viewers."""
        with asked(None, None) as how:
            _tsumu.present(self.site._inner, os.fspath(self.folder), None, os.fspath(folder), how)

    def verify(self) -> list[str]:
        """Files, inputs included, that are not as they were, each as a line; empty: all are."""
        return _tsumu.verify(os.fspath(self.folder), text_of(self.site.folder))

    def __repr__(self) -> str:
        return f"Run({str(self.folder)!r}, {self.recognition!r}, {self.plan!r})"


def run(
    site: Site | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    weights: str | os.PathLike[str] | None = None,
    placement_weights: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
) -> Run:
    """Everything for a site in one call, as `tsumu run`: blocks, plan where there is a design, report, exports.

    `out`: the run folder; None: `run` in the site folder. An interrupted run goes on from its last finished part.
    """
    if not isinstance(site, Site):
        site = Site.load(site, threads=threads)
    if out is None and site.folder is None:
        raise BadInput("out: name a folder; this site has none of its own")
    place = Path(out) if out is not None else Path(str(site.folder)) / "run"
    with asked(progress, threads) as how:
        _tsumu.run(site._inner, os.fspath(place), text_of(weights), text_of(placement_weights), how)
    return Run.open(place, site.folder)


@dataclass(frozen=True)
class Comparison:
    """What happened between surveys."""

    #: The figures, as `summary.json` has them.
    summary: dict[str, Any]
    #: For each two epochs that follow each other the blocks' rows, keys as in changes.csv: class, shift_m (east, north, up),
    #: distance_m, turn_deg, level_m, significance, confidence …
    steps: list[list[dict[str, Any]]]

    @property
    def changes(self) -> list[dict[str, Any]]:
        """The rows of the last step."""
        return self.steps[-1]

    def to_pandas(self) -> Any:
        """The rows of the last step as a DataFrame. Needs pandas."""
        from .frames import needed

        return needed("pandas").DataFrame(self.changes)


def compare(
    epochs: Sequence[str | os.PathLike[str]],
    *,
    plan: str | os.PathLike[str] | None = None,
    fixed: bool = False,
    stable: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
) -> Comparison:
    """What happened to every block between surveys, as `tsumu compare`.

    `epochs`: run or site folders in order of time; a site without a run is recognised first. `plan`: a run whose plan was built
    since; give one later epoch. `fixed`: no registration. `stable`: a GeoJSON of ground that does not move. `out`: a folder for
    everything the command leaves.
    """
    if isinstance(epochs, (str, os.PathLike)):
        raise BadInput("epochs: is one path; give a list, the earliest first")
    paths = [os.fspath(epoch) for epoch in epochs]
    with asked(progress, threads) as how:
        found = json.loads(_tsumu.compare(paths, text_of(plan), fixed, text_of(stable), text_of(out), how))
    return Comparison(found["summary"], found["steps"])


def evaluate(
    truth: str | os.PathLike[str],
    result: Recognition | Run | str | os.PathLike[str],
    *,
    catalog: str | os.PathLike[str] | None = None,
    occlusion_limit: float = 0.8,
) -> dict[str, Any]:
    """Scores a result against a truth, as `tsumu evaluate`: the figures of metrics.json, absent ones as None.

    `truth`: a folder with truth.csv (and a labelled cloud), or with one folder a scene. `result`: a recognition, a run, or a folder
    with blocks.csv. True blocks at or above `occlusion_limit` count neither way.
    """
    with tempfile.TemporaryDirectory() as work, asked(None, None) as how:
        if isinstance(result, Recognition):
            result.save(Path(work) / "run")
            result = Path(work) / "run"
        elif isinstance(result, Run):
            result = result.folder
        told = _tsumu.evaluate(os.fspath(truth), os.fspath(result), text_of(catalog), float(occlusion_limit), how)
    scores: dict[str, Any] = json.loads(told)
    return scores
