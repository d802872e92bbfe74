#!/usr/bin/env python3
"""Packs the wheel `tsumu` around a module that is built already: `pack_wheel.py lib_tsumu.so OUT [--dist]`.

`maturin build` would compile the heavy crates once more, with other features than the workspace; its metadata and its file names
are taken, its compilation is not. Needs maturin and wheel (python/requirements-test.txt). Wheels to publish come from
`maturin build --profile dist` itself (docs/release.md); the limit of size counts for a module of that profile (`--dist` ends with
an error where it is passed), a wheel of profile release is larger and is only told so.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

#: The whole wheel of profile dist (thin LTO, one codegen unit, stripped), weights included, stays below this.
MOST_BYTES = 15 * 1024 * 1024


def main(module: Path, out: Path, dist: bool) -> Path:
    """The wheel's place. `dist`: the module is of profile dist, which the limit counts for."""
    package = Path(__file__).resolve().parents[1] / "python"
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        metadata = ["pep517", "write-dist-info", "--metadata-directory", folder, "--interpreter", sys.executable]
        subprocess.run([sys.executable, "-m", "maturin", *metadata], cwd=package, check=True, stdout=subprocess.DEVNULL)
        skip = shutil.ignore_patterns("__pycache__", "_tsumu.*.so", "*.pyd")
        shutil.copytree(package / "tsumu", work / "tsumu", ignore=skip)
        name = "_tsumu.pyd" if module.suffix == ".dll" else "_tsumu.abi3.so"
        shutil.copy(module, work / "tsumu" / name)
        if shutil.which("strip") and module.suffix == ".so":
            subprocess.run(["strip", str(work / "tsumu" / name)], check=True)
        subprocess.run([sys.executable, "-m", "wheel", "pack", folder, "--dest-dir", str(out)], check=True)
    wheel = max(out.glob("tsumu-*.whl"), key=lambda p: p.stat().st_mtime)
    if wheel.stat().st_size > MOST_BYTES:
        said = f"{wheel}: {wheel.stat().st_size} bytes are more than {MOST_BYTES}"
        if dist:
            sys.exit(said)
        print(f"{said}, which counts for a module of profile dist; give --dist with one", file=sys.stderr)
    print(f"{wheel} ({wheel.stat().st_size / 1e6:.1f} MB)")
    return wheel


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--dist"]
    if len(words) != 2:
        sys.exit(__doc__)
    main(Path(words[0]), Path(words[1]), "--dist" in sys.argv)
