"""Mesh-Free Laplacian: areas, normals, curvature and vibration modes of point clouds, inside Blender."""


def _classes():
    from .operators import analyze, deform, fields, job, minimal, segment, selecting, smooth, spectrum
    from .ui import applications, colormap, legend, panel, points, presets, range_selection, settings

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
        legend,
        range_selection,
        presets,
        panel,
        points,
        applications,
    )
    return [cls for module in modules for cls in module.CLASSES]


def _attached():
    """Return the modules that add more than classes to Blender."""
    from .operators import cache, command, deform, job
    from .ui import overlay, settings

    return settings, command, deform, cache, job, overlay


def register():
    """Add the extension's classes, the settings of objects, handlers and the command line to Blender."""
    import bpy

    for cls in _classes():
        bpy.utils.register_class(cls)
    for module in _attached():
        module.attach()


def unregister():
    """Take everything out again, in reverse order."""
    import bpy

    for module in reversed(_attached()):
        module.detach()
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)
