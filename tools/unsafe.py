#!/usr/bin/env python3
"""Unsafe code in what the program is built of: one row a crate that has any, most first.

    python3 tools/unsafe.py > docs/bench/unsafe.md

Counts blocks, functions, impls and traits marked `unsafe` in the sources of every crate that `tsumu` is linked with, without
their tests, benches and examples; comments and strings are not counted. What a crate forbids itself is told. Our own crates
forbid it (`unsafe_code = "forbid"` in Cargo.toml), which the compiler holds.
"""

import json
import os
import re
import subprocess
import sys

MARK = re.compile(r"\bunsafe\s+(?:extern\s+\"[^\"]*\"\s+)?(?:fn|impl|trait|extern)\b|\bunsafe\s*\{")
FORBIDS = re.compile(r"#!\[forbid\([^)]*\bunsafe_code\b")
NOISE = re.compile(r"//[^\n]*|/\*.*?\*/|r#\".*?\"#|\"(?:\\.|[^\"\\])*\"", re.S)


def linked(target):
    """Packages that are in the program, by cargo's own tree."""
    tree = subprocess.run(
        ["cargo", "tree", "-p", "tsumu-cli", "--edges", "normal", "--target", target, "--prefix", "none", "--format", "{p}"],
        check=True, capture_output=True, text=True).stdout
    return {tuple(line.split()[:2]) for line in tree.splitlines() if line.strip()}


def main():
    meta = json.loads(subprocess.run(["cargo", "metadata", "--format-version", "1", "--locked"], check=True,
                                     capture_output=True, text=True).stdout)
    own = set(meta["workspace_members"])
    wanted = linked("x86_64-unknown-linux-gnu")
    rows, without, forbid = [], 0, 0
    for package in meta["packages"]:
        if package["id"] in own or (package["name"], "v" + package["version"]) not in wanted:
            continue
        root = os.path.dirname(package["manifest_path"])
        count, forbids = 0, False
        for here, folders, names in os.walk(root):
            folders[:] = [f for f in folders if f not in ("tests", "benches", "examples", "fuzz", "target")]
            for name in names:
                if name.endswith(".rs") and name != "build.rs":
                    with open(os.path.join(here, name), encoding="utf-8", errors="replace") as file:
                        text = file.read()
                    forbids |= name == "lib.rs" and bool(FORBIDS.search(text))
                    count += len(MARK.findall(NOISE.sub("", text)))
        if count and not forbids:
            rows.append((count, package["name"], package["version"], (package["description"] or "").split("\n")[0][:70]))
        else:
            without += 1
            forbid += forbids
    rows.sort(key=lambda row: (-row[0], row[1]))
    print("# Unsafe code of others in the program\n")
    print(f"`python3 tools/unsafe.py`, x86-64 Linux: {len(rows) + without} crates of others are linked, {without} of them without `unsafe` "
          f"({forbid} forbid it), {len(rows)} with. Our own crates forbid it; the compiler holds that.\n")
    print("| crate | version | places marked `unsafe` | what it is |\n|---|---|---|---|")
    for count, name, version, words in rows:
        print(f"| {name} | {version} | {count} | {words.replace('|', '/')} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
