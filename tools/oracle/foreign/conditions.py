"""The condition table: each row differs from the plain pile in one thing that real surveys differ in."""

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Condition:
    """How one pile is made, scanned and handed over. Lengths in metres unless named otherwise."""

    name: str
    shape: str = "tetrapod"
    count: int = 30
    side_blocks: float = 4.0
    bed: str = "none"  # none (a smooth floor nobody sees), level, slope, slope-toe
    bed_hidden: bool = False  # the bed is there, its points are not handed over
    sand_blocks: float = 0.0  # how far sand stands above the bed
    sand_wedge: bool = False
    structure: str = ""  # wall, deck
    stones: int = 0
    stone_blocks: float = 0.5
    rows_joint: float = 0.0  # blocks placed in rows with this joint, not dropped
    broken_share: float = 0.0
    sensor: str = "uav"
    tell_sensor: bool = True  # whether the recogniser is told where a scanner stood
    density: float = 600.0
    noise: float = 0.01
    drift: float = 0.0
    smooth: float = 0.0
    uneven: float = 1.0
    holes: int = 0
    crop: float = 1.0
    duplicates: float = 0.0
    cell: float = 0.0
    rule: str = ""
    unit_per_m: float = 1.0
    catalogue_scale: float = 1.0
    catalogue_shape: str = ""  # another type than is there
    catalogue_mirrored: bool = False
    catalogue_legs: float = 1.0  # width of the legs in the catalogue's mesh
    nothing: str = ""  # scenes without a block: terrain, trees, rocks, stairs, water
    group: str = "pile"
    expect: dict = field(default_factory=lambda: {"precision": 0.97, "recall": 0.90})


NONE_STATED = {"stated_at_half": 0}
AT_MOST_ONE = {"stated": 1}


def rows():
    """All rows of the table, by name."""
    base = Condition("no-ground", expect={"precision": 0.98, "recall": 0.97})
    out = [base]

    def row(name, group, expect=None, **changed):
        out.append(replace(base, name=name, group=group, expect=expect or {"precision": 0.97, "recall": 0.90}, **changed))

    strict = {"precision": 0.98, "recall": 0.97}
    for shape in ("dolos", "cube", "hook"):
        row(f"no-ground-{shape}", "pile", strict, shape=shape)
    for shape in ("tetrapod", "dolos", "cube", "hook"):
        row(f"ground-{shape}", "pile", shape=shape, bed="level", count=24, side_blocks=4.5)
    row("few", "pile", count=3, bed="level", side_blocks=4.0)
    row("slope", "bed", bed="slope", count=24, side_blocks=4.5)
    row("slope-bed-hidden", "bed", bed="slope", bed_hidden=True, count=24, side_blocks=4.5)
    row("slope-toe", "bed", bed="slope-toe", count=24, side_blocks=4.5)
    row("sand", "bed", bed="level", sand_blocks=0.4, count=24, side_blocks=4.5)
    row("sand-wedge", "bed", bed="slope-toe", sand_blocks=0.4, sand_wedge=True, count=24, side_blocks=4.5)
    row("crown-wall", "bed", bed="level", structure="wall", count=24, side_blocks=4.5)
    row("deck", "bed", bed="level", structure="deck", count=24, side_blocks=4.5)
    row("stones", "bed", bed="level", stones=40, count=20, side_blocks=5.0)
    row("rubble-few-blocks", "bed", bed="level", stones=70, stone_blocks=0.7, count=3, side_blocks=5.0)
    row("bed-cropped-deep", "bed", count=60, side_blocks=4.0, crop=0.7)

    for cm in (10, 15, 20, 25):
        for rule in ("mean", "highest"):
            row(f"grid-{cm}-{rule}", "grid", cell=cm / 100, rule=rule, sensor="nadir", density=2000, bed="level", count=24, side_blocks=4.5)
    row("nadir", "sensor", sensor="nadir")
    row("terrestrial", "sensor", sensor="terrestrial", bed="level", count=24)
    row("terrestrial-not-told", "sensor", sensor="terrestrial", tell_sensor=False, bed="level", count=24)
    row("crest-not-told", "sensor", sensor="crest", tell_sensor=False, bed="level", count=24)
    row("boat", "sensor", sensor="boat", bed="slope", count=24, side_blocks=4.5)
    row("boat-not-told", "sensor", sensor="boat", tell_sensor=False, bed="slope", count=24, side_blocks=4.5)
    for density in (30, 100, 3000, 15000):
        row(f"density-{density}", "density", density=density, count=30 if density < 10000 else 12, side_blocks=4.0 if density < 10000 else 3.0)
    row("density-uneven", "density", density=2000, uneven=10.0)
    row("holes", "density", holes=14)
    row("crop", "density", crop=0.75)
    row("duplicates", "density", duplicates=0.5)
    for cm in (3, 5, 8):
        row(f"noise-{cm}", "noise", noise=cm / 100)
    row("smooth-5", "noise", smooth=0.05, bed="level", count=24)
    row("smooth-10", "noise", smooth=0.10, bed="level", count=24)
    row("drift-3", "noise", drift=0.03)
    for cm in (3, 6):
        row(f"rows-{cm}", "placed", shape="cube", rows_joint=cm / 100, count=36)
    row("broken", "placed", broken_share=0.25, count=24, bed="level")

    row("unit-mm", "wrong", AT_MOST_ONE, unit_per_m=1000.0)
    row("unit-ft", "wrong", NONE_STATED, unit_per_m=1 / 0.3048)
    for name, scale in (("minus-5", 0.95), ("plus-5", 1.05), ("minus-30", 0.7)):
        row(f"size-{name}", "wrong", NONE_STATED, catalogue_scale=scale)
    row("size-plus-5-hook", "wrong", NONE_STATED, shape="hook", catalogue_scale=1.05)
    row("size-plus-2", "wrong", {"warned": True}, catalogue_scale=1.02)
    row("mirrored", "wrong", NONE_STATED, shape="hook", catalogue_mirrored=True)
    row("other-type", "wrong", NONE_STATED, shape="dolos", catalogue_shape="tetrapod")
    row("other-type-cube", "wrong", NONE_STATED, shape="tetrapod", catalogue_shape="cube")
    row("legs-blunter", "wrong", catalogue_legs=1.03)

    for nothing in ("terrain", "trees", "rocks", "stairs", "water"):
        row(f"nothing-{nothing}", "nothing", AT_MOST_ONE, nothing=nothing, side_blocks=7.0)
    row("nothing-rocks-cube", "nothing", AT_MOST_ONE, nothing="rocks", shape="cube", side_blocks=7.0)
    row("nothing-stairs-cube", "nothing", AT_MOST_ONE, nothing="stairs", shape="cube", side_blocks=7.0)
    return {c.name: c for c in out}


def of_shapes(shapes):
    """The rows with other blocks in them: each row whose shape may be any, once a shape, named ROW@SHAPE."""
    out = {}
    for c in rows().values():
        any_shape = not (c.rows_joint or c.broken_share or c.catalogue_shape or c.catalogue_mirrored or c.catalogue_legs != 1.0)
        for shape in shapes if any_shape else ():
            if c.name == "no-ground" or c.shape == "tetrapod":
                name = f"{c.name}@{shape}"
                out[name] = replace(c, name=name, shape=shape)
    return out
