"""What mkdocs asks this project as it builds the site of mkdocs.yml: pages outside docs/, navigation, API, formulas.

The API is what core and its packages list, read from the sources without importing them, under the name that it has in
the wheel. Names in code become links to it, and in *See Also* they must.
"""

import functools
import html
import logging
import re
import shutil
from pathlib import Path

import griffe
from latex2mathml.converter import convert
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File

from environments import ROOT

DOCS = ROOT / "docs"
NAME = "meshfree_laplacian"
COPY = ROOT / "build" / "site" / NAME  # of core
OUTSIDE = {"README": "index.md", "CHANGELOG": "changelog.md", "CONTRIBUTING": "contributing.md"}
INNER = {"algebra", "geometry", "operator"}  # packages whose lists are for other packages of core

_log = logging.getLogger("mkdocs.hooks.website")  # its warnings fail a strict build
_RELEASES = re.compile(r"\[([^]]+)\]\(\.\./\.\./releases\)")  # as pages on GitHub call them
_OUTSIDE = re.compile(rf"\]\((?:\.\./)?((?:\.\./)*)({'|'.join(OUTSIDE)})\.md")
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[([](.*?)\\[)\]]</\1>', re.DOTALL)
_SEE_ALSO = re.compile(r'<details class="see-also".*?</details>', re.DOTALL)
_NAMED = re.compile(r"(<p>|\n)([\w., ]+)(?= : )")
_CODE = re.compile(r"<code>([A-Za-z_][\w.]*)</code>")
_TYPE = re.compile(r'(field-body">\s*(?:<b>.*</b>\s*\()?<code>)\((.*)\)(?=</code>)')
_EXAMPLE = re.compile(r"(?:^>>> .*\n?)+", re.MULTILINE)
_LOADED = re.compile(r"<(?:script|img|iframe|source)[^>]+src=\W?(?:https?:)?//[^>]+>|<link[^>]+(?:https?:)?//[^>]+>")


@event_priority(100)  # before that of mkdocstrings, which looks for the copy
def on_config(config):
    """Copy core under the name that it has in the wheel, and take the navigation from the tables of the manual."""
    shutil.rmtree(COPY, ignore_errors=True)
    shutil.copytree(ROOT / "core", COPY, ignore=shutil.ignore_patterns("__pycache__"))
    api.cache_clear()
    _core.cache_clear()
    manual = (DOCS / "manual.md").read_text(encoding="utf-8")
    pages, operators = (
        list(dict.fromkeys(re.findall(r"^\| \[[^]]*\]\(([^)#]+)", table, re.MULTILINE)))
        for table in manual.split("\n## Operators\n")
    )
    apart = ["manual.md", "results.md", "releasing.md"]
    others = [path.name for path in sorted(DOCS.glob("*.md")) if path.name not in [*pages, *apart]]
    config.nav = [
        {"Home": ["index.md", "changelog.md"]},
        {"Manual": ["manual.md", *(page for page in pages if page not in apart)]},
        {"Operators": operators},
        {"Python": [_place(package) for package in api()]},
        {"Results": ["results.md", *others]},
        {"Development": ["contributing.md", "releasing.md"]},
    ]
    return config


def on_files(files, config):
    """Add the pages that do not lie in docs/."""
    for name, place in OUTSIDE.items():
        text = (ROOT / f"{name}.md").read_text(encoding="utf-8").replace("](docs/", "](")
        files.append(File.generated(config, place, content=text))
    for package, things in api().items():
        about = _EXAMPLE.sub(lambda found: f"```pycon\n{found[0].strip()}\n```\n", _core()[package].docstring.value)
        text = "\n\n".join([f"# {package.rpartition('.')[2]}", about, *(f"::: {path}" for path in things.values())])
        files.append(File.generated(config, _place(package), content=text))
    return files


def on_page_markdown(markdown, config, **_):
    """Lead links to where things are on the site."""
    markdown = _OUTSIDE.sub(lambda found: f"]({found[1]}{OUTSIDE[found[2]]}", markdown)
    return _RELEASES.sub(rf"[\1]({config.repo_url}/releases)" if config.repo_url else r"\1", markdown)


def on_page_content(content, page, **_):
    """Write formulas as MathML, which browsers show by themselves, names in the API as links, and types as they are."""
    content = _FORMULA.sub(_formula, content)
    if page.file.src_uri.startswith("api/"):
        topic = Path(page.file.src_uri).stem
        content = _SEE_ALSO.sub(lambda part: _NAMED.sub(lambda names: _links(*names.groups(), topic), part[0]), content)
        content = _CODE.sub(lambda found: _link(found[1], topic, found[0], " optional") or found[0], content)
        content = _TYPE.sub(r"\1\2", content)  # of (ndarray, (n, 3)), as a type like this is read
    return content


def on_post_page(output, page, **_):
    """Refuse what is loaded from other hosts."""
    for found in _LOADED.findall(output):
        if 'rel="canonical"' not in found:
            _log.warning("%s loads from another host: %s", page.file.src_uri, found)
    return output


@functools.lru_cache
def api():
    """Return what core and its public packages list, each thing once: by package, and by the name that users call."""
    core = _core()[NAME]
    found, seen = {NAME: {}}, set()
    for package in [core, *(one for one in core.modules.values() if one.is_init_module and one.name not in INNER)]:
        homes = {name: _home(core, listed) for name, listed in package.imports.items()}
        for name, home in sorted(homes.items(), key=lambda item: item[1].rpartition(".")[0]):
            if not home.startswith(f"{NAME}.") or home in seen:
                continue
            thing = core[home.removeprefix(f"{NAME}.")]
            documented = thing.has_docstring and "\n---" in thing.docstring.value
            if thing.is_module or (package is not core and not documented):
                continue
            seen.add(home)
            # Where a module has the name of what is in it, griffe finds the module by the short name.
            called = f"{package.path}.{name}"
            found.setdefault(package.path, {})[called] = home if thing.parent.name == name else called
    return found


@functools.lru_cache
def _core():
    return griffe.load(NAME, search_paths=[COPY.parent]).modules_collection


def _home(core, path):
    """Follow a name through the packages that list it to where it is defined."""
    parent, _, name = path.rpartition(".")
    module = core if parent == NAME else core.modules_collection.get_member(parent) if parent.startswith(NAME) else None
    listed = module.imports.get(name, path) if module else path
    return path if listed == path else _home(core, listed)


def _place(package):
    return "api/index.md" if package == NAME else f"api/{package.rpartition('.')[2]}.md"


def _formula(found):
    return convert(html.unescape(found[2]), display="block" if found[1] == "div" else "inline")


def _links(before, names, topic):
    missing = '<autoref identifier="{0}">{0}</autoref>'  # which mkdocs warns of
    links = ", ".join(_link(name, topic, name) or missing.format(name) for name in names.split(", "))
    return f"{before.replace(chr(10), '<br>')}{links}"


def _link(name, topic, shown, kind=""):
    """Return a reference to what a text about a package calls so, or to a method of it; None if there is no such."""
    paths = {called: path for things in api().values() for called, path in things.items()}
    first, _, method = name.rpartition(".")
    for called, rest in ((name, ""), (f"{topic}.{name}", ""), (first, method), (f"{topic}.{first}", method)):
        if path := paths.get(f"{NAME}.{called}"):
            return f'<autoref identifier="{f"{path}.{rest}".rstrip(".")}"{kind}>{shown}</autoref>'
    return None
