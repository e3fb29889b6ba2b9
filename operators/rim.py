"""The vertex group that names the rim of a surface: its members, and what tells whether they have changed."""

import zlib
from time import perf_counter

import numpy as np

from ..core import PointCloudError
from ..core.rims import FEWEST

_PATIENCE = 30.0  # a glance trusts what was read for this many times the seconds that reading took
_glance = {"key": None, "checksum": 0, "until": 0.0}


def rim_points(obj):
    """Read which vertices the rim group of an object holds.

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
    if not name:
        return None
    if name not in obj.vertex_groups:
        raise PointCloudError(
            f'"{obj.name}" has no vertex group named "{name}". Choose another Rim Group, or clear it.'
        )
    members = _members(obj, name)
    count = np.count_nonzero(members)
    if count < FEWEST:
        raise PointCloudError(
            f'The vertex group "{name}" gives {count} of {len(members)} points a weight above zero, and a rim takes at'
            f" least {FEWEST}. Assign the points of the rim to it in Edit Mode, or clear Rim Group."
        )
    return members


def rim_checksum(obj, glance=False) -> int:
    """Checksum of the members of the rim group; 0 if no group is named or there is none of that name.

    To read them takes Blender 80 ms for 100,000 points, too much for a panel: a glance may miss a change for some
    seconds.
    """
    name = obj.meshfree.rim_group
    if name not in obj.vertex_groups:
        return 0
    key = (obj.session_uid, name, len(obj.data.vertices))
    if not glance or _glance["key"] != key or perf_counter() > _glance["until"]:
        began = perf_counter()
        checksum = zlib.crc32(_members(obj, name))
        now = perf_counter()
        _glance.update(key=key, checksum=checksum, until=now + _PATIENCE * (now - began))
    return _glance["checksum"]


def _members(obj, name):
    """Whether each vertex is in a group with a weight above zero, (n,) bool."""
    index = obj.vertex_groups[name].index
    held = (any(item.group == index and item.weight > 0.0 for item in vertex.groups) for vertex in obj.data.vertices)
    return np.fromiter(held, bool, count=len(obj.data.vertices))
