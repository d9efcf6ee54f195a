#!/usr/bin/env bash
# Packs the Blender add-on as Blender's preferences install it.
# Usage: apps/blender/package.sh [OUT.zip]      default: polestar_blender.zip here
set -euo pipefail
folder=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
exec python3 - "$folder" "${1:-polestar_blender.zip}" <<'PYTHON'
import pathlib
import sys
import zipfile

folder, out = pathlib.Path(sys.argv[1]), sys.argv[2]
with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
    for file in sorted((folder / "polestar_blender").glob("*.py")):
        archive.write(file, file.relative_to(folder))
print("wrote", out)
PYTHON
