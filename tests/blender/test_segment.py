"""Parts as an attribute, vertex groups and objects; signatures at several scales."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, attribute, local_points, result_names, sphere_points
from tests.blender.operators import refused
from tests.blender.test_smooth import key_points


@pytest.fixture
def dumbbell():
    """Add two balls joined by a bar, all of one surface."""
    points = sphere_points(2500)
    along = points[:, 0]
    return add_object(points * np.column_stack([3.0 + 0 * along, *[0.35 + 0.9 * along**2] * 2]))


def test_two_parts_are_the_two_balls(dumbbell):
    bpy.ops.meshfree.segment(parts=2)
    labels, x = attribute(dumbbell, "lb_segment"), local_points(dumbbell)[:, 0]
    assert set(labels) == {0, 1}
    sure = np.abs(x) > 0.5
    assert len(np.unique(labels[sure & (x > 0)])) == len(np.unique(labels[sure & (x < 0)])) == 1


def test_signs_of_a_mode(dumbbell):
    bpy.ops.meshfree.segment(method="NODAL", mode=2)
    labels, x = attribute(dumbbell, "lb_segment"), local_points(dumbbell)[:, 0]
    assert np.abs(np.corrcoef(labels, np.sign(x))[0, 1]) > 0.95


def test_vertex_groups_on_demand(dumbbell):
    add_group(dumbbell, "Segment 7", [0, 1])
    add_group(dumbbell, "Mine", [0, 1])
    bpy.ops.meshfree.segment(parts=3, vertex_groups=True)
    assert [group.name for group in dumbbell.vertex_groups] == ["Mine", "Segment 0", "Segment 1", "Segment 2"]
    labels = attribute(dumbbell, "lb_segment")
    index = dumbbell.vertex_groups["Segment 1"].index
    held = [any(item.group == index for item in vertex.groups) for vertex in dumbbell.data.vertices]
    assert (np.array(held) == (labels == 1)).all()


def test_separating_keeps_every_point_and_what_it_holds(dumbbell):
    dumbbell.location = (1.0, 2.0, 3.0)
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.segment(parts=3)
    labels, points, areas = (attribute(dumbbell, "lb_segment"), local_points(dumbbell), attribute(dumbbell, "lb_area"))
    add_group(dumbbell, "Right", points[:, 0] > 0.0)
    bpy.ops.meshfree.separate_by_segment()
    for number, name in enumerate(["Cloud", "Cloud Segment 1", "Cloud Segment 2"]):
        part = bpy.data.objects[name]
        np.testing.assert_array_equal(local_points(part), points[labels == number])
        np.testing.assert_array_equal(attribute(part, "lb_area"), areas[labels == number])
        assert tuple(part.location) == (1.0, 2.0, 3.0)
        right = part.vertex_groups["Right"].index
        held = [any(item.group == right for item in vertex.groups) for vertex in part.data.vertices]
        np.testing.assert_array_equal(held, points[labels == number, 0] > 0.0)


def test_separating_without_parts(dumbbell):
    with refused(dumbbell, "has no parts. Segment it first"):
        bpy.ops.meshfree.separate_by_segment()


def test_too_many_modes_asked_for(dumbbell):
    with refused(dumbbell, "modes were asked for"):
        bpy.ops.meshfree.segment(method="NODAL", mode=2000)


@pytest.mark.parametrize("kind", ["HEAT", "WAVE"])
def test_signatures(core, dumbbell, kind):
    bpy.ops.meshfree.signature(kind=kind, count=5, modes=20)
    names = [f"lb_{kind.lower()}_signature_{number:03d}" for number in range(1, 6)]
    assert [name for name in result_names(dumbbell) if "signature" in name] == names
    laplacian = core.build_laplacian(local_points(dumbbell))
    signature = getattr(core.spectral, f"{kind.lower()}_kernel_signature")(laplacian.eigenpairs(20), count=5)
    for name, values in zip(names, signature.T, strict=True):
        np.testing.assert_allclose(attribute(dumbbell, name), values, rtol=1e-3)
    bpy.ops.meshfree.signature(kind=kind, count=2, modes=20)
    assert [name for name in result_names(dumbbell) if "signature" in name] == names[:2]


def test_separating_keeps_shape_keys_and_drops_what_was_of_the_whole(dumbbell):
    points = local_points(dumbbell)
    dumbbell.shape_key_add(name="Basis")
    key = dumbbell.shape_key_add(name="Wide")
    key.points.foreach_set("co", (2.0 * points).astype(np.float32).reshape(-1))
    key.value = 0.25
    dumbbell.active_shape_key_index = 1
    bpy.ops.meshfree.spectrum(count=5)
    bpy.ops.meshfree.segment(parts=2)
    labels = attribute(dumbbell, "lb_segment")
    assert bpy.ops.meshfree.separate_by_segment() == {"FINISHED"}
    for number, name in enumerate(["Cloud", "Cloud Segment 1"]):
        part = bpy.data.objects[name]
        np.testing.assert_allclose(local_points(part), points[labels == number], atol=1e-6)
        np.testing.assert_allclose(key_points(part, "Wide"), 2.0 * points[labels == number], atol=1e-6)
        assert part.data.shape_keys.key_blocks["Wide"].value == 0.25
        assert "lb_eigenvalues" not in part
        assert part.modifiers.keys() == ["Mesh-Free Display"]


def test_a_part_is_not_separated_from_itself(dumbbell):
    bpy.ops.meshfree.segment(parts=3)
    bpy.ops.meshfree.separate_by_segment()
    part = bpy.data.objects["Cloud Segment 2"]
    bpy.context.view_layer.objects.active = part
    dumbbell.select_set(False)
    with refused(part, "are in one part. Segment it"):
        bpy.ops.meshfree.separate_by_segment()


def test_the_largest_part_stays(dumbbell):
    labels = np.repeat([3, 5], [500, 2000]).astype(np.int32)
    dumbbell.data.attributes.new("lb_segment", "INT", "POINT").data.foreach_set("value", labels)
    bpy.ops.meshfree.separate_by_segment()
    assert len(dumbbell.data.vertices) == 2000
    assert len(bpy.data.objects["Cloud Segment 3"].data.vertices) == 500


def test_separating_one_of_two_linked_duplicates(dumbbell):
    bpy.ops.meshfree.segment(parts=2)
    other = dumbbell.copy()
    bpy.context.scene.collection.objects.link(other)
    with refused(dumbbell, "shares its mesh.*Make Single User"):
        bpy.ops.meshfree.separate_by_segment()
    dumbbell.meshfree.make_single_user = True
    assert bpy.ops.meshfree.separate_by_segment() == {"FINISHED"}
    assert len(dumbbell.data.vertices) < len(other.data.vertices) == 2500


def test_groups_that_cannot_be_replaced(dumbbell):
    group = add_group(dumbbell, "Segment 1", [0])
    group.lock_weight = True
    with refused(dumbbell, "Segment 1 of .* are locked.*Unlock"):
        bpy.ops.meshfree.segment(vertex_groups=True)
    dumbbell.vertex_groups.remove(group)
    dumbbell.data.attributes.new("Segment 1", "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match="attributes named Segment 1.*Rename"):
        bpy.ops.meshfree.segment(vertex_groups=True)
