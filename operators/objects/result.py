"""Writing an analysis to an object: attributes, eigenvalues, total area, and whether they are up to date."""

import zlib

import bpy
import numpy as np

from ...core import PointCloudError
from ...tools.quantities import AREA, EIGENVALUES, EIGENVECTOR, NORMAL, RESULTS, eigenvector_name, quantity
from .attributes import (
    ORIENTATION,
    check_names,
    check_size,
    point_count,
    remove_numbered,
    tag_changed,
    write_attribute,
)
from .options import point_budget, settings_values
from .reading import chosen_sides, fingerprint, metric, sharing_objects

_DIGITS = 3  # that scans justify


def check_writable(obj, names, make_single_user: bool, among=()):
    """Refuse an object to which attributes of these names cannot be written, before anything is computed.

    It may get a mesh of its own. Objects that share the mesh may be `among` those that are processed too: of the same
    scale, or to get their own mesh.
    """
    others = [
        other.name
        for other in sharing_objects(obj)
        if other not in among or not (other.meshfree.make_single_user or same_lengths(metric(other), metric(obj)))
    ]
    if others and not make_single_user:
        shown = ", ".join(f'"{name}"' for name in others[:3]) + (", ..." if len(others) > 3 else "")
        raise PointCloudError(
            f'"{obj.name}" shares its mesh with {shown}. Turn on Make Single User to give it a mesh of its own.'
        )
    check_names(obj, names)


def analysis_names(modes: int) -> list:
    """Return the attributes of an analysis with a number of modes."""
    return [*RESULTS, *map(eigenvector_name, range(1, modes + 1))]


def write_numbers(obj, numbers):
    """Keep numbers that are not at the points on an object, by name."""
    for name, values in numbers.items():
        # As a list: Blender writes an array into the memory of the one before, whatever the length of that.
        obj[name] = values.tolist()


def write_values(data, local):
    """Write results at the points in local space, by the names of attributes; numbered ones in place of all others."""
    prefixes = [quantity(name).attribute for name in local if quantity(name).numbered]
    for prefix in dict.fromkeys(prefixes):
        remove_numbered(data, prefix, beyond=prefixes.count(prefix))
    for name, values in local.items():
        write_attribute(data, name, values)


def write_result(obj, analysis, write_limit: int, oriented=False):
    """Write an analysis to its object and those that share its mesh; modes up to `write_limit` become attributes.

    If `oriented`, later analyses take the side of its normals.
    """
    mesh, owners = obj.data, [obj, *sharing_objects(obj)]
    if analysis.spectrum is not None:
        vectors = analysis.spectrum.eigenvectors[:, :write_limit]
        remove_numbered(mesh, EIGENVECTOR, beyond=vectors.shape[1])
        for index, vector in enumerate(vectors.T):
            write_attribute(mesh, eigenvector_name(index + 1), vector)
        for owner in owners:
            write_numbers(owner, {EIGENVALUES: analysis.spectrum.eigenvalues})
    elif is_stale(obj):
        remove_numbered(mesh, EIGENVECTOR, beyond=0)
        for owner in owners:
            owner.pop(EIGENVALUES, None)
    if oriented:
        write_attribute(mesh, ORIENTATION, analysis.local_normals)
    for name, values in {**analysis.measures, NORMAL: analysis.local_normals}.items():
        write_attribute(mesh, name, values)
    check_size(f"{AREA}, summed up,", analysis.total_area)
    for owner in owners:
        _note_analysis(owner, analysis, _settings(obj))
    tag_changed(mesh)


def _settings(obj):
    """Return a text of what results depend on besides points; the budget only where it is below their number."""
    kept = obj.meshfree
    budget = point_budget(kept)
    sides = chosen_sides(obj)
    return (
        repr(settings_values(kept))
        + (f" {budget}" if budget and budget < point_count(obj.data) else "")
        + ("" if sides is None else f" {zlib.crc32(sides):08x}")
        + ("" if kept.leave_out_floaters else " floaters")
    )


def _note_analysis(obj, analysis, settings):
    """Keep the figures of an analysis on an object, with its settings as text."""
    kept = obj.meshfree
    kept.total_area, kept.trusted_area = analysis.total_area, analysis.trusted_area
    kept.point_count = point_count(obj.data)
    kept.subset_count = analysis.subset_count
    for name, count in analysis.counts.items():
        setattr(kept, name, count)
    note_stages(obj, analysis.seconds)
    kept.fingerprint = fingerprint(obj)
    kept.metric = metric(obj).reshape(-1)
    kept.settings_used = settings


def note_stages(obj, times):
    """Keep the seconds of the stages of an analysis on an object."""
    stages = obj.meshfree.stages
    stages.clear()
    for name, seconds in times.items():
        stage = stages.add()
        stage.name, stage.seconds = name, seconds


def trusted_text(result) -> str:
    """Write the area that can be trusted of a result, or of the settings of an object; empty where it reads as all."""
    text = area_text(result.trusted_area)
    return "" if text == area_text(result.total_area) else text


def read_eigenvalues(obj):
    """Return the eigenvalues of an object, (k,) float64; empty if the property holds something else."""
    kept = obj.get(EIGENVALUES)
    return np.array(kept if hasattr(kept, "to_list") else (), dtype=np.float64)


def is_analyzed(obj) -> bool:
    """Whether the object holds results, stale or not."""
    return obj.meshfree.fingerprint != ""


def is_stale(obj, glance=False) -> bool:
    """Whether points, scale or settings have changed since the analysis, or the object never had one.

    A glance is quick enough for a panel; see `fingerprint`.
    """
    kept = obj.meshfree
    known = fingerprint(obj, glance)
    if (known and kept.fingerprint != known) or kept.settings_used != _settings(obj):
        return True
    if kept.subset_count and point_budget(kept) is None:
        return True
    return not same_lengths(np.reshape(kept.metric, (3, 3)), metric(obj))


def same_lengths(before, now) -> bool:
    """Whether two metrics give the same lengths."""
    return np.allclose(before, now, rtol=0.0, atol=1e-5 * np.abs(now).max())


def length_text(size: float, power: int = 1) -> str:
    """Write a length in the units of the scene; with a power of 2 an area, with 3 a volume."""
    return length_writer()(size, power)


def length_writer():
    """Return `length_text` in the units that the scene has now, for threads, which must not read them."""
    units = bpy.context.scene.unit_settings
    system, scale = units.system, units.scale_length

    def write(size, power=1):
        kind = ("LENGTH", "AREA", "VOLUME")[power - 1]
        return bpy.utils.units.to_string(system, kind, size * scale**power, precision=_DIGITS).strip()

    return write


def area_text(area: float) -> str:
    """Write an area in the units of the scene."""
    return length_text(area, 2)


def volume_text(volume: float) -> str:
    """Write a volume in the units of the scene."""
    return length_text(volume, 3)
