"""What the README and the manual tell to type: commands, calls and code, with what no test runs, and why."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
_FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"(?<=\n\n) {4}.*\n(?:\n* {4}.*\n)*")
_ITEM = re.compile(r"^\d+\. .*\n(?:\n* {3,}.*\n)*", re.MULTILINE)  # of a list, whose paragraphs are indented, too
_INLINE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
_SHELL = r"(?:[A-Z_]+=\S+ )*(make|blender|python|pip|meshfree|openjd|bash) \S.*"
_TYPED = re.compile(rf"{_SHELL}|bpy\.ops\.\w+\..*")

WHEEL = "https://server/meshfree_laplacian-1.2.3-py3-none-any.whl"
FARM = "needs a scheduler; tests/wheel/test_farm.py runs it on other files"
SERVER = "needs a server; tests/gui/test_repository.py runs it with one"
DASK = "needs a cluster; tests/wheel/test_scale.py runs it on workers of its own"
SLOW = "takes minutes to hours; test_pages.py of the core looks for the module"
NOT_RUN = {
    "blender --command meshfree VERB IN [IN ...] --out FILE | --out-dir DIR [options] [--format FORMAT]": "a form",
    "bpy.ops.meshfree.<name>()": "stands for every operator",
    "blender -b FILE -a": "a form, of a command of Blender",
    "blender --background --command meshfree": "a form",
    "openjd run farm/openjd/template.yaml -p InputDir=/data/scans -p OutputDir=/data/out -p Parts=40": FARM,
    "bash farm/slurm/meshfree.sh 40 analyze /data/scans /data/out --modes 10": FARM,
    "blender --online-mode --command extension repo-add --name Studio --url https://server/index.json studio": SERVER,
    "blender --online-mode --command extension install --sync --enable studio.meshfree_laplacian": SERVER,
    "blender --online-mode --command extension update --sync": SERVER,
    f'pip install "meshfree-laplacian[scale] @ {WHEEL}"': "changes the environment, from the internet",
    f'pip install "meshfree-laplacian[files] @ {WHEEL}"': "changes the environment, from the internet",
    "python -m meshfree_laplacian": "another name of a program; tests/wheel/test_wheel.py runs it",
    "meshfree tiles run scans --out-dir out --workers 8 --memory 4GB": DASK,
    "meshfree tiles run scans --out-dir out --scheduler tcp://head:8786 --memory 4GB": DASK,
    "pip install laspy lazrs": "changes the environment, from the internet",
    "pip install open3d==0.19.0": "changes the environment, from the internet",
    "pip install open3d==0.20.0": "changes the environment, from the internet",
    "python -m benchmarks.awkward": SLOW,
    "python -m benchmarks.holes": SLOW,
    "python -m benchmarks.orientation": SLOW,
    "MESHFREE_ZOO=folder python -m benchmarks.tiles zoo": SLOW,
    "python -m benchmarks.tiles run 5000000": SLOW,
    "MESHFREE_ZOO=folder python -m benchmarks.ablation": SLOW,
    "MESHFREE_ZOO=folder python -m benchmarks.alignment": SLOW,
    "MESHFREE_ZOO=folder python -m benchmarks.real_shapes": SLOW,
    "MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.meshes": SLOW,
    "MESHFREE_ZOO=folder MESHFREE_RAW=folder python -m benchmarks.strays": SLOW,
}


class Snippet(NamedTuple):
    """Something to type: its page, its text, and what it is typed into."""

    page: Path
    text: str
    kind: str

    @property
    def id(self):
        """The page with the first line that is not an import."""
        lines = [line for line in self.text.splitlines() if line and not line.startswith(("import ", "from "))]
        return f"{self.page.stem}: {lines[0][:60]}"


def snippets(kind):
    """All different snippets of a kind on the pages, but for those that are not run."""
    return list(dict.fromkeys(one for one in typed() if one.kind == kind and one.text not in NOT_RUN))


def typed():
    """All that the pages tell to type, in their order."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for language, code in _FENCED.findall(text):
            yield Snippet(page, code, _kind(code) if language == "python" else language)
        text = _FENCED.sub("", text)
        items, text = "".join(_ITEM.findall(text)), _ITEM.sub("", text)
        for block in _INDENTED.findall(text):
            for one in _parts(re.sub(r"^ {4}", "", block, flags=re.MULTILINE)):
                yield Snippet(page, one, _kind(one))
        for code in _INLINE.findall(_INDENTED.sub("", text) + items):
            if _TYPED.fullmatch(code):
                yield Snippet(page, code, _kind(code))


def _parts(block):
    """Commands of the shell line by line, without comments, and what stands beside them; all else whole."""
    parts = block.split("\n\n")
    if not any(re.match(_SHELL, part) for part in parts):
        return [block]
    return [one.rstrip() for part in parts for one in (_lines(part) if re.match(_SHELL, part) else [part])]


def _lines(commands):
    return [line.split("  #")[0] for line in commands.splitlines()]


def _kind(text):
    """What is typed: a program of a shell, json, or Python with core, with what the wheel's environment has, or bpy."""
    command = re.match(_SHELL, text)
    if command:
        return command[1]
    if text.startswith("{"):
        return "json"
    if re.search(r"^(from|import) matplotlib\b", text, re.MULTILINE):
        return "wheel"
    return "core" if re.search(r"^(from|import) (core|meshfree_laplacian)\b", text, re.MULTILINE) else "bpy"
