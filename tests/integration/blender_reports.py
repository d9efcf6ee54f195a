"""Tries the add-on's import operator and writes what it reports.

    blender -b --factory-startup --python-exit-code 3 --python blender_reports.py -- JOB.json

JOB.json holds `addon` (the packed add-on), `imports` (arguments of the operator, one object an import) and `out`, a
file for a list of texts: what the operator reported as an error, empty where it imported. Exits with 3 when a failed
import left something behind.
"""

import json
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from blender_addon import install  # noqa: E402


def contents():
    return [len(kind) for kind in (bpy.data.objects, bpy.data.volumes, bpy.data.materials, bpy.data.node_groups)]


def report(arguments):
    before = contents()
    try:
        bpy.ops.import_scene.polestar(**arguments)
    except RuntimeError as error:
        if contents() != before:
            raise AssertionError("a failed import left something behind") from error
        return str(error)
    return ""


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    install(job["addon"])
    with open(job["out"], "w") as file:
        json.dump([report(arguments) for arguments in job["imports"]], file)


main()
