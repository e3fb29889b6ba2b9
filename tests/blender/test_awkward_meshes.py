"""Automatic Weights on kinds of meshes of which Blender's own heat often finds no solution: all points are weighted."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests.blender.armatures import add_armature, choose, weights_of
from tests.blender.clouds import add_object
from tests.blender.test_automatic_weights import BONES, rod


def joined(*objects):
    choose(objects[0], *objects)
    bpy.ops.object.join()
    return bpy.context.object


def moved(*shift):
    obj = rod()
    obj.data.transform(Matrix.Translation(shift))
    return obj


def rebuilt(change):
    """The rod with other vertices or faces, which a function of both gives."""
    obj = rod()
    points, faces = [tuple(v.co) for v in obj.data.vertices], [tuple(face.vertices) for face in obj.data.polygons]
    bpy.data.objects.remove(obj)
    return add_object(*change(points, faces))


def doubles(points, faces):
    """Each face has corners of its own."""
    corners = [points[corner] for face in faces for corner in face]
    ends = np.cumsum([len(face) for face in faces])
    return corners, "Rod", [tuple(range(end - len(face), end)) for face, end in zip(faces, ends, strict=True)]


def flat_faces(points, faces):
    """Faces of no area between vertices of an edge, and of vertices at one place."""
    count = len(points)
    middle = tuple(np.mean([points[0], points[1]], axis=0))
    return [*points, middle, points[5]], "Rod", [*faces, (0, 1, count), (5, 6, count + 1)]


def inner_faces(points, faces):
    """Walls across the inside, as joined parts leave them."""
    rings = [tuple(range(ring * 16, ring * 16 + 16)) for ring in (4, 12, 20)]
    return points, "Rod", [*faces, *rings]


def shell(points, faces):
    """A half of the side, with the ends open."""
    kept = [face for face in faces if all(points[corner][1] >= -1e-6 and corner < 400 for corner in face)]
    used = sorted({corner for face in kept for corner in face})
    return [points[corner] for corner in used], "Rod", [tuple(map(used.index, face)) for face in kept]


def fins(points, faces):
    """Edges of three faces: fins that stand on the side."""
    lines = [(row * 16, row * 16 + 16) for row in range(4, 20)]
    tips = [(points[low][0] + 0.3, 0.0, points[low][2]) for low, _ in lines]
    extra = [(*line, len(points) + number) for number, line in enumerate(lines)]
    return [*points, *tips], "Rod", [*faces, *extra]


def small():
    obj = rod()
    obj.data.transform(Matrix.Diagonal((100.0, 100.0, 100.0, 1.0)))
    obj.scale = (0.01, 0.01, 0.01)
    return obj


def flipped():
    obj = rod()
    obj.data.flip_normals()
    return obj


KINDS = {
    "loose parts": lambda: joined(rod(), moved(2.5, 0.0, 0.0), moved(0.0, 2.5, 0.0)),
    "faces of zero area": lambda: rebuilt(flat_faces),
    "doubles": lambda: rebuilt(doubles),
    "inner faces": lambda: rebuilt(inner_faces),
    "one-sided shell": lambda: rebuilt(shell),
    "scale 0.01": small,
    "vertices only": lambda: rod(faces=False),
    "edges of three faces": lambda: rebuilt(fins),
    "flipped normals": flipped,
    "intersecting parts": lambda: joined(rod(), moved(0.4, 0.0, 0.3)),
}


@pytest.mark.any_blender
@pytest.mark.parametrize("kind", KINDS)
def test_all_points_are_weighted(kind):
    obj = KINDS[kind]()
    armature = add_armature(BONES)
    choose(armature, obj)
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    weights = weights_of(obj)
    height = np.array([(obj.matrix_world @ vertex.co).z for vertex in obj.data.vertices])
    assert weights.sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    for bone, side in ((1, height), (0, -height)):
        rows = side > 1.5  # in surfaces within each other, single points may look elsewhere
        assert np.mean(weights[rows, bone] > 0.9) > 0.98
