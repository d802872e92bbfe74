"""What Python gives is what the command gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import tsumu

TABLES = ("recognise/blocks.csv", "recognise/covariance.csv", "recognise/not_judged.csv", "recognise/not_judged_points.csv",
          "recognise/summary.json")  # fmt: skip


def same(a: Path, b: Path, names: tuple[str, ...]) -> None:
    for name in names:
        assert (a / name).read_bytes() == (b / name).read_bytes(), name


def test_a_site_folder_gives_the_bytes_of_the_command(found: tsumu.Recognition, command_run: Path, tmp_path: Path) -> None:
    found.save(tmp_path / "run")
    same(tmp_path / "run", command_run, (*TABLES, "recognise/cloud.laz", "segment/cloud.laz"))


def test_an_array_gives_the_bytes_of_the_command(site: tsumu.Site, command_run: Path, tmp_path: Path) -> None:
    laspy = __import__("laspy")
    cloud = laspy.read(Path(str(site.folder)) / "survey.laz")
    # An array knows no site.toml, whose seed is 1.
    found = tsumu.recognise(cloud, site.catalog, lines=cloud.point_source_id, crs=site.crs, seed=1)
    found.save(tmp_path / "run")
    same(tmp_path / "run", command_run, TABLES)


def test_a_whole_run_gives_the_bytes_of_the_command(command_run: Path, tmp_path: Path) -> None:
    site = tsumu.Site.load(command_run_site(), settings={"plan": {"uncertainty": {"seeds": 1}}})
    run = tsumu.run(site, tmp_path / "run")
    same(run.folder, command_run, (*TABLES, "plan/placements.csv", "plan/summary.json", "config.toml"))
    assert run.plan is not None and run.verify() == []
    assert run.manifest["outputs"].keys() == tsumu.Run.open(command_run, site.folder).manifest["outputs"].keys()


def command_run_site() -> Path:
    from conftest import SAMPLE

    return SAMPLE


def test_one_thread_and_many_give_the_same(site: tsumu.Site, found: tsumu.Recognition) -> None:
    one = site.recognise(threads=1)
    assert np.array_equal(one.labels, found.labels)
    assert np.array_equal(one.poses, found.poses)
    assert np.array_equal(one.covariances, found.covariances)
