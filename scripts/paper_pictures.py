"""Pictures of the paper's Figures 9, 10, 11, 15 and 16, rendered by pictures.py; 12 and 13 are in scan_pictures.py.

What needs scipy is imported where it is used: Blender's Python has it once the extension is enabled.
"""

import sys

import bpy
import numpy as np

import demo
import package
import studio
from coral import spread_directions

sys.path.append(str(package.ROOT))  # for the clouds of the benchmarks

SPHERE = 8000
CORAL = 16_000  # as many as the paper's Bimba has


def harmonics():
    """Find Y_3^0 and Y_5^4 among the modes of a sphere.

    The 2 m + 1 modes of degree m are any basis of their space, so the harmonics are put together from them.

    Returns
    -------
    laplacian : LaplaceBeltrami
    pairs : list of (found, exact)
        Values up to one factor, (n,) each.
    """
    points = spread_directions(SPHERE)
    x, y, z = points.T
    laplacian = studio.part("core").build_laplacian(points)
    modes = laplacian.eigenpairs(36).eigenvectors
    pairs = []
    for degree, exact in ((3, 5.0 * z**3 - 3.0 * z), (5, z * ((x + 1j * y) ** 4).real)):
        space = modes[:, degree**2 : (degree + 1) ** 2]
        pairs.append((space @ (space.T @ (laplacian.areas * exact)), exact))
    return laplacian, pairs


def colored_sphere(laplacian, values, amplitude=0.0):
    """Add a sphere that shows values, displaced by them."""
    points = studio.part("core").clean.displace_by_mode(laplacian, values, amplitude) if amplitude else laplacian.points
    obj = studio.make_object(points, "Sphere")
    studio.part("operators.objects.attributes").write_attribute(obj.data, "Mode", values / np.abs(values).max())
    studio.show(obj, "Mode")
    return obj


def figure09(path):
    """Spherical harmonics: found, as a displacement, and exact."""
    laplacian, pairs = harmonics()
    rows = [
        [
            colored_sphere(laplacian, found),
            colored_sphere(laplacian, found, amplitude=0.4),
            colored_sphere(laplacian, exact),
        ]
        for found, exact in pairs
    ]
    studio.grid(rows, path, size=(760, 500))


def domains(points, mode, like=None, radius=0.0, **settings):
    """Add an object that shows the nodal domains of a mode, analyzed with these settings.

    Each has the color of its match on an earlier object, or else they are numbered in the order of the points.
    """
    from benchmarks.labels import matched

    attributes = studio.part("operators.objects.attributes")
    obj = studio.make_object(points, "Domains")
    for name, value in settings.items():
        setattr(obj.meshfree, name, value)
    bpy.ops.meshfree.segment(method="NODAL", mode=mode)
    labels = attributes.read_attribute(obj.data, "lb_segment")
    if like is None:
        labels = np.argsort(np.unique(labels, return_index=True)[1]).argsort()[labels]
    else:
        labels = matched(labels, attributes.read_attribute(like.data, "lb_segment"))
    attributes.write_attribute(obj.data, "lb_segment", labels)
    obj.meshfree.color_map = "CATEGORICAL"
    studio.show(obj, "lb_segment", radius)
    return obj


def figure10(path):
    """Nodal domains of modes 2, 4 and 10 on a plane and on two parabolic cylinders."""
    from benchmarks.samplings import parabolic_cylinder

    # By dots: discs that are seen from behind, as the inside of these, stick out of each other.
    radius = studio.TOUCHING
    rows = [[domains(parabolic_cylinder(0.0), mode, radius=radius) for mode in (2, 4, 10)]]
    for bend in (0.5, 1.0):
        points = parabolic_cylinder(bend)
        rows.append([domains(points, mode, like, radius) for mode, like in zip((2, 4, 10), rows[0], strict=True)])
    studio.grid(rows, path, view=(0.3, -1.0, 0.8), size=(760, 500))


def figure11(path):
    """Nodal domains of mode 6 on a trimmed star, without noise and with 3 % of its root mean square radius."""
    from benchmarks.samplings import trimmed_star

    points = trimmed_star()
    around = np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
    noisy = points + 0.03 * around * np.random.default_rng(0).standard_normal(points.shape)  # as in the benchmark
    upright = [0, 2, 1]
    clean = domains(points[:, upright], 6, radius=studio.TOUCHING)  # by dots: so noisy discs stick out
    studio.grid(
        [[clean, domains(noisy[:, upright], 6, clean, studio.TOUCHING)]], path, view=(0.3, -1.0, 0.4), size=(760, 360)
    )


def figure15(path):
    """A harmonic field, and modes around it, with the same area for every point."""
    points = demo.Coral().sample(CORAL)
    objects = []
    for mode in (3, 6, None, 10, 20):
        obj = studio.make_object(points, "Coral")
        obj.meshfree.areas = "UNIFORM"
        if mode is None:
            studio.harmonic_field(obj, low=(-1.0, 0.0, 0.0), high=(1.0, -1.0, 0.0))
            studio.show(obj, "lb_field")
        else:
            bpy.ops.meshfree.spectrum(count=20, show=False)
            studio.show(obj, f"lb_eigenvector_{mode:03}")
        objects.append(obj)
    studio.grid([objects], path, size=(1000, 230))


def figure16(path):
    """The second mode divides a bent sausage wrongly and rightly: close sheets taken as one, and kept apart."""
    from benchmarks.samplings import sausage

    points = sausage(bent=True)[0][:, [0, 2, 1]]
    rows = [[domains(points, 2, sheets=sheets)] for sheets in (False, True)]
    studio.grid(rows, path, view=(0.0, -1.0, 0.2), size=(640, 440), gap=0.25)


PICTURES = {
    "figure09": figure09,
    "figure10": figure10,
    "figure11": figure11,
    "figure15": figure15,
    "figure16": figure16,
}
