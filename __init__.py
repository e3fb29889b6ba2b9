"""Mesh-Free Laplacian: areas, normals, curvature and vibration modes of point clouds, inside Blender."""


def _classes():
    from .operators import analyze, deform, fields, job, minimal, segment, selecting, smooth, spectrum
    from .ui import applications, colormap, menus, panel, points, settings

    modules = (
        settings,
        job,
        analyze,
        spectrum,
        smooth,
        segment,
        fields,
        deform,
        minimal,
        selecting,
        colormap,
        panel,
        points,
        applications,
        menus,
    )
    return [cls for module in modules for cls in module.CLASSES]


def register():
    """Add the extension's classes, the settings of objects and the command line to Blender."""
    import bpy

    from .operators import cache, command, deform, job
    from .ui import menus, settings

    for cls in _classes():
        bpy.utils.register_class(cls)
    settings.attach()
    menus.attach()
    command.attach()
    deform.attach()
    cache.attach()
    job.attach()


def unregister():
    """Take everything out again, in reverse order."""
    import bpy

    from .operators import cache, command, deform, job
    from .ui import menus, settings

    job.detach()
    cache.detach()
    deform.detach()
    command.detach()
    menus.detach()
    settings.detach()
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)
