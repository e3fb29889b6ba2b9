"""Draws clouds in Edit Mode over the black dots by which Blender shows vertices, and which cover a scan.

Each point is a disc in the color on show, of selected ones in Blender's color of selections. Nothing of Blender's is
changed for it, no preference and no overlay. Points are read anew when Blender tells that they have changed; after a
change of the selection alone only that is read.
"""

from dataclasses import dataclass
from typing import NamedTuple

import bmesh
import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent

from ..core.linalg import det, pinv
from ..operators.objects.attributes import DISC, has_vectors, read_attribute
from ..operators.objects.colors import is_color, own_colors, splat_colors
from ..operators.objects.handlers import add_handlers, remove_handlers
from ..operators.objects.modifiers import get_input
from ..operators.objects.splats import has_splats
from ..operators.tools.select import sees_through, selected_now
from . import colormaps, solid
from .display import component, find_display, is_cloud, is_texture, numbers, shown_attribute
from .materials import CHECKER, CHECKS, DIM
from .show import colors_and_range, group_colors

_PLAIN = (0.6, 0.6, 0.6, 1.0)  # where nothing is on show, linear
_DOT = 1.5  # radius of a disc at least, in those of Blender's dots, which stick out beside discs seen from the side
_NEARER = 2.0  # times what Blender draws its dots nearer than they are
_LAYOUT = """
struct View {
  mat4 to_view;
  mat4 to_normal;
  mat4 to_screen;
  vec4 clip[4];
  vec4 selected;
  vec4 size;   /* radius, least radius in pixels, height of the region in pixels, how much nearer in depth */
  vec4 extra;  /* how dark the back side is, whether the view is clipped */
};
"""
_VERTEX = """
void main() {
  vec4 seen = view.to_view * vec4(place, 1.0);
  float reach = length(disc);
  vec3 normal = mat3(view.to_normal) * disc;
  gl_Position = view.to_screen * seen;
  float radius = view.size.x * (reach > 0.0 ? reach : 1.0) * view.to_screen[1][1] * view.size.z / gl_Position.w;
  float drawn = max(radius, view.size.y);
  gl_PointSize = 2.0 * drawn;
  gl_Position.z -= view.size.w;
  for (int side = 0; side < 4; side++) {
    if (view.extra.y > 0.5 && dot(view.clip[side], vec4(place, 1.0)) <= 0.0) {
      gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }
  }
  turned = reach > 0.0 ? normalize(normal) : vec3(0.0, 0.0, 1.0);
  sizes = vec2(radius, drawn);
  float light = (0.35 + 0.65 * abs(turned.z)) * (turned.z < 0.0 ? 1.0 - view.extra.x : 1.0);
  tint = vec4(mix(color.rgb, view.selected.rgb, chosen) * light, 1.0);
}
"""
_FRAGMENT = """
void main() {
  vec2 at = (2.0 * gl_PointCoord - 1.0) * vec2(1.0, -1.0) * sizes.y;
  float across = dot(at, at);
  float steep = dot(turned.xy, at) / max(abs(turned.z), 1e-3);
  float dot_radius = view.size.y;
  if (across > dot_radius * dot_radius && across + steep * steep > sizes.x * sizes.x) {
    discard;
  }
  drawn_color = tint;
}
"""
_handlers = []
_kept = {}  # _Kept by session_uid of objects in Edit Mode
_shaders = []


class Look(NamedTuple):
    """How the points of an object in Edit Mode look."""

    # (n, 3) float32, in local space; discs as in the attribute, zero where they are not known
    places: np.ndarray
    discs: np.ndarray
    colors: np.ndarray  # (n, 4) float32, linear; alpha 0 hides a point


@dataclass
class _Kept:
    data: int  # session_uid of the mesh
    points: "gpu.types.GPUVertBuf | None"
    shown: np.ndarray  # (n,) bool
    batch: "gpu.types.GPUBatch | None" = None  # None after the selection has changed


def attach():
    """Add the handlers; there are no views in background mode."""
    if not bpy.app.background:
        _handlers.append(bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW"))
        add_handlers(_HANDLERS)


def detach():
    """Remove the handlers, and what they keep."""
    if _handlers:
        remove_handlers(_HANDLERS)
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")
    _kept.clear()
    _shaders.clear()


def is_drawn(obj, shading) -> bool:
    """Whether views with some shading draw the points of an object in Edit Mode: of a cloud whose display is on."""
    if not is_cloud(obj) or shading.type == "WIREFRAME" or sees_through(shading):
        return False
    display = find_display(obj)
    return display is not None and display.show_viewport and not display.show_in_editmode


def look(obj, depsgraph) -> Look | None:
    """Read how the points of an object in Edit Mode look, after its modifiers; None if these change their number."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        count = len(mesh.vertices)
        if count != len(bmesh.from_edit_mesh(obj.data).verts):
            return None
        places, hidden = np.empty((count, 3), np.float32), np.empty(count, bool)
        mesh.vertices.foreach_get("co", places.reshape(-1))
        mesh.vertices.foreach_get("hide", hidden)
        discs = read_attribute(mesh, DISC) if has_vectors(mesh, DISC) else np.zeros((count, 3), np.float32)
        colors = _colors(obj, mesh)
        _in_groups(obj, mesh, colors)
        colors[hidden, 3] = 0.0
        return Look(places, discs, colors)
    finally:
        evaluated.to_mesh_clear()


def _colors(obj, mesh):
    """Return the linear colors on show at the points of a mesh, (n, 4) float32, alpha 0 where nothing is shown."""
    colors, name = np.tile(np.float32(_PLAIN), (len(mesh.vertices), 1)), shown_attribute(obj)
    if name not in mesh.attributes:
        name = own_colors(mesh)
    if not name:
        if has_splats(mesh):
            colors[:] = splat_colors(mesh)
        return colors
    if is_color(mesh, name):
        mesh.attributes[name].data.foreach_get("color", colors.reshape(-1))
        colors[:, 3] = 1.0
        return colors
    values, settings = read_attribute(mesh, name), obj.meshfree
    shown = numbers(values, component(name, settings))
    if shown is not None:
        color_map, low, high, _ = colors_and_range(name, values, shown, settings)
        colors[:] = solid.number_colors(color_map, low, high, settings)(shown)
        if settings.outside == "HIDE":
            colors[(shown < low) | (shown > high), 3] = 0.0
    elif is_texture(values):
        odd = np.floor(CHECKS * values).sum(axis=1) % 2.0 > 0.5
        colors[:] = np.where(odd[:, None], CHECKER["Odd"], CHECKER["Even"])
    else:
        colors[:] = solid.direction_colors(values)
    return colors


def _in_groups(obj, mesh, colors):
    """Give points of groups their colors, where these are on show."""
    ranks = {
        obj.vertex_groups[name].index: color for name, color in group_colors(obj).items() if name in obj.vertex_groups
    }
    if not ranks:
        return
    palette, order = np.array([*ranks.values()]), {index: rank for rank, index in enumerate(ranks)}
    held = (
        max((order.get(item.group, -1) for item in vertex.groups if item.weight > 0.0), default=-1)
        for vertex in mesh.vertices
    )
    rank = np.fromiter(held, np.int64, count=len(colors))
    colors[rank >= 0] = palette[rank[rank >= 0]]


@persistent
def _forget(*_):
    _kept.clear()


@persistent
def on_load(*_):
    """Draw clouds of files by earlier versions here, too, which let nodes draw them in Edit Mode."""
    _kept.clear()
    for obj in [obj for obj in bpy.data.objects if is_cloud(obj) and obj.is_editable]:
        display = find_display(obj)
        if display is not None:
            display.show_in_editmode = False


@persistent
def _on_update(_scene, depsgraph):
    """Forget what has changed: the points, or their selection alone."""
    for update in depsgraph.updates if _kept else ():
        uid = update.id.original.session_uid
        for owner, kept in list(_kept.items()):
            if uid in (owner, kept.data):
                kept.batch = None
                if update.is_updated_geometry:
                    _kept.pop(owner)


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "frame_change_post": _forget,
    "undo_post": _forget,
    "redo_post": _forget,
    "load_post": on_load,
    "colors_changed": _forget,
    "shape_changed": _forget,
    "groups_changed": _forget,
    "result_written": _forget,
    "colors_found": _forget,
    "surface_found": _forget,
}


def _draw():
    context = bpy.context
    edited = [obj for obj in context.objects_in_mode or () if obj.mode == "EDIT"]
    for uid in _kept.keys() - {obj.session_uid for obj in edited}:
        del _kept[uid]
    space = context.space_data
    for obj in edited:
        if is_drawn(obj, space.shading) and obj.visible_in_viewport_get(space):
            _draw_object(context, obj)


def _draw_object(context, obj):
    kept = _kept.get(obj.session_uid)
    if kept is None:
        seen = look(obj, context.view_layer.depsgraph)  # as drawn: an update would run handlers, which write
        kept = _kept[obj.session_uid] = _keep(obj, seen)
    if not kept.shown.any():
        return
    if kept.batch is None:
        kept.batch = gpu.types.GPUBatch(type="POINTS", buf=kept.points)
        chosen = selected_now(obj)[kept.shown].astype(np.float32)
        kept.batch.vertbuf_add(_buffer({"chosen": chosen}))
    shader = _shader()
    shader.bind()
    view = gpu.types.GPUUniformBuf(_view(context, obj).tobytes())  # it must live until all is drawn
    shader.uniform_block("view", view)
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.program_point_size_set(True)
    kept.batch.draw(shader)
    gpu.state.program_point_size_set(False)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _keep(obj, seen):
    shown = np.zeros(0, bool) if seen is None else seen.colors[:, 3] > 0.0
    values = {"place": seen.places, "disc": seen.discs, "color": seen.colors} if shown.any() else {}
    points = _buffer({name: column[shown] for name, column in values.items()}) if values else None
    return _Kept(obj.data.session_uid, points, shown)


def _buffer(values):
    """Return a vertex buffer of arrays by their names, (n,) or (n, m) float32."""
    form = gpu.types.GPUVertFormat()
    for name, column in values.items():
        length = 1 if column.ndim == 1 else column.shape[1]
        form.attr_add(id=name, comp_type="F32", len=length, fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(form, len(column))
    for name, column in values.items():
        buffer.attr_fill(name, np.ascontiguousarray(column, np.float32))
    return buffer


def _view(context, obj):
    """Return what the shader needs to know of a view and an object, as in `_LAYOUT`."""
    space, region = context.region_data, context.region
    world, screen = np.array(obj.matrix_world), np.array(space.window_matrix)
    to_view = np.array(space.view_matrix) @ world
    scale = np.cbrt(abs(det(world[:3, :3])))
    to_normal = np.eye(4)
    to_normal[:3, :3] = pinv(to_view[:3, :3]).T
    clip = np.array([[*plane] for plane in space.clip_planes[:4]]) @ world
    theme = context.preferences.themes[0].view_3d
    dot = _DOT * theme.vertex_size * context.preferences.system.pixel_size / np.sqrt(2.0)
    # What Blender subtracts from the depth of its dots, so that they are seen on faces.
    nearer = 0.0019 * abs(screen[2, 3]) if space.is_perspective else 7.5e-6 * space.view_distance
    size = get_input(find_display(obj), "Radius") * scale, dot, 0.5 * region.height, _NEARER * nearer
    extra = DIM if obj.meshfree.dim_back else 0.0, float(space.use_clip_planes), 0.0, 0.0
    columns = [to_view.T, to_normal.T, screen.T, clip, [colormaps.to_linear(theme.vertex_select)], [size], [extra]]
    return np.concatenate(columns).astype(np.float32)


def _shader():
    if not _shaders:
        between = gpu.types.GPUStageInterfaceInfo("meshfree_editing")
        between.flat("VEC4", "tint")
        between.flat("VEC3", "turned")
        between.flat("VEC2", "sizes")
        info = gpu.types.GPUShaderCreateInfo()
        info.typedef_source(_LAYOUT)
        info.uniform_buf(0, "View", "view")
        for index, (kind, name) in enumerate(
            (("VEC3", "place"), ("VEC3", "disc"), ("VEC4", "color"), ("FLOAT", "chosen"))
        ):
            info.vertex_in(index, kind, name)
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "drawn_color")
        info.vertex_source(_VERTEX)
        info.fragment_source(_FRAGMENT)
        _shaders.append(gpu.shader.create_from_info(info))
    return _shaders[0]
