#!/usr/bin/env python3
"""Writes the list of everything in the program (CycloneDX 1.6, JSON) from Cargo.lock and the packages' own statements.

    python3 tools/sbom.py > tsumu.cdx.json

Needs Python and cargo, no network once the packages are there. Holds no time and no path: the same Cargo.lock and
commit give the same bytes. Listed is what a build for the host links or runs; tools of the tests are left out.
"""

import json
import re
import subprocess
import sys
import tomllib
import uuid
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


metadata = json.loads(run("cargo", "metadata", "--format-version", "1", "--locked"))
lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
checksum = {(p["name"], p["version"]): p["checksum"] for p in lock["package"] if "checksum" in p}
packages = {(p["name"], p["version"]): p for p in metadata["packages"]}

# `cargo tree` knows which optional parts are really built; `cargo metadata` lists all that might be.
uses = {}
above = []
for line in run("cargo", "tree", "--locked", "-p", "tsumu-cli", "-e", "normal,build", "--prefix", "depth").splitlines():
    depth, name, version = re.match(r"(\d+)(\S+) v(\S+)", line).groups()
    node = (name, version)
    uses.setdefault(node, set())
    above = above[: int(depth)]
    if above:
        uses[above[-1]].add(node)
    above.append(node)
program = next(iter(uses))


def reference(node):
    return "pkg:cargo/{}@{}".format(*node)


def component(node):
    package = packages[node]
    entry = {
        "type": "application" if node == program else "library",
        "bom-ref": reference(node),
        "name": package["name"],
        "version": package["version"],
        "purl": reference(node),
    }
    if package["description"]:
        entry["description"] = " ".join(package["description"].split())
    if package["license"]:
        entry["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
    if digest := checksum.get(node):
        entry["hashes"] = [{"alg": "SHA-256", "content": digest}]
    if package["repository"]:
        entry["externalReferences"] = [{"type": "vcs", "url": package["repository"]}]
    return entry


others = sorted(set(uses) - {program})
bom = {
    "bomFormat": "CycloneDX",
    "specVersion": "1.6",
    "version": 1,
    "metadata": {"component": component(program)},
    "components": [component(n) for n in others],
    "dependencies": [
        {"ref": reference(n), "dependsOn": sorted(map(reference, uses[n]))} for n in [program, *others]
    ],
}
bom["serialNumber"] = "urn:uuid:" + str(uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(bom, sort_keys=True)))
json.dump(bom, sys.stdout, indent=1, ensure_ascii=False)
print()
print(f"{len(others)} components", file=sys.stderr)
