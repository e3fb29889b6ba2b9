"""Objects as they were, should anything fail while they are written: all or nothing."""

from contextlib import contextmanager

import bpy


@contextmanager
def all_or_nothing(objects):
    """Put objects, with their data, back to how they were if what is done with them fails, whatever it fails with.

    Their data are copied before: cheap, for Blender copies the values of points only when one of both is written. After
    a failure the copy takes the place of the data. What was added since, such as objects, materials and modifiers, is
    removed; modifiers that were removed stay so.
    """
    kept = {}  # of objects that share their data one copy
    try:
        for obj in objects:
            if obj.data not in kept:
                kept[obj.data] = _copy(obj.data)
        states, there = [_State(obj) for obj in objects], set(bpy.data.user_map())
        try:
            yield
        except BaseException:
            for state in states:
                state.put_back()
            for data in list(kept):
                _replace(data, kept.pop(data))
            _remove(set(bpy.data.user_map()) - there)
            raise
    finally:
        _remove(kept.values())


class _State:
    """What an object holds beside its data: which data and modifiers, custom properties, settings and results."""

    def __init__(self, obj):
        self._obj, self._data = obj, obj.data
        self._modifiers = [item.name for item in obj.modifiers]
        self._own = {name: _plain(obj[name]) for name in _own_names(obj)}
        self._settings = _values(obj.meshfree)
        self._key = obj.active_shape_key_index

    def put_back(self):
        obj = self._obj
        if obj.data != self._data:
            obj.data = self._data
        for item in [item for item in obj.modifiers if item.name not in self._modifiers]:
            obj.modifiers.remove(item)
        for name in _own_names(obj):
            if name not in self._own:
                del obj[name]
        for name, value in self._own.items():
            if name not in obj or _plain(obj[name]) != value:
                obj[name] = value
        _put_values(obj.meshfree, self._settings)
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
    if getattr(data, "shape_keys", None) is not None:
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
