"""Point clouds from files, and results to files, for the command line."""

import bpy
import numpy as np

from ..core import PointCloudError, check_points
from .attributes import APPLICATIONS, MEAN_CURVATURE, PREFIX, own_positions, read_attribute
from .reading import TYPES

_TEXT = (".xyz", ".csv", ".txt")
INPUTS = (".ply", ".obj", *_TEXT, ".blend")
OUTPUTS = (".blend", ".ply", ".npz")


def load(path, name: str = ""):
    """Open a file in place of everything that is loaded, and return the object to work on.

    Parameters
    ----------
    path : pathlib.Path
        A file of one of the kinds in `INPUTS`.
    name : str
        The object's name; empty for the active one, or else the only mesh.

    Raises
    ------
    PointCloudError
        There is no such file, or no such object in it, or no points.
    """
    suffix = path.suffix.lower()
    if suffix not in INPUTS:
        raise PointCloudError(f"{path} is not a file this command reads. Give it one of {', '.join(INPUTS)}.")
    if not path.is_file():
        raise PointCloudError(f"There is no file {path}. Check its name and folder.")
    if suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
    else:
        _empty_scene()
    if suffix == ".ply":
        bpy.ops.wm.ply_import(filepath=str(path))
    elif suffix == ".obj":  # axes as in the file, all its objects as one
        bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z", use_split_objects=False)
    elif suffix in _TEXT:
        _new_object(path.stem, _read_text(path))
    return _choose_object(path, name)


def _empty_scene():
    bpy.ops.wm.read_homefile(use_empty=True)


def _read_text(path):
    """Read the first three columns: split by semicolons, with decimal commas or points, or by commas or white space."""
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    text = text.replace(",", ".").replace(";", " ") if ";" in text else text.replace(",", " ")
    lines = [line for line in text.splitlines() if line.split("#")[0].strip()]
    problem = "there are none"
    for header in range(min(2, len(lines))):
        try:
            values = np.loadtxt(lines, usecols=(0, 1, 2), ndmin=2, skiprows=header)
        except (ValueError, IndexError) as error:
            problem = str(error).rstrip(".")
        else:
            return check_points(values)
    raise PointCloudError(f"{path} does not hold columns of numbers x y z: {problem}. Correct the file.")


def _new_object(name, points):
    """Add an object with these vertices, placed at their middle: single precision is finest about the origin."""
    middle = (0.5 * (points.min(axis=0) + points.max(axis=0))).astype(np.float32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", (points - middle).astype(np.float32).reshape(-1))
    obj = bpy.data.objects.new(name, mesh)
    obj.location = middle
    bpy.context.scene.collection.objects.link(obj)


def _choose_object(path, name):
    bpy.context.view_layer.update()
    meshes = [obj for obj in bpy.context.view_layer.objects if obj.type in TYPES]
    active = bpy.context.view_layer.objects.active
    if not meshes:
        raise PointCloudError(f"{path} has no mesh object. Give a file with points.")
    if name:
        chosen = [obj for obj in meshes if obj.name == name]
    elif active in meshes:
        chosen = [active]
    else:
        chosen = meshes
    if len(chosen) != 1:
        names = ", ".join(obj.name for obj in meshes)
        asked = f'no mesh object "{name}"' if name else "no active mesh object"
        raise PointCloudError(f"{path} has {asked}. Name one of its mesh objects with --object: {names}.")
    bpy.context.view_layer.objects.active = chosen[0]
    return chosen[0]


def save(path, obj, arrays):
    """Write the result to a file of one of the kinds in `OUTPUTS`: the scene, the points, or the arrays by name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    suffix = path.suffix.lower()
    if suffix == ".npz":
        np.savez(path, **arrays)
        return
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    if suffix == ".ply":  # axes as in the object, the points without modifiers, all attributes
        bpy.ops.wm.ply_export(
            filepath=str(path),
            forward_axis="Y",
            up_axis="Z",
            export_selected_objects=True,
            apply_modifiers=False,
            export_attributes=True,
        )
    else:
        names = [name for name in (*APPLICATIONS, MEAN_CURVATURE) if name in obj.data.attributes]
        if names:
            bpy.ops.meshfree.colormap(attribute=names[0])
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()))


def analysis_arrays(obj, analysis):
    """Return all arrays, numbers in double precision: points and normals in the world, lengths and areas too."""
    laplacian, spectrum = analysis.laplacian, analysis.spectrum
    return {
        "points": laplacian.points + np.array(obj.matrix_world.translation, dtype=np.float64),
        "areas": laplacian.areas,
        "normals": laplacian.normals,
        "mean_curvature": analysis.mean_curvature,
        "gaussian_curvature": laplacian.gaussian_curvature,
        "boundary": laplacian.boundary,
        "component": laplacian.component,
        "smoothing_lengths": laplacian.smoothing_lengths,
        "eigenvalues": np.empty(0) if spectrum is None else spectrum.eigenvalues,
        "eigenvectors": np.empty((len(laplacian.areas), 0)) if spectrum is None else spectrum.eigenvectors,
    }


def attribute_arrays(obj):
    """Return the points in the world, and what this extension wrote by its names without the lb_."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    arrays = {"points": own_positions(obj.data).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]}
    for attribute in obj.data.attributes:
        if attribute.name.startswith(PREFIX):
            arrays[attribute.name.removeprefix(PREFIX)] = read_attribute(obj.data, attribute.name)
    for name, values in obj.items():
        if name.startswith(PREFIX):
            arrays[name.removeprefix(PREFIX)] = np.array(values)
    return arrays
