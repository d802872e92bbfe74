#!/usr/bin/env python3
"""Adds the block of every point to a LAS or LAZ file: `laspy_blocks.py survey.laz labelled.laz --height 2.0`.

Needs laspy with lazrs (pip install "laspy[lazrs]"). Everything the file holds stays; two dimensions are added.
"""

from __future__ import annotations

import argparse

import laspy

import tsumu


def add_blocks(cloud: laspy.LasData, catalog: tsumu.Catalog) -> tsumu.Recognition:
    """Adds `block` (uint32, 0 = none) and `block_confidence` (float32) to a cloud in memory."""
    found = tsumu.recognise(cloud, catalog, lines=cloud.point_source_id)
    for name, values in (("block", found.labels), ("block_confidence", found.label_confidence)):
        cloud.add_extra_dim(laspy.ExtraBytesParams(name, values.dtype))
        cloud[name] = values
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("survey")
    parser.add_argument("out")
    parser.add_argument("--height", type=float, required=True, help="height of the tetrapods, metres")
    args = parser.parse_args()
    survey = laspy.read(args.survey)
    print(add_blocks(survey, tsumu.Catalog.tetrapod(args.height)))
    survey.write(args.out)
