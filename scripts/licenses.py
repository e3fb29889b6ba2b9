"""Licenses of what the zips bring, against those that the manifest names."""

import json
import re
import zipfile

PROJECT = "GPL-3.0-or-later"
_BUILDING = {"unicode-ident"}  # what a wheel was built with, and does not hold
_COVERED = {  # licenses by the one that the manifest names for it
    "OSI Approved :: BSD License": "BSD-3-Clause",
    "BSD-3-Clause-Attribution": "BSD-3-Clause",
    "GPL-3.0-with-GCC-exception": "GPL-3.0-or-later",
    "Apache-2.0 WITH LLVM-exception": "Apache-2.0",
}


def of_wheel(path):
    """Licenses of a wheel, and of all that it brings.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    list of set of str
        For each part the licenses, any of which may be chosen, as a manifest names them. Empty where the wheel has no
        text of a license.
    """
    with zipfile.ZipFile(path) as wheel:
        names = wheel.namelist()
        texts = [wheel.read(name).decode() for name in names if re.search(r"\.dist-info/(.*/)?LICENSE(\.txt)?$", name)]
        boms = [json.loads(wheel.read(name)) for name in names if name.endswith(".cyclonedx.json")]
        (about,) = [wheel.read(name).decode() for name in names if name.endswith(".dist-info/METADATA")]
    if not texts:
        return []
    found = re.findall(r"^(?:License-Expression: |Classifier: License :: )(.+?)\s*$", about, re.MULTILINE)
    found += [name for text in texts for name in re.findall(r"^License: *(.+?)\s*$", text, re.MULTILINE)]
    parts = [part for bom in boms for part in bom["components"] if part["name"] not in _BUILDING]
    found += [license["expression"] for part in parts for license in part["licenses"]]
    return [{f"SPDX:{_COVERED.get(name, name)}" for name in expression.split(" OR ")} for expression in found]


def unnamed(path, named):
    """What a wheel brings under licenses none of which is among the named ones, in words; [] if all is well."""
    found = of_wheel(path)
    if not found:
        return [f"{path.name} holds no text or no name of a license"]
    missing = sorted({" or ".join(sorted(choices)) for choices in found if not choices & set(named)})
    return [f"{path.name} brings what is under {words}, which the manifest does not name" for words in missing]
