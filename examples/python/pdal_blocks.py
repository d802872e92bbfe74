"""A function for PDAL's `filters.python`: adds the block of every point (pdal_blocks.json is the pipeline).

    pdal pipeline examples/python/pdal_blocks.json

PDAL comes with conda (`conda install -c conda-forge pdal python-pdal`); the wheel `tsumu` is installed beside it.
"""

import tsumu

CATALOG = tsumu.Catalog.tetrapod(2.0, name="tetrapod-5t")


def add_blocks(ins, outs):
    """`ins`: dimensions by name. Adds `BlockId` (0 = none) and `BlockConfidence`."""
    return tsumu.pdal_filter(ins, outs, CATALOG, lines=ins.get("PointSourceId"))
