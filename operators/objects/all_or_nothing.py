"""Restore objects if anything fails while they are written."""

from contextlib import contextmanager

import bpy

from .modifiers import inputs_of, is_own, put_inputs

_OF_PARENT = "parent", "parent_type", "parent_bone"  # in the order in which they can be set
_FLAGS = "show_viewport", "show_render", "show_in_editmode", "show_on_cage", "show_expanded"  # of modifiers


@contextmanager
def all_or_nothing(objects):
    """Restore objects, with their data, if the body of the with statement raises anything.

    Their data are copied before, which is cheap: Blender copies the values of points only on write. So are the actions
    of shape keys, and the materials of our own modifiers. After a failure the copies replace them. Objects, materials,
    modifiers and so on that were added since are removed, and objects are visible, selected and active as before;
    of removed modifiers only our own are restored.
    """
    render, layer = bpy.context.scene.render, bpy.context.view_layer
    locked, active = render.use_lock_interface, getattr(layer.objects.active, "name", "")
    seen = {obj.name: (obj.hide_get(), obj.hide_render, obj.select_get()) for obj in layer.objects}
    kept = {}  # one copy for objects that share their data
    try:
        for block in dict.fromkeys(block for obj in objects for block in _written(obj)):
            kept[block] = _copy(block)
        states, there = [_State(obj) for obj in objects], set(bpy.data.user_map())
        try:
            yield
        except BaseException:
            render.use_lock_interface = locked
            for state in states:
                state.put_back()
            for block in list(kept):
                _replace(block, kept.pop(block))
            _remove(set(bpy.data.user_map()) - there)
            layer.objects.active = layer.objects.get(active)
            for obj in layer.objects:
                hidden, obj.hide_render, selected = seen.get(obj.name, (False, False, False))
                obj.hide_set(hidden)
                obj.select_set(selected)
            raise
    finally:
        _remove(kept.values())


def _written(obj):
    """Return the data-blocks that writing results to an object changes, without the object itself."""
    blocks = [obj.data]
    keys = getattr(obj.data, "shape_keys", None)
    if keys is not None and keys.animation_data is not None:
        blocks.append(keys.animation_data.action)
    for item in filter(is_own, obj.modifiers):
        blocks += [value for value in inputs_of(item).values() if isinstance(value, bpy.types.Material)]
    return [block for block in blocks if block is not None]


class _State:
    """The state of an object beside its data: place, parent, data-block, modifiers, custom properties, settings."""

    def __init__(self, obj):
        self._obj, self._data = obj, obj.data
        self._place, self._world = obj.matrix_basis.copy(), obj.matrix_world.copy()
        self._parent = {name: getattr(obj, name) for name in _OF_PARENT}
        self._inverse = obj.matrix_parent_inverse.copy()
        self._modifiers = {item.name: inputs_of(item) if is_own(item) else {} for item in obj.modifiers}
        self._groups = {item.name: item.node_group for item in obj.modifiers if is_own(item)}
        self._flags = {name: {flag: getattr(obj.modifiers[name], flag) for flag in _FLAGS} for name in self._groups}
        self._own = {name: _plain(obj[name]) for name in _own_names(obj)}
        self._settings = _values(obj.meshfree)
        self._key = obj.active_shape_key_index

    def put_back(self):
        obj = self._obj
        if obj.data != self._data:
            obj.data = self._data
        if any(getattr(obj, name) != value for name, value in self._parent.items()):
            for name, value in self._parent.items():
                setattr(obj, name, value)
        if obj.matrix_parent_inverse != self._inverse:
            obj.matrix_parent_inverse = self._inverse
        if obj.matrix_basis != self._place:
            obj.matrix_world = self._world  # which the other leaves as it is until the next update
            obj.matrix_basis = self._place
        for item in [item for item in obj.modifiers if item.name not in self._modifiers]:
            obj.modifiers.remove(item)
        for name in self._groups.keys() - {item.name for item in obj.modifiers}:
            again = obj.modifiers.new(name, "NODES")
            again.node_group = self._groups[name]
            for flag, value in self._flags[name].items():
                setattr(again, flag, value)
        for _ in range(2):  # again, for update functions of some may change others
            _put_values(obj.meshfree, self._settings)  # before inputs, which follow settings
        there = [name for name in self._modifiers if name in obj.modifiers]
        for name in self._groups.keys() & set(there):
            if obj.modifiers[name].node_group != self._groups[name]:
                obj.modifiers[name].node_group = self._groups[name]
        for index, name in enumerate(there):
            put_inputs(obj.modifiers[name], self._modifiers[name])
            obj.modifiers.move(obj.modifiers.find(name), index)
        for name in _own_names(obj):
            if name not in self._own:
                del obj[name]
        for name, value in self._own.items():
            if name not in obj or _plain(obj[name]) != value:
                obj[name] = value
        obj.active_shape_key_index = self._key


def _own_names(obj):
    """Names of the custom properties of an object, without properties of extensions, which old files keep there too."""
    return [name for name in obj.keys() if name not in obj.bl_rna.properties]


def _plain(value):
    """Return the value of a custom property as one that outlives it and can be compared."""
    for method in ("to_list", "to_dict"):
        if hasattr(value, method):
            return getattr(value, method)()
    return value


def _values(group):
    """Read all values of a property group, of the groups in it, and of those in collections."""
    values = {}
    for item in group.bl_rna.properties:
        if item.identifier == "rna_type":  # the type of the group
            continue
        value = getattr(group, item.identifier)
        if item.type == "COLLECTION":
            value = [_values(member) for member in value]
        elif isinstance(value, bpy.types.PropertyGroup):
            value = _values(value)
        elif item.is_readonly:
            continue
        elif getattr(item, "is_array", False):
            value = tuple(value)
        values[item.identifier] = value
    return values


def _put_values(group, values):
    """Set only what differs, since settings have update functions."""
    now = _values(group)
    for name, value in values.items():
        if now[name] == value:
            continue
        if isinstance(value, dict):
            _put_values(getattr(group, name), value)
        elif isinstance(value, list):
            members = getattr(group, name)
            members.clear()
            for each in value:
                _put_values(members.add(), each)
        else:
            setattr(group, name, value)


def _copy(data):
    copy = data.copy()
    copy.use_fake_user = data.use_fake_user
    return copy


def _replace(data, copy):
    """Replace data by a copy, under the same names."""
    pairs = [(copy, data.name)]
    if getattr(copy, "shape_keys", None) is not None:  # data may have gained their first ones since
        pairs.append((copy.shape_keys, data.shape_keys.name))
    data.user_remap(copy)
    bpy.data.batch_remove([data])
    for block, name in pairs:
        block.name = name


def _remove(blocks):
    """Remove data-blocks from the file."""
    blocks = list(blocks)
    if blocks:
        bpy.data.batch_remove(blocks)
