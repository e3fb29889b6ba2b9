"""Updates the display: modifier, size of the points, and colours by the settings of the object."""

import math

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent

from .. import core
from ..operators.deform.nodes import find_deform, is_baked, show_live, turns_discs
from ..operators.objects.attributes import (
    DISC,
    in_edit_mesh,
    point_count,
    points_checksum,
    positions_now,
    read_attribute,
)
from ..operators.objects.colors import is_color, own_colors, own_material, splat_colors
from ..operators.objects.groups import handle_names, has_group
from ..operators.objects.handlers import add_handlers, remove_handlers
from ..operators.objects.modifiers import DISPLAY_TAG, get_input, has_input, set_input
from ..operators.objects.reading import TYPES, sharing_objects, spacing
from ..operators.objects.splats import BASE, MOST_DRAWN, has_splats
from ..operators.running.discs import renew_discs
from ..tools.groups import ANCHOR, BOUNDARY_GROUP, HANDLE, HIGH, LOW, ROLES
from ..tools.quantities import MEAN_CURVATURE, STRAY, quantity
from . import colormaps, legend, smooth, solid
from .display import (
    NAME,
    component,
    draws_faces,
    find_display,
    find_material,
    is_cloud,
    is_colored,
    is_distance,
    is_in_solid,
    is_texture,
    numbers,
    shown_attribute,
    sloping,
    without_unreached,
)
from .materials import (
    color_by_checker,
    color_by_direction,
    color_by_number,
    color_by_own,
    color_plain,
    color_splats,
    dim_back,
    is_plain,
    shade,
    stroke_material,
)
from .nodes import DISCS, FILLED, INK, LENGTH, MOST, SMOOTH, SOLID_NAME, SPLATS, STROKES, display_group
from .value_range import STEPPED, all_zero, fit_range

_MOST_HANDLES = 6  # that have colors
_LATE = LOW, HIGH  # groups of later versions
_MOST_GROUPS = 12  # attributes of groups in a material: Blender's shaders have at most 15
_MOST_WITHOUT_CARD = 20_000  # dots that two processors draw ten times a second, see benchmarks/frames.py
_LINE_WIDTH = 1.0 / 250.0  # of iso lines, in the root of the area
_SURFACE, _OWN = "<surface>", "<material>"  # what is shown that is no attribute
_previewed = set()  # views that were in Solid before something was shown that passes, by their pointers
_noted = {}  # Group Colors of objects in Edit Mode while something is undone, by session_uid
_UNTOUCHED = (1.0, 1.0, 1.0, 1.0)  # color of objects
_NO_SPACING = 0.01  # for points too few to have one


def show_attribute(obj, name: str = "", radius: float = 0.0):
    """Show an attribute of an object as colours on the points, by its display settings.

    Without a name it is the one on show, or the mean curvature. The radius of the points is in local lengths; 0 for the
    setting Point Size, or a radius set by hand. Attributes that are not there, or hold neither numbers nor vectors nor
    colors on points, raise `PointCloudError`.
    """
    if not name:
        name = shown_attribute(obj)
        if name not in obj.data.attributes:
            name = MEAN_CURVATURE
    values = _read(obj.data, name)
    modifier, new = _add_display(obj)
    if radius:
        set_input(modifier, "Radius", radius)
    elif new or not _sized_by_hand(obj):
        resize(obj)
    _color(obj, name, values)
    reshape(obj)


def _read(data, name):
    """Read the values of an attribute to be shown; None for colors, which the material uses directly."""
    return None if is_color(data, name) else read_attribute(data, name)


def _add_display(obj):
    """Return the display modifier of an object, as its last one, and whether it is new."""
    modifier = find_display(obj)
    new = modifier is None
    if new:
        modifier = obj.modifiers.new(NAME, "NODES")
        modifier.node_group = display_group()
        set_input(modifier, MOST, viewport_points())
    elif not has_input(modifier.node_group, SOLID_NAME):  # of an earlier version
        names = [name for name in ("Radius", "Material", MOST, LENGTH, INK) if has_input(modifier.node_group, name)]
        kept = {name: get_input(modifier, name) for name in names}
        modifier.node_group = display_group()
        for name, value in kept.items():
            set_input(modifier, name, value)
    modifier.use_pin_to_last = True
    obj.modifiers.move(list(obj.modifiers).index(modifier), len(obj.modifiers) - 1)
    return modifier, new


def viewport_points() -> int:
    """How many points the viewport is to draw at most, so that it can be orbited smoothly; 0 for all."""
    return _MOST_WITHOUT_CARD if _without_card() else 0


def _without_card() -> bool:
    """Whether there is no GPU: then Material Preview compiles its shaders for half a minute, and Solid none."""
    return not bpy.app.background and gpu.platform.device_type_get() == "SOFTWARE"


def recolor(obj):
    """Color the points by changed settings, if an attribute is on display."""
    name = shown_attribute(obj)
    if not name or name not in obj.data.attributes:
        return
    in_solid = is_in_solid(obj)
    _color(obj, name, _read(obj.data, name))
    reshape(obj)
    if in_solid and not is_in_solid(obj):  # such as with iso lines
        use_material_preview(bpy.context)


def follow_frame(obj):
    """Follow an attribute that was written for another frame where viewports in Solid would show earlier colors."""
    if is_in_solid(obj):
        recolor(obj)


def show_groups(obj):
    """Update the display by the setting Group Colors: on top of colors, or on plain points."""
    if obj.type not in TYPES:
        return
    modifier, material = find_display(obj), find_material(obj)
    plain = material is not None and is_plain(material)
    if plain and not obj.meshfree.show_groups:
        _uncolor(obj, DISC in obj.data.attributes)
    elif obj.meshfree.show_groups and (modifier is None or get_input(modifier, "Material") is None):
        _add_display(obj)
        resize(obj)
        plain = True
    if plain and obj.meshfree.show_groups:
        color_plain(_display_material(obj), group_colors(obj))
        dim_back(_display_material(obj), obj.meshfree.dim_back)
        shade(_display_material(obj), obj.meshfree.shaded)
        obj.update_tag()
    recolor(obj)
    if obj.meshfree.show_groups:
        _previewed.update(_to_preview(bpy.context))
    else:
        _leave_preview()


def _uncolor(obj, surface):
    """Show no colors any more: the surface alone, or nothing."""
    modifier, material = find_display(obj), find_material(obj)
    set_input(modifier, "Material", None)  # Blender 5.2 would go on counting it as used
    if not surface:
        obj.modifiers.remove(modifier)
    if material is not None:
        _remove_unused(material)
    reshape(obj)


@persistent
def _note_groups(*_):
    """Keep the setting Group Colors of objects in Edit Mode before undo or redo."""
    _noted.update({obj.session_uid: obj.meshfree.show_groups for obj in bpy.data.objects if obj.mode == "EDIT"})


@persistent
def _follow_undo(*_):
    """Restore Group Colors in Edit Mode, where undo is for changes of points; find again what had come later."""
    for obj in [obj for obj in bpy.data.objects if obj.is_editable and obj.data is not None and obj.data.is_editable]:
        kept = obj.meshfree
        shown = _noted.get(obj.session_uid, kept.show_groups)
        if kept.show_groups != shown:
            kept.show_groups = shown
        if kept.slopes_later:
            recolor(obj)
        else:
            smooth.forget(obj)
        if obj.mode == "OBJECT" and kept.discs_of not in ("", kept.spacing_of):
            renew_discs(obj, kept.spacing_of)
    _noted.clear()


def show_result(obj, name):
    """Show a new result; without a name the displayed attribute, or the mean curvature."""
    passing = name == STRAY
    if passing and shown_attribute(obj) != STRAY:
        obj.meshfree.shown_before = _looks(obj)
    show_attribute(obj, MEAN_CURVATURE if not name and is_colored(obj) else name)
    look_at([obj], passing)


def _looks(obj) -> str:
    """Return what an object shows: an attribute, its own material, the surface alone, or nothing."""
    modifier = find_display(obj)
    if modifier is None:
        return ""
    own = own_material(obj)
    return shown_attribute(obj) or (_OWN if own is not None and get_input(modifier, "Material") == own else _SURFACE)


def show_former(obj):
    """Show what an object showed before its stray points, which are gone."""
    if shown_attribute(obj) != STRAY:
        return
    former = obj.meshfree.shown_before
    if former in obj.data.attributes:
        show_attribute(obj, former)
    elif former == _OWN and own_material(obj) is not None:
        show_own_material(obj)
    elif has_splats(obj.data):
        show_splats(obj)
    else:
        _uncolor(obj, former != "")
        show_groups(obj)
    _leave_preview()


def show_sequence(objects, name):
    """Show an attribute of several objects by one colour map and in one range, which is locked, for all of them."""
    first = objects[0].meshfree
    values = np.concatenate([read_attribute(obj.data, name) for obj in objects])
    mode = "AUTO" if first.range_mode == "LOCKED" else first.range_mode
    chosen = "LIDAR" if first.color_map == "AUTO" and _are_lidar_classes(name, values) else first.color_map
    color_map, low, high = fit_range(values, chosen, mode, first.coverage)
    for obj in objects:
        settings = obj.meshfree
        settings.color_map, settings.range_mode = color_map, "LOCKED"
        settings.range_low, settings.range_high = low, high
        show_attribute(obj, name)
    look_at(objects)


def _are_lidar_classes(name, values) -> bool:
    """Whether an attribute holds classes of LAS files that all have a color of their own."""
    if name != "classification" or values.dtype.kind not in "iu" or not len(values):
        return False
    return values.min() >= 0 and values.max() < len(colormaps.colors("LIDAR")) - 1


def show_surface(obj):
    """Show the points of an object as discs, in the displayed attribute, their own material or their own colors."""
    modifier, _ = _add_display(obj)
    resize(obj)
    name = own_colors(obj.data)
    if name and get_input(modifier, "Material") is None and own_material(obj) is None:
        show_colors([obj])
    follow_own_material(obj)


def show_colors(objects):
    """Show objects, such as the frames of a sequence, in the colors that their points have, by one material."""
    first, *others = objects
    show_attribute(first, own_colors(first.data))
    for obj in others:
        modifier, _ = _add_display(obj)
        set_input(modifier, "Material", find_material(first))
        resize(obj)
    show_in_solid(first)


def show_own_material(obj):
    """Show an object in the material of its first slot, also after a change of that."""
    modifier, material, own = find_display(obj), find_material(obj), own_material(obj)
    set_input(modifier, "Material", own)
    obj.meshfree.own_material = own
    if material is not None:
        _remove_unused(material)
    reshape(obj)
    redraw_views()


def follow_own_material(obj):
    """Update a display that shows the material of the object's first slot."""
    modifier = find_display(obj)
    if modifier is None or not obj.is_editable or get_input(modifier, "Material") != obj.meshfree.own_material:
        return  # it shows another material
    own = own_material(obj)
    if own != obj.meshfree.own_material:
        obj.meshfree.own_material = own
        set_input(modifier, "Material", own)
        obj.update_tag()


def _catch_up(obj):
    """Repeat a coloring after Edit Mode, where colors for Solid and gradients could not be written."""
    if obj.meshfree.colors_behind and not in_edit_mesh(obj) and obj.is_editable:
        recolor(obj)


@persistent
def _objects_changed(_scene, depsgraph):
    for update in depsgraph.updates:
        if isinstance(update.id, bpy.types.Object) and update.id.type in TYPES:
            follow_own_material(update.id.original)
            _catch_up(update.id.original)
            if update.is_updated_geometry:
                _follow_points(update.id.original)


def _follow_points(obj):
    """Let a display follow points that were moved, added or deleted, in whatever way: their size, and their discs."""
    if find_display(obj) is None or find_deform(obj) is not None or obj.mode != "OBJECT" or not obj.is_editable:
        return
    by_hand = _sized_by_hand(obj)
    if obj.data.is_editable and _measure(obj) and not by_hand:
        _scale(obj)


def show_splats(obj):
    """Show splats as ellipsoids in their own colors; in Solid in the mean of these."""
    modifier, new = _add_display(obj)
    if new and point_count(obj.data) > MOST_DRAWN and not get_input(modifier, MOST):
        set_input(modifier, MOST, MOST_DRAWN)
    colors = splat_colors(obj.data)
    mean = np.average(colors, axis=0, weights=read_attribute(obj.data, BASE)[:, 3] + 1e-6)
    color_splats(_display_material(obj), mean)
    if tuple(obj.color) == _UNTOUCHED:  # which Solid shows by Vertex and by Object
        obj.color = mean
    obj.meshfree.point_shape = "DISCS"
    resize(obj)
    use_material_preview(bpy.context)


def show_alike(obj, made):
    """Show a mesh made from an object in the displayed attribute of that, or in its own colors."""
    name, own = shown_attribute(obj), own_material(obj)
    if own is not None:
        made.data.materials.append(own)
    if name and name in made.data.attributes and not is_color(made.data, name):
        show_result(made, name)
    elif own_colors(made.data) and (own is None or name):
        show_colors([made])


def show_in_solid(obj):
    """Let viewports in Solid show the colors of an object's discs; switch to Material Preview for dots."""
    for area in _views():
        shading = area.spaces.active.shading
        if shading.type == "SOLID":
            if draws_faces(obj):
                shading.color_type = "VERTEX"
            else:
                shading.type = "MATERIAL"


def look_at(objects, passing=False):
    """Let the active viewport show the display of objects: without a GPU in Solid, if possible.

    Of a passing one it is known where to return to, see `_leave_preview`.
    """
    if _without_card() and all(is_in_solid(obj) for obj in objects):
        for obj in objects:
            show_in_solid(obj)
    elif passing:
        _previewed.update(_to_preview(bpy.context))
    else:
        use_material_preview(bpy.context)


def use_material_preview(context):
    """Switch the active viewport from Solid, where points are gray, to Material Preview, for good."""
    _to_preview(context)
    _previewed.clear()


def _to_preview(context) -> set:
    """Switch the active viewport from Solid to Material Preview, and return the pointers of those that were switched.

    From the Properties editor, which has some of our panels, switch all viewports of the screen.
    """
    space = context.space_data
    if space is None or context.scene.render.engine == "BLENDER_WORKBENCH":  # which has none
        return set()
    spaces = [area.spaces.active for area in context.screen.areas] if space.type == "PROPERTIES" else [space]
    switched = [view for view in spaces if view.type == "VIEW_3D" and view.shading.type == "SOLID"]
    for view in switched:
        view.shading.type = "MATERIAL"
    return {view.as_pointer() for view in switched}


def _leave_preview():
    """Switch viewports back to Solid that were in it, once no object shows groups any more."""
    if any(obj.meshfree.show_groups for obj in bpy.context.view_layer.objects):
        return
    for area in _views():
        view = area.spaces.active
        if view.as_pointer() in _previewed and view.shading.type == "MATERIAL":
            view.shading.type = "SOLID"
    _previewed.clear()


def resize(obj):
    """Set the size of the points by the settings, in units of their spacing."""
    if find_display(obj) is not None:
        _measure(obj)
        _scale(obj)


def _scale(obj):
    """Set the size by a spacing that is known."""
    set_input(find_display(obj), "Radius", _radius(obj.meshfree))
    reshape(obj)


def _measure(obj) -> bool:
    """Measure the spacing of the points, and find their discs again, if they have changed; return whether they have."""
    kept = obj.meshfree
    if obj.mode == "EDIT":
        if not kept.spacing:
            kept.spacing = core.geometry.typical_distance(positions_now(obj))
        return False
    points = points_checksum(obj.data)
    changed = kept.spacing_of != points
    if changed:
        kept.discs_of = kept.discs_of or kept.spacing_of  # which earlier versions did not know
        kept.spacing_of, kept.spacing = points, spacing(obj.data)
        renew_discs(obj, points)
    return changed


def reshape(obj):
    """Draw discs and strokes where chosen and known; no strokes while handles move the points, as they do not rotate.

    Clouds in Edit Mode are drawn by ui/editing.py.
    """
    modifier, deform = find_display(obj), find_deform(obj)
    if deform is not None and not is_baked(obj):
        show_live(deform)  # discs may be new
    if modifier is not None:
        group, known = modifier.node_group, DISC in obj.data.attributes
        formed = obj.meshfree.point_shape == "DISCS"
        discs = known and formed and (deform is None or turns_discs(deform))
        if has_input(group, DISCS):
            set_input(modifier, DISCS, discs)
        if has_input(group, FILLED):
            set_input(modifier, FILLED, known and formed)
        if has_input(group, SMOOTH):  # gradients are not rotated
            sloping_now = discs and deform is None and obj.meshfree.slopes_of != ""
            set_input(modifier, SMOOTH, shown_attribute(obj) if sloping_now else "")
        if has_input(group, SOLID_NAME) and not shown_attribute(obj):
            set_input(modifier, SOLID_NAME, "")
        if has_input(group, SPLATS):
            set_input(modifier, SPLATS, formed and has_splats(obj.data))
        modifier.show_in_editmode = not is_cloud(obj)
        if has_input(group, STROKES):
            stroked = known and deform is None and _has_strokes(obj)
            set_input(modifier, STROKES, shown_attribute(obj) if stroked else "")
            if stroked and get_input(modifier, INK) is None:  # else keep the user's choice
                set_input(modifier, INK, stroke_material())
    obj.update_tag()


def _has_strokes(obj):
    """Whether the displayed attribute has strokes."""
    settings, name = obj.meshfree, shown_attribute(obj)
    return settings.strokes and quantity(name).along_surface and component(name, settings) == "DIRECTION"


def _radius(settings):
    return settings.point_size * settings.spacing or _NO_SPACING


def _sized_by_hand(obj):
    """Whether the radius differs from that of the settings."""
    return not math.isclose(get_input(find_display(obj), "Radius"), _radius(obj.meshfree), rel_tol=1e-5)


def colors_and_range(name, values, shown, settings):
    """Return the color map for the displayed numbers of an attribute, its range, and the numbers that count for it."""
    locked = settings.range_low, settings.range_high
    chosen = [settings.color_map, settings.range_mode]
    if quantity(name).color_range == "symmetric":  # centered on zero, even if all values have one sign
        chosen = [
            choice if choice != "AUTO" else auto
            for choice, auto in zip(chosen, ("COOL_WARM", "SYMMETRIC"), strict=True)
        ]
    if _are_lidar_classes(name, values) and settings.color_map == "AUTO":
        chosen[0] = "LIDAR"
    counted, distance = without_unreached(name, shown), is_distance(name, values, component(name, settings))
    return *fit_range(counted, *chosen, settings.coverage, locked, distance), counted


def _color(obj, name, values):
    _measure(obj)
    settings, material, groups = obj.meshfree, _display_material(obj), group_colors(obj)
    settings.colors_behind = in_edit_mesh(obj)
    part = component(name, settings)
    shown, stepped, colors_of = None if values is None else numbers(values, part), False, None
    if values is None:
        color_by_own(material, name, groups)
    elif is_texture(values):
        color_by_checker(material, name, groups)
    elif shown is None:
        color_by_direction(material, name, groups)
        colors_of = solid.direction_colors
    else:
        color_map, low, high, counted = colors_and_range(name, values, shown, settings)
        if settings.range_mode != "LOCKED":
            settings.range_low, settings.range_high = (0.0, 0.0) if all_zero(counted) else (low, high)
        component_shown, stepped = part if values.ndim > 1 else "", color_map in STEPPED
        width = _LINE_WIDTH * settings.spacing * math.sqrt(point_count(obj.data))
        color_by_number(material, name, component_shown, color_map, low, high, settings, groups, width)
        if settings.outside != "HIDE" and (stepped or not settings.iso_lines):  # else Solid shows less
            colors_of = solid.number_colors(color_map, low, high, settings)
    dim_back(material, settings.dim_back)
    shade(material, settings.shaded)
    columns = [] if values is None or stepped or not settings.smooth else sloping(name, values, part)
    smooth.follow(obj, name, part, columns, settings.spacing)
    _follow_in_solid(obj, values if shown is None else shown, None if groups else colors_of)
    for other in sharing_objects(obj):  # which may show another attribute
        if shown_attribute(other) != name and is_in_solid(other):
            set_input(find_display(other), SOLID_NAME, "")
        reshape(other)
    obj.update_tag()
    legend.renew(obj)
    redraw_views()


def _follow_in_solid(obj, values, colors_of):
    """Let viewports in Solid show the colors of values by a function; without one, those of the mesh."""
    modifier = find_display(obj)
    if not has_input(modifier.node_group, SOLID_NAME):  # of an earlier version
        return
    name = solid.follow(obj, values, colors_of if draws_faces(obj) else None, get_input(modifier, "Radius"))
    set_input(modifier, SOLID_NAME, name)


def _remove_unused(material):
    if not material.users - material.use_fake_user:
        bpy.data.materials.remove(material)


def _display_material(obj):
    """Return the material of an object's points; a new one if there is none, or if a duplicate shares it."""
    material = find_material(obj)
    if material is None or material.users - material.use_fake_user > 1:
        material = bpy.data.materials.new(f"{NAME} {obj.name}")
        material[DISPLAY_TAG] = True
        set_input(find_display(obj), "Material", material)
    return material


def group_colors(obj) -> dict:
    """Return the colours of groups by name: none if they are not shown, and only the first ones of very many.

    Missing groups are included while there is room, so that assigned points are coloured at once, except those that
    materials of earlier versions do not have.
    """
    settings = obj.meshfree
    if not settings.show_groups:
        return {}
    names = {role: role for role in ROLES if role not in _LATE or has_group(obj, role)}
    if settings.boundary_group:
        names[settings.boundary_group] = BOUNDARY_GROUP
    names[settings.deform.anchors or ANCHOR] = ANCHOR
    for name in handle_names(obj)[:_MOST_HANDLES]:
        names[name] = HANDLE
    if len(names) > _MOST_GROUPS:
        names = {name: role for name, role in names.items() if has_group(obj, name)}
    return {name: colormaps.group_color(names[name]) for name in [*names][:_MOST_GROUPS]}


def redraw_views():
    """Redraw all 3D views, for their overlays."""
    for area in _views():
        area.tag_redraw()


def redraw_panels():
    """Redraw the sidebars of all 3D views."""
    for area in _views():
        next(region for region in area.regions if region.type == "UI").tag_redraw()


def _views():
    areas = (area for window in bpy.context.window_manager.windows for area in window.screen.areas)
    return (area for area in areas if area.type == "VIEW_3D")


_HANDLERS = {
    "colors_changed": recolor,
    "size_changed": resize,
    "shape_changed": reshape,
    "groups_changed": show_groups,
    "surface_found": show_surface,
    "colors_found": show_colors,
    "splats_found": show_splats,
    "result_written": show_result,
    "strays_gone": show_former,
    "mesh_made": show_alike,
    "frame_shown": follow_frame,
    "sequence_written": show_sequence,
    "views_changed": redraw_views,
    "panels_changed": redraw_panels,
    "undo_pre": _note_groups,
    "undo_post": _follow_undo,
    "redo_pre": _note_groups,
    "redo_post": _follow_undo,
    "depsgraph_update_post": _objects_changed,
}


def attach():
    """Add the handlers."""
    add_handlers(_HANDLERS)


def detach():
    """Remove the handlers."""
    remove_handlers(_HANDLERS)
