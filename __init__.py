"""Mesh-Free Laplacian: areas, normals, curvature and vibration modes of point clouds, inside Blender."""


def _classes():
    from .operators import analyze, bake, deform, fields, minimal, segment, selecting, smooth, spectrum
    from .ui import applications, colormap, panel, settings
    from .ui import deform as deform_panel

    modules = (
        settings,
        analyze,
        spectrum,
        smooth,
        segment,
        fields,
        deform,
        bake,
        minimal,
        selecting,
        colormap,
        panel,
        applications,
        deform_panel,
    )
    return [cls for module in modules for cls in module.CLASSES]


def register():
    """Add the extension's classes, the settings of objects and the command line to Blender."""
    import bpy

    from .operators import command, live
    from .ui import settings

    for cls in _classes():
        bpy.utils.register_class(cls)
    settings.attach()
    command.attach()
    live.attach()


def unregister():
    """Take everything out again, in reverse order, and give back the memory of the cached operators."""
    import bpy

    from .operators import cache, command, live
    from .ui import settings

    live.detach()
    command.detach()
    settings.detach()
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)
    cache.clear()
