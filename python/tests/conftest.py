"""The sample site, recognised once for all tests."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

import tsumu

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "examples" / "breakwater"


@pytest.fixture(scope="session")
def site() -> tsumu.Site:
    return tsumu.Site.load(SAMPLE)


@pytest.fixture(scope="session")
def found(site: tsumu.Site) -> tsumu.Recognition:
    return site.recognise()


@pytest.fixture(scope="session")
def found_as_array() -> tsumu.Recognition:
    """The sample under the seed of a cloud without site.toml, which says `seed = 1`."""
    return tsumu.Site.load(SAMPLE, seed=0).recognise()


@pytest.fixture(scope="session")
def program() -> str:
    """The program `tsumu` of the same build: TSUMU_PROGRAM, or what lies in PATH."""
    path = os.environ.get("TSUMU_PROGRAM") or shutil.which("tsumu")
    if not path:
        pytest.skip("the program tsumu is not here: set TSUMU_PROGRAM")
    return path


@pytest.fixture(scope="session")
def command_run(program: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sample as `tsumu run` leaves it."""
    out = tmp_path_factory.mktemp("command") / "run"
    subprocess.run([program, "run", str(SAMPLE), "--out", str(out), "--plans", "1", "--quiet"], check=True)
    return out


#: A bin without much in it, so that it is made and seen in a second or two. Its floor and walls are not measured, and tops of a
#: few cubes are flat enough to be taken for a floor; BIN_SETTINGS says so.
BIN_RECIPE = """
name = "few cubes"
count = [6, 6]
density_per_m2 = 250000
[site]
kind = "pen"
side_blocks = 3.5
[bed]
stone_blocks = 0.0
measured = false
[sensor]
kind = "depth-camera"
height_m = 0.8
noise_at_1m_sd_m = 0.0004
[[catalog.block]]
name = "cube"
shape = { kind = "cube", size = 0.08 }
density_kg_m3 = 2700.0
"""
BIN_SETTINGS = {"background": {"bin": False}}


@pytest.fixture(scope="session")
def bin_look(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[tsumu.Bin, tsumu.BinLook, tsumu.SyntheticScene]]:
    """A bin, what it sees in one synthetic cloud, and the cloud with its truth."""
    recipe = tmp_path_factory.mktemp("bin") / "recipe.toml"
    recipe.write_text(BIN_RECIPE)
    scene = tsumu.synth(recipe, seed=3)
    with tsumu.Bin(scene.catalog, settings=BIN_SETTINGS) as bin:
        yield bin, bin.look(scene.points, sensor_positions=scene.sensor_positions), scene
