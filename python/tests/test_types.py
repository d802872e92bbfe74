"""The package's types hold: its own files under mypy --strict, and the stubs name what the module has."""

from __future__ import annotations

import ast
import inspect
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tsumu
from tsumu import _tsumu


def test_types_are_strict(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    # Given a path in site-packages, mypy takes all that lies there for ours and finds the standard library shadowed.
    package = shutil.copytree(Path(tsumu.__file__).parent, tmp_path / "tsumu", ignore=shutil.ignore_patterns("*.so", "*.pyd"))
    words = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", str(package)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_the_stubs_name_what_the_module_has() -> None:
    text = Path(tsumu.__file__).with_name("_tsumu.pyi").read_text("utf-8")
    stubs = {node.name: node for node in ast.parse(text).body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    public = {name for name in dir(_tsumu) if not name.startswith("_")}
    assert {name for name in stubs if not name.startswith("_")} == public
    for name in public:
        found, stub = getattr(_tsumu, name), stubs[name]
        if isinstance(stub, ast.FunctionDef):
            assert [a.arg for a in stub.args.args] == list(inspect.signature(found).parameters), name
            continue
        members = {m.name for m in stub.body if isinstance(m, ast.FunctionDef)}
        members |= {m.target.id for m in stub.body if isinstance(m, ast.AnnAssign) and isinstance(m.target, ast.Name)}
        assert members == {m for m in dir(found) if not m.startswith("_")}, name


def test_everything_public_is_described() -> None:
    for name in tsumu.__all__:
        found = getattr(tsumu, name)
        if inspect.isclass(found) or inspect.isfunction(found):
            assert found.__doc__, name
