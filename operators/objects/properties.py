"""Properties of Blender for the settings that `tools/` declares."""

from types import SimpleNamespace

from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

_FORMS = {
    "LENGTH": {"subtype": "DISTANCE"},
    "AREA": {"unit": "AREA"},
    "DEGREES": {"subtype": "ANGLE"},
    "SHARE": {"subtype": "FACTOR"},
    "X,Y,Z": {"subtype": "XYZ"},
}
_KINDS = {bool: BoolProperty, int: IntProperty, float: FloatProperty, str: StringProperty, tuple: FloatVectorProperty}
_SMALL, _DIGITS = 0.01, {"precision": 6}  # defaults of which the usual three digits show little


def property_of(setting, **more):
    """Return the property of Blender for a setting, with more that it takes."""
    if setting.choices:
        items = list(map(tuple, setting.choices))  # Blender takes no named tuples
        return EnumProperty(name=setting.title, description=setting.description, default=setting.default, items=items)
    bounds = {"min": setting.least, "max": setting.most, "soft_min": setting.low, "soft_max": setting.high}
    kind = type(setting.default)
    return _KINDS[kind](
        name=setting.title,
        description=setting.description,
        default=setting.default,
        **{name: bound for name, bound in bounds.items() if bound is not None},
        **_FORMS.get(setting.form, {}),
        **(_DIGITS if kind is float and 0.0 < setting.default < _SMALL else {}),
        **more,
    )


def properties_of(settings):
    """Return the properties of settings, as annotations of a class."""
    return {setting.name: property_of(setting) for setting in settings}


def with_properties(settings):
    """Return a class with these properties, to inherit from."""
    return type("Properties", (), {"__annotations__": properties_of(settings)})


def values_of(holder, settings):
    """Return the values of settings, properties of a holder, as attributes."""
    return SimpleNamespace(**{setting.name: getattr(holder, setting.name) for setting in settings})
