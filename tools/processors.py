#!/usr/bin/env python3
"""The same bytes on a processor of another class: a tiny site run here and under an emulator without AVX-512.

    python3 tools/processors.py PROGRAM

Needs qemu-x86_64 (qemu-user 7.2 or later: AVX2 and FMA, no AVX-512) and a processor with AVX-512; without either there is nothing to
compare, status 3. Every file of the two runs must be equal but `timing.json` and the name of the processor's class, which
stands in the manifest. Status 1: another file differs.
"""

import os
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from faults import CATALOG, RECIPE, SITE, bytes_below  # noqa: E402

FLAGS = ["--plans", "1", "--policy", "random", "-q"]
# The class of the processor is said there.
NAMES_THE_CLASS = {"manifest.json"}


def main():
    program = os.path.abspath(sys.argv[1])
    emulator = shutil.which("qemu-x86_64")
    with open("/proc/cpuinfo") as file:
        wide = "avx512f" in file.read()
    if not emulator or not wide:
        print("no qemu-x86_64 here" if not emulator else "this processor has no AVX-512")
        return 3
    with tempfile.TemporaryDirectory() as work:
        site = os.path.join(work, "site")
        os.makedirs(site)
        for name, text in [("recipe.toml", RECIPE), ("catalog.toml", CATALOG), ("site.toml", SITE)]:
            with open(os.path.join(site, name), "w") as file:
                file.write(text)
        synth = [program, "synth", f"{site}/recipe.toml", "--catalog", f"{site}/catalog.toml", "--seed", "3",
                 "--site-crs", "EPSG:6679", "--site-origin", "41250,-98760,1.5", "--out", site, "-q"]
        subprocess.run(synth, check=True)
        found = {}
        for name, before in [("here", []), ("emulated", [emulator, "-cpu", "max"])]:
            out = os.path.join(work, name)
            subprocess.run([*before, program, "run", site, "--out", out, *FLAGS], check=True)
            found[name] = bytes_below(out)
    here, emulated = found["here"], found["emulated"]
    odd = sorted(n for n in here.keys() | emulated.keys() if here.get(n) != emulated.get(n))
    wrong = [name for name in odd if name not in NAMES_THE_CLASS]
    print(f"{len(here)} files, {len(odd)} differ: {', '.join(odd) or 'none'}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
