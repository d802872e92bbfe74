#!/usr/bin/env python3
"""The n-th call of the system fails, for all n, on a tiny site: writes, flushes, renames, opens, memory, and kills.

    python3 tools/faults.py PROGRAM OUT [--every K] [--calls fsync,mmap] [--kills N]
    python3 tools/faults.py --table OUT

Every place is tried: those up to the end of recognition in a fresh folder, those after it in a folder whose run was killed there,
where two thirds of the work need not be done again. With --every K each K-th of them.

After each failure: the program ended with status 0, 1 or 2 and a line; every file in its place has the bytes of an undisturbed
run; `verify` and `report` do not take an unfinished run for a whole one; the same command again ends in the same bytes. Needs
strace (Linux), which makes the call fail in the kernel's stead, so that it is the program as it is delivered that is tried.
OUT keeps one line a trial: the sweep goes on from there. Prints a table; exit status 1 if anything was wrong.
"""

import argparse
import collections
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile

RECIPE = """
name = "tiny"
count = [3, 3]
density_per_m2 = 120.0
[site]
kind = "pen"
side_blocks = 2.2
[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"""
CATALOG = '[[block]]\nname = "tetrapod-5t"\nshape = { kind = "tetrapod", size = 2.0 }\n'
SITE = """
name = "Tiny"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5
[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0
[design]
kind = "level"
level_m = 3.4
boundary = [[41248.5, -98761.5], [41251.5, -98761.5], [41251.5, -98758.5], [41248.5, -98758.5]]
"""
FLAGS = ["--plans", "0", "--policy", "random", "--threads", "1", "-q"]

# What fails, and as what: a full disk, a bad disk, too many files, no memory.
CALLS = {
    "write": "ENOSPC", "fsync": "EIO", "renameat": "EIO", "mkdir": "ENOSPC", "openat": "EMFILE", "fchmod": "EPERM",
    "unlinkat": "EIO", "getdents64": "EIO", "flock": "ENOLCK", "mmap": "ENOMEM", "mprotect": "ENOMEM", "read": "EIO",
}
# Thousands of reads are of the same file: these many of them.
MOST = {"read": 100}
# So many places more are tried in a fresh folder than a run that goes on leaves out.
OVERLAP = 4


def bytes_below(folder):
    found = {}
    for here, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(here, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = hashlib.sha256(file.read()).hexdigest()
    found.pop("timing.json", None)
    return found


def call(command, **more):
    ended = subprocess.run(command, capture_output=True, timeout=600, **more)
    return ended.returncode, ended.stderr.decode(errors="replace")


class Sweep:
    def __init__(self, program, work):
        self.program, self.work = os.path.abspath(program), work
        self.site = os.path.join(work, "site")
        os.makedirs(self.site)
        for name, text in [("recipe.toml", RECIPE), ("catalog.toml", CATALOG), ("site.toml", SITE)]:
            with open(os.path.join(self.site, name), "w") as file:
                file.write(text)
        synth = [self.program, "synth", f"{self.site}/recipe.toml", "--catalog", f"{self.site}/catalog.toml", "--seed", "3",
                 "--site-crs", "EPSG:6679", "--site-origin", "41250,-98760,1.5", "--out", self.site, "-q"]
        subprocess.run(synth, check=True)
        self.whole = self.fresh()
        code, said = call(self.run_in(self.whole))
        if code != 0:
            sys.exit(f"the undisturbed run ends with {code}: {said}")
        self.reference = bytes_below(self.whole)
        self.kill_after_recognition()
        self.loader_calls = self.count("mmap", ["-E", "LD_TRACE_LOADED_OBJECTS=1"])

    def fresh(self, begun=False):
        """A folder for a run: none yet, or that of a run killed when its blocks were recognised."""
        folder = os.path.join(tempfile.mkdtemp(dir=self.work), "run")
        if begun:
            shutil.copytree(self.begun, folder)
        return folder

    def kill_after_recognition(self):
        self.begun = self.fresh()
        running = subprocess.Popen(self.run_in(self.begun), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not os.path.exists(f"{self.begun}/.tsumu-resume/recognise"):
            if running.poll() is not None:
                sys.exit("the run ended before it could be killed")
        running.kill()
        running.wait()
        if os.path.exists(f"{self.begun}/manifest.json"):
            sys.exit("the run was whole before it could be killed")

    def run_in(self, folder):
        return [self.program, "run", self.site, "--out", folder, *FLAGS]

    def strace(self, folder, trace, inject, log):
        # With its filter in the kernel strace is quick, and does not kill.
        quick = [] if "signal" in inject else ["--seccomp-bpf"]
        return ["strace", "-f", *quick, "-qq", "-o", log, "-e", f"trace={trace}", "-e", f"inject={trace}:{inject}",
                *self.run_in(folder)]

    def count(self, name, before=(), begun=False):
        """Calls of the thread that makes most of them: strace counts each thread's own."""
        return self.counts([name], before, begun)[name]

    def counts(self, names, before=(), begun=False):
        """The same of several calls, by one run."""
        log = os.path.join(self.work, "count.log")
        subprocess.run(["strace", *before, "-f", "-qq", "-o", log, "-e", f"trace={','.join(names)}",
                        *self.run_in(self.fresh(begun))], check=True, stdout=subprocess.DEVNULL)
        threads = {name: collections.Counter() for name in names}
        with open(log) as file:
            for line in file:
                thread, said = line.split(None, 1)
                name = said.split("(", 1)[0]
                if name in threads:
                    threads[name][thread] += 1
        return {name: max(found.values(), default=0) for name, found in threads.items()}

    def trial(self, name, inject, begun=False):
        folder, log = self.fresh(begun), os.path.join(self.work, "trial.log")
        code, said = call(self.strace(folder, name, inject, log))
        with open(log) as file:
            lines = file.readlines()
        happened = any("INJECTED" in line or "killed by SIGKILL" in line for line in lines)
        # Threads are counted apart: the line itself may be the n-th write of the thread that says it.
        unheard = any(" write(2, " in line and "INJECTED" in line for line in lines)
        # What fails while the system loads the program, or the language's runtime gets ready, ends it before its first line.
        early = "fatal runtime error: initialization" in said or name in ("mmap", "mprotect", "openat", "read") and int(inject.split("when=")[1]) <= self.loader_calls
        faults = self.faults_of(folder, code, said, killed=early or "signal=KILL" in inject, unheard=unheard)
        again, then = call(self.run_in(folder))
        after = bytes_below(folder)
        if again != 0:
            faults.append(f"the same command again ends with {again}: {then.strip()[-200:]}")
        elif after != self.reference:
            odd = [n for n in after.keys() | self.reference.keys() if after.get(n) != self.reference.get(n)]
            faults.append(f"other bytes after going on: {sorted(odd)[:4]}")
        shutil.rmtree(os.path.dirname(folder), ignore_errors=True)
        last = re.sub(r"/[^ ]*/", "", (said.strip().splitlines() or [""])[-1])
        return {"happened": happened, "code": code, "said": last[:160], "faults": faults}

    def faults_of(self, folder, code, said, killed, unheard):
        faults = []
        if not killed:
            if code not in (0, 1, 2):
                faults.append(f"status {code}: {said.strip()[-200:]}")
            elif code != 0 and not unheard and not any(line.startswith("tsumu: ") for line in said.splitlines()):
                faults.append(f"no line of its own: {said.strip()[-200:]}")
        if not os.path.isdir(folder):
            return faults + (["status 0 and no run"] if code == 0 and not killed else [])
        for name, content in bytes_below(folder).items():
            if not name.startswith(".tsumu-") and "/.tsumu-" not in name and self.reference.get(name) != content:
                faults.append(f"{name} is neither whole nor absent")
        whole = os.path.exists(os.path.join(folder, "manifest.json"))
        if not whole:
            if code == 0 and not killed:
                faults.append("status 0 without a manifest")
            for command in (["verify", folder], ["report", folder, "--site", self.site, "--out", f"{folder}.html"]):
                if call([self.program, *command])[0] == 0:
                    faults.append(f"`{command[0]}` takes it for a whole run")
        return faults


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("out", nargs="?")
    parser.add_argument("--table", action="store_true", help="only the table of the trials kept in the file named")
    parser.add_argument("--every", type=int, default=1, help="every K-th place, from a place that differs between the calls")
    parser.add_argument("--calls", default=",".join(CALLS))
    parser.add_argument("--kills", type=int, default=0, help="SIGKILL at so many random calls of the system")
    options = parser.parse_args()
    out = options.program if options.table else options.out
    if not out:
        parser.error("which file keeps the trials?")
    done = {}
    if os.path.exists(out):
        with open(out) as file:
            done = {(t["call"], t["n"], t.get("begun", False)): t for t in map(json.loads, file)}
    if options.table:
        return table(done.values())
    with tempfile.TemporaryDirectory() as work:
        sweep = Sweep(options.program, work)
        plan = []
        names = list(filter(None, options.calls.split(",")))
        whole = sweep.counts(names)
        rest = sweep.counts(names, begun=True)
        for name in names:
            # What a run does first, it does when it goes on, too.
            first_part = min(whole[name], max(0, whole[name] - rest[name]) + OVERLAP)
            for begun, count in ((False, first_part), (True, rest[name])):
                step = max(options.every, -(-count // MOST.get(name, count or 1)))
                first = 1 + len(plan) % step
                plan += [(name, n, begun, f"error={CALLS[name]}:when={n}") for n in range(first, count + 1, step)]
        draw = random.Random(22)
        places = sweep.counts(["openat", "fsync", "write", "madvise"]) if options.kills else {}
        for i in range(options.kills):
            name = draw.choice(sorted(places))
            n = draw.randint(1, max(1, places[name]))
            plan.append((f"kill at {name}", n, False, f"signal=KILL:when={n}"))
        for name, n, begun, inject in plan:
            if (name, n, begun) in done:
                continue
            trial = {"call": name, "n": n, "begun": begun, **sweep.trial(name.removeprefix("kill at "), inject, begun)}
            done[name, n, begun] = trial
            with open(out, "a") as file:
                file.write(json.dumps(trial) + "\n")
            for fault in trial["faults"]:
                print(f"{name} {n}{' of a run that goes on' * begun}: {fault}", flush=True)
    return table(done.values())


def table(trials):
    rows = collections.defaultdict(lambda: collections.Counter())
    for trial in trials:
        row = rows[trial["call"]]
        row["trials"] += 1
        row["happened"] += trial["happened"]
        row["ended well"] += trial["code"] == 0
        row["faults"] += bool(trial["faults"])
    print("| call that fails | trials | failed in the kernel | run ended well all the same | wrong |\n|---|---|---|---|---|")
    for name, row in rows.items():
        print(f"| `{name}` | {row['trials']} | {row['happened']} | {row['ended well']} | {row['faults']} |")
    wrong = sum(row["faults"] for row in rows.values())
    print(f"{sum(row['trials'] for row in rows.values())} trials, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
