"""Mesh-Free Laplacian: areas, normals, curvature and vibration modes of point clouds, inside Blender."""

import importlib
import pkgutil

_registered = []


def _modules():
    """All modules with something to register, in their order: classes, and what is attached to Blender otherwise."""
    from .ui import missing

    if not missing.scipy_serves():
        return (missing,)
    from .operators import rigging, tools
    from .operators.deform import bake, deleted, handle_kind, live
    from .operators.deform import tools as deform
    from .operators.files import command, exporting, importing, show_splats, tiles
    from .operators.objects import counting, motion, motion_files, notices, settings
    from .operators.running import cache, job, later
    from .ui import (
        advanced,
        applications,
        colormap,
        drag,
        editing,
        groups,
        iso_lines,
        keys,
        legend,
        measures,
        menus,
        overlay,
        panel,
        preferences,
        presets,
        range_selection,
        rig,
        show,
        showing,
    )
    from .ui import deform as deform_panel

    return (
        settings,
        notices,
        cache,
        counting,
        motion,
        motion_files,
        job,
        later,
        *_within(tools),
        handle_kind,
        deform,
        bake,
        deleted,
        live,
        *_within(rigging),
        importing,
        tiles,
        show_splats,
        exporting,
        command,
        show,
        colormap,
        legend,
        range_selection,
        iso_lines,
        measures,
        presets,
        panel,
        showing,
        groups,
        applications,
        deform_panel,
        rig,
        advanced,
        menus,
        keys,
        editing,
        overlay,
        drag,
        preferences,
    )


def _within(package):
    """All modules of a package: a new tool is found without being named here."""
    found = pkgutil.iter_modules(package.__path__)
    return [importlib.import_module(f"{package.__name__}.{module.name}") for module in found]


def _classes(module):
    """All classes of a module that Blender registers: operators of tools, and others."""
    return [*(tool.operator for tool in getattr(module, "TOOLS", ())), *getattr(module, "CLASSES", ())]


def register():
    """Add the extension's classes, the settings of objects, menus, handlers and the command line to Blender."""
    import bpy

    from .operators import registration

    for module in _modules():
        for cls in _classes(module):
            bpy.utils.register_class(cls)
        registration.add(getattr(module, "TOOLS", ()))
        if hasattr(module, "attach"):
            module.attach()
        _registered.append(module)


def unregister():
    """Take everything out again, in reverse order."""
    import bpy

    from .operators import registration

    registration.clear()
    while _registered:
        module = _registered.pop()
        if hasattr(module, "detach"):
            module.detach()
        for cls in reversed(_classes(module)):
            bpy.utils.unregister_class(cls)
