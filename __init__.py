"""Mesh-Free Laplacian: areas, normals, curvature and vibration modes of point clouds, inside Blender."""

_registered = []


def _modules():
    """All modules with something to register, in their order: classes, and what is attached to Blender otherwise."""
    from .ui import missing

    if not missing.scipy_serves():
        return (missing,)
    from .operators.deform import bake, live
    from .operators.deform import tools as deform
    from .operators.files import command, exporting, importing
    from .operators.objects import counting, notices, settings
    from .operators.running import cache, job
    from .operators.tools import (
        along,
        analyze,
        compare,
        convert,
        curvature,
        fields,
        mesh,
        minimal,
        orient,
        segment,
        sequence,
        smooth,
        spectrum,
        splats,
        surface,
    )
    from .operators.tools import select as selecting
    from .ui import (
        applications,
        colormap,
        drag,
        iso_lines,
        keys,
        legend,
        menus,
        overlay,
        panel,
        points,
        preferences,
        presets,
        range_selection,
        show,
    )
    from .ui import deform as deform_panel

    return (
        settings,
        notices,
        cache,
        counting,
        job,
        analyze,
        orient,
        surface,
        splats,
        mesh,
        compare,
        spectrum,
        sequence,
        curvature,
        smooth,
        segment,
        fields,
        along,
        deform,
        bake,
        live,
        minimal,
        selecting,
        convert,
        importing,
        exporting,
        command,
        show,
        colormap,
        legend,
        range_selection,
        iso_lines,
        presets,
        panel,
        points,
        applications,
        deform_panel,
        menus,
        keys,
        overlay,
        drag,
        preferences,
    )


def register():
    """Add the extension's classes, the settings of objects, menus, handlers and the command line to Blender."""
    import bpy

    for module in _modules():
        for cls in getattr(module, "CLASSES", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "attach"):
            module.attach()
        _registered.append(module)


def unregister():
    """Take everything out again, in reverse order."""
    import bpy

    while _registered:
        module = _registered.pop()
        if hasattr(module, "detach"):
            module.detach()
        for cls in reversed(getattr(module, "CLASSES", ())):
            bpy.utils.unregister_class(cls)
