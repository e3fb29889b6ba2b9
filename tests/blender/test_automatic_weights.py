"""Automatic Weights: what is left on objects, beside what Blender's own leaves, and what happens to odd ones."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.armatures import add_armature, choose, weights_of
from tests.blender.clouds import add_object, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused

BONES = {"lower": ((0.0, 0.0, -2.5), (0.0, 0.0, 0.0)), "upper": ((0.0, 0.0, 0.0), (0.0, 0.0, 2.5))}


def rod(faces=True):
    """A closed cylinder of height 6, by its vertices and faces."""
    around, rings = 16, np.linspace(-3.0, 3.0, 25)
    angle = 2.0 * np.pi * np.arange(around) / around
    points = np.concatenate([np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), 0 * angle + z]) for z in rings])
    points = np.vstack([points, [0, 0, -3.0], [0, 0, 3.0]])
    first, last = np.arange(around), len(points) - 2 - around + np.arange(around)
    quads = [
        (row * around + a, row * around + b, (row + 1) * around + b, (row + 1) * around + a)
        for row in range(len(rings) - 1)
        for a, b in zip(range(around), np.roll(np.arange(around), -1).tolist(), strict=True)
    ]
    ends = [(len(points) - 2, b, a) for a, b in zip(first.tolist(), np.roll(first, -1).tolist(), strict=True)]
    ends += [(len(points) - 1, a, b) for a, b in zip(last.tolist(), np.roll(last, -1).tolist(), strict=True)]
    return add_object(points, "Rod", quads + ends if faces else ())


def rigged(make=rod, **settings):
    obj, armature = make(), add_armature(BONES)
    choose(armature, obj)
    assert bpy.ops.meshfree.auto_weights(**settings) == {"FINISHED"}
    return obj, armature


def left_on(obj):
    """What a rigged object is like beside its weights."""
    return {
        "groups": [(group.name, group.lock_weight) for group in obj.vertex_groups],
        "active": obj.vertex_groups.active.name,
        "modifiers": [
            (
                item.name,
                {
                    each.identifier: getattr(item, each.identifier)
                    for each in item.bl_rna.properties
                    if each.type in {"BOOLEAN", "STRING", "INT"}
                },
            )
            for item in obj.modifiers
        ],
        "follows": [item.object for item in obj.modifiers if item.type == "ARMATURE"],
        "parent": (obj.parent, obj.parent_type),
        "selected": (obj.select_get(), obj.parent.select_get(), bpy.context.object),
    }


def test_it_leaves_what_blender_leaves():
    found = []
    for own in (True, False):
        obj, armature = rod(), add_armature({**BONES, "aside": ((0.0, 0.2, 0.0), (0.0, 0.2, 0.1))})
        armature.data.bones["aside"].use_deform = False
        obj.location, obj.scale, obj.rotation_euler = (1.0, 2.0, 3.0), (0.5, 0.6, 0.7), (0.2, 0.3, 0.4)
        armature.location, armature.scale, armature.rotation_euler = obj.location, (0.5, 0.5, 0.5), obj.rotation_euler
        obj.vertex_groups.new(name="Other")
        obj.vertex_groups.new(name="upper").add([0, 1], 0.5, "REPLACE")
        obj.modifiers.new("Subdivision", "SUBSURF")
        bpy.context.view_layer.update()
        choose(armature, obj)
        before = obj.matrix_world.copy(), obj.matrix_basis.copy()
        if own:
            bpy.ops.meshfree.auto_weights(least=0.0)
        else:
            bpy.ops.object.parent_set(type="ARMATURE_AUTO")
        bpy.context.view_layer.update()
        assert_allclose(obj.matrix_world, before[0], atol=1e-6)
        assert obj.matrix_basis == before[1]
        left = left_on(obj)
        assert left.pop("follows") == [armature]
        parent, kind = left.pop("parent")
        assert (parent, kind) == (armature, "OBJECT")
        assert left.pop("selected") == (True, True, armature)
        found.append((left, weights_of(obj), np.array(obj.matrix_parent_inverse)))
    (ours, weights, inverse), (blenders, its_weights, its_inverse) = found
    assert ours == blenders
    assert_allclose(inverse, its_inverse, atol=1e-6)
    assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert np.abs(weights - its_weights).mean() < 0.02
