"""The group that names the rim of a surface: its members, and what tells whether they have changed."""

import zlib
from time import perf_counter

from ..core.rims import FEWEST
from .attributes import point_count
from .groups import chosen_members, group_weights, has_group

_PATIENCE = 30.0  # a glance trusts what was read for this many times the seconds that reading took
_glance = {"key": None, "checksum": 0, "until": 0.0}


def rim_points(obj):
    """Read which points the rim group of an object holds.

    Returns
    -------
    ndarray, (n,) bool, or None
        None if the settings name no group.

    Raises
    ------
    PointCloudError
        There is no such group, or too little in it.
    """
    name = obj.meshfree.rim_group
    return chosen_members(obj, name, "Rim Group", FEWEST) if name else None


def rim_checksum(obj, glance=False) -> int:
    """Checksum of the members of the rim group; 0 if no group is named or there is none of that name.

    To read them takes Blender 80 ms for 100,000 points, too much for a panel: a glance may miss a change for some
    seconds.
    """
    name = obj.meshfree.rim_group
    if not has_group(obj, name):
        return 0
    key = (obj.session_uid, name, point_count(obj.data))
    if not glance or _glance["key"] != key or perf_counter() > _glance["until"]:
        began = perf_counter()
        checksum = zlib.crc32(group_weights(obj, name) > 0.0)
        now = perf_counter()
        _glance.update(key=key, checksum=checksum, until=now + _PATIENCE * (now - began))
    return _glance["checksum"]
