#!/usr/bin/env python3
"""Opens `project.qgz` of a run's exports in a real QGIS without a screen and draws it.

    apt-get install python3-qgis qgis-providers
    QT_QPA_PLATFORM=offscreen python3 tools/check_qgis.py run/exports picture.png

Every layer must be valid, have the project's coordinate system and a style of its own; the GeoPackage's layer `blocks`,
opened alone, must take its style from `layer_styles`. Exit 1 when one does not.
"""

import sys
from pathlib import Path

from qgis.core import QgsApplication, QgsMapRendererParallelJob, QgsMapSettings, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor

folder, picture = Path(sys.argv[1]), sys.argv[2]
application = QgsApplication([], False)
application.initQgis()
failed = 0


def check(what, ok, detail=""):
    global failed
    print("ok    " if ok else "FAILED", what, detail)
    failed += not ok


project = QgsProject.instance()
check("the project opens", project.read(str(folder / "project.qgz")), project.error())
check("coordinate system", project.crs().isValid(), project.crs().authid())
layers = list(project.mapLayers().values())
for layer in layers:
    check(layer.name(), layer.isValid() and layer.crs() == project.crs(), layer.crs().authid())
blocks = project.mapLayer("tsumu_layer_blocks")
check("blocks by confidence", blocks.renderer().type() == "graduatedSymbol", blocks.renderer().type())
check("placing order as label", project.mapLayer("tsumu_layer_placements").labelsEnabled())
alone = QgsVectorLayer(str(folder / "project.gpkg") + "|layername=blocks", "blocks", "ogr")
alone.loadDefaultStyle()
check("the GeoPackage alone is styled", alone.renderer().type() == "graduatedSymbol", alone.renderer().type())

settings = QgsMapSettings()
shown = [l for l in project.layerTreeRoot().layerOrder() if project.layerTreeRoot().findLayer(l.id()).isVisible()]
settings.setLayers(shown)
settings.setDestinationCrs(project.crs())
settings.setBackgroundColor(QColor("white"))
settings.setOutputSize(QSize(1400, 900))
extent = blocks.extent()
extent.combineExtentWith(project.mapLayer("tsumu_layer_placements").extent())
extent.scale(1.15)
settings.setExtent(extent)
job = QgsMapRendererParallelJob(settings)
job.start()
job.waitForFinished()
check("it draws", job.renderedImage().save(picture) and not job.errors(), picture)
application.exitQgis()
sys.exit(1 if failed else 0)
