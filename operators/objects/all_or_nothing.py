"""Objects as they were, should anything fail while they are written: all or nothing."""

from contextlib import contextmanager

import bpy

from .modifiers import inputs_of, is_own, put_inputs


@contextmanager
def all_or_nothing(objects):
    """Put objects, with their data, back to how they were if what is done with them fails, whatever it fails with.

    Their data are copied before: cheap, for Blender copies the values of points only when one of both is written. So
    are the actions of shape keys, and the materials that our own modifiers show. After a failure the copies take their
    places. What was added since, such as objects, materials and modifiers, is removed, and objects are selected and
    active as before; modifiers that were removed stay so.
    """
    render, layer = bpy.context.scene.render, bpy.context.view_layer
    locked, active = render.use_lock_interface, getattr(layer.objects.active, "name", "")
    selected = [obj.name for obj in layer.objects.selected]
    kept = {}  # of objects that share their data one copy
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
                obj.select_set(obj.name in selected)
            raise
    finally:
        _remove(kept.values())


def _written(obj):
    """Data-blocks that are changed when results are written to an object, the object itself apart."""
    blocks = [obj.data]
    keys = getattr(obj.data, "shape_keys", None)
    if keys is not None and keys.animation_data is not None:
        blocks.append(keys.animation_data.action)
    for item in filter(is_own, obj.modifiers):
        blocks += [value for value in inputs_of(item).values() if isinstance(value, bpy.types.Material)]
    return [block for block in blocks if block is not None]


class _State:
    """What an object holds beside its data: where it is, which data and modifiers, custom properties, settings."""

    def __init__(self, obj):
        self._obj, self._data = obj, obj.data
        self._place = obj.matrix_basis.copy()
        self._modifiers = {item.name: inputs_of(item) if is_own(item) else {} for item in obj.modifiers}
        self._own = {name: _plain(obj[name]) for name in _own_names(obj)}
        self._settings = _values(obj.meshfree)
        self._key = obj.active_shape_key_index

    def put_back(self):
        obj = self._obj
        if obj.data != self._data:
            obj.data = self._data
        if obj.matrix_basis != self._place:
            obj.matrix_basis = self._place
        for item in [item for item in obj.modifiers if item.name not in self._modifiers]:
            obj.modifiers.remove(item)
        _put_values(obj.meshfree, self._settings)  # before inputs, which follow settings
        there = [name for name in self._modifiers if name in obj.modifiers]
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
    """Names of the custom properties of an object, without what extensions define, which old files keep there too."""
    return [name for name in obj.keys() if name not in obj.bl_rna.properties]


def _plain(value):
    """Return the value of a custom property as one that outlives it and can be compared."""
    for way in ("to_list", "to_dict"):
        if hasattr(value, way):
            return getattr(value, way)()
    return value


def _values(group):
    """Read all values of a property group, of the groups in it, and of those in collections."""
    values = {}
    for item in group.bl_rna.properties:
        if item.identifier == "rna_type":  # which tells of the group itself
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
    """Set what differs: every setting may have somebody who follows it."""
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
    """Let a copy of data take their place and their names."""
    pairs = [(copy, data.name)]
    if getattr(copy, "shape_keys", None) is not None:  # data may have got their first ones since
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
