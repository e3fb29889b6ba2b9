"""Render the pictures of the manual into docs/pictures/, in Blender's module: pictures.py [NAME ...].

Started by in_blender.py. Names are those of the pictures to renew; without any all are. Pictures of scans need a folder
of them, named by the environment variable MESHFREE_SCANS.
"""

import argparse
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import bpy
import numpy as np
from mathutils import Vector

import demo
import follow_pictures
import package
import paper_pictures
import release_pictures
import rig_pictures
import scan_pictures
import studio
import transfer_pictures
from coral import spread_directions
from studio import grid, part, row, single

OUTPUT = package.ROOT / "docs" / "pictures"
CUT = 0.45  # height at which the shape is cut open for the picture of a boundary
SPACING = 0.038  # of the points of the demonstration's shape
LINES = 15
FRAMES = 100  # of motions
LOOP, FADE = 16, 3  # pictures in a loop, and how many of them lead back to the first


def coral(noise=0.0):
    """Add the demonstration's shape, with noise of its points in units of their spacing."""
    points = demo.Coral().sample(demo.POINTS)
    points += noise * SPACING * np.random.default_rng(1).standard_normal(points.shape)
    return studio.make_object(points, "Coral")


def result(attribute):
    """Return a function that renders a result of the analysis."""

    def take(path):
        obj = coral()
        bpy.ops.meshfree.analyze()
        single(obj, attribute, path)

    return take


def surface(path):
    """The same points as dots and as discs, lit."""
    dots, discs = coral(), coral()
    for obj in (dots, discs):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.meshfree.show_surface()
    dots.meshfree.point_shape = "DOTS"
    dots.meshfree.point_size = 0.5
    row((dots, discs), path, legend=None)


def mesh(path):
    """Points, and the mesh of their surface in the same colors."""
    points = coral()
    bpy.ops.meshfree.analyze()
    studio.show(points, "lb_mean_curvature", radius=0.3)
    bpy.ops.meshfree.mesh_surface()
    points.hide_set(False)
    row((points, bpy.context.object), path, legend=points)


def compare(path):
    """A shape, and a later scan of it with a longer arm and a shorter one, colored by that."""
    before, points = coral(), demo.Coral().sample(demo.POINTS, seed=5)
    directions, arms = points / np.linalg.norm(points, axis=1)[:, None], spread_directions(9)
    for toward, growth in (((1.0, -1.0, 0.0), 0.15), ((-1.0, -1.0, 0.0), -0.15)):
        arm = arms[(arms @ toward).argmax()]
        points *= 1.0 + growth * np.exp(8.0 * (directions @ arm - 1.0))[:, None]
    after = studio.make_object(points, "Later")
    for obj in (before, after):
        obj.select_set(True)
    bpy.ops.meshfree.compare()
    studio.show(after, "lb_deviation")
    studio.show_shape(before)
    row((before, after), path, legend=after)


def align(path):
    """Two parts of a shape, one of them off, and both after they were aligned."""
    first, second = (demo.Coral().sample(demo.POINTS, seed=seed) for seed in (0, 5))
    parts = first[first[:, 0] - first[:, 2] < 0.4], second[second[:, 0] - second[:, 2] > -0.4]
    across = Vector(studio.picture_axes(studio.VIEW)[0])
    for place in (0.0, 1.3 * float(np.ptp(first @ across))):
        stays, moves = (studio.make_object(points, "Part") for points in parts)
        moves.location, moves.rotation_euler = (0.15, -0.12, 0.2), (0.15, -0.1, 0.15)
        if place:
            stays.select_set(True)
            moves.select_set(True)
            bpy.ops.meshfree.align_points(show=False)
        for obj, color in ((stays, studio.CLAY), (moves, studio.HANDLES)):
            display = studio.add_display(obj, 1.1 * SPACING)
            part("operators.objects.modifiers").set_input(display, "Material", studio.paint("Part", color))
            obj.location += place * across
    bpy.context.view_layer.update()
    studio.take(path, legend=None)


def shape_index(path):
    """The shape index: caps, ridges, saddles, valleys and cups."""
    obj = coral()
    bpy.ops.meshfree.principal_curvatures()
    single(obj, "lb_shape_index", path)


def curvature_direction(path):
    """Directions of the greatest curvature: around the arms, and through the valleys between them."""
    obj = coral()
    bpy.ops.meshfree.principal_curvatures(display="DIRECTION")
    single(obj, "lb_direction_1", path)


def roughness(path):
    """The roughness of the shape, with noise between two heights."""
    points, places = demo.Coral().sample(demo.POINTS), np.random.default_rng(1)
    rough = np.abs(points[:, 2]) < 0.3
    points[rough] += 0.3 * SPACING * places.standard_normal((np.count_nonzero(rough), 3))
    obj = studio.make_object(points, "Coral")
    bpy.ops.meshfree.roughness()
    single(obj, "lb_roughness", path)


def surface_variation(path):
    """Thin arms, and the valleys between them, are farther from planes than broad parts."""
    obj = coral()
    bpy.ops.meshfree.surface_variation()
    single(obj, "lb_surface_variation", path)


def orient(path):
    """A noisy ring whose scan has gaps all along, colored by the side that looks at the viewer, before and after."""
    around, across, places = np.random.default_rng(2).random((3, 9_000))
    around, across = 2.0 * np.pi * around, 2.0 * np.pi * across
    kept = (places < (2.0 + np.cos(across)) / 3.0) & (np.abs(np.cos(across)) > 0.3)
    around, across = around[kept], across[kept]
    out = np.column_stack([np.cos(around), np.sin(around), 0.0 * around])
    points = 2.0 * out + np.cos(across)[:, None] * out + np.sin(across)[:, None] * [0.0, 0.0, 1.0]
    points += 0.4 * 0.07 * places[kept].std() * np.random.default_rng(3).standard_normal(points.shape)
    before, after = studio.make_object(points, "Before"), studio.make_object(points, "After")
    for obj, kind in ((before, "OUTSIDE"), (after, "WINDING")):
        studio.activate(obj)
        bpy.ops.meshfree.orient_normals(method=kind, show=False)  # by dots: so noisy discs stick out at the gaps
        normals = np.empty(3 * len(points), np.float32)
        obj.data.attributes["lb_normal"].data.foreach_get("vector", normals)
        outer = np.where(np.cos(across) > 0.0, 1.0, -1.0) * np.einsum("ij,ij->i", normals.reshape(-1, 3), out)
        layer = obj.data.attributes.new("outer", "FLOAT", "POINT")
        layer.data.foreach_set("value", np.sign(outer).astype(np.float32))
        obj.meshfree.color_map = "COOL_WARM"
        studio.show(obj, "outer", studio.TOUCHING)
        studio.set_range(obj, -1.0, 1.0)
    row((before, after), path, legend=None)


def mode(path):
    """One vibration mode."""
    obj = coral()
    bpy.ops.meshfree.spectrum(count=20)
    single(obj, "lb_eigenvector_020", path)


def boundary(path):
    """The boundary of the shape cut open."""
    points = demo.Coral().sample(demo.POINTS)
    obj = studio.make_object(points[points[:, 2] < CUT], "Coral")
    bpy.ops.meshfree.analyze()
    single(obj, "lb_boundary", path)


def smooth(path):
    """The shape with noise, and without it again."""
    objects = coral(noise=0.6), coral(noise=0.6)
    bpy.ops.meshfree.smooth(method="NOISE", target="IN_PLACE")
    for obj in objects:
        studio.show_shape(obj)
    row(objects, path, legend=None)


def stray_points(path):
    """A scan with stray points, found and deleted."""
    rng, points = np.random.default_rng(4), demo.Coral().sample(demo.POINTS)
    low, high = 1.1 * points.min(axis=0), 1.1 * points.max(axis=0)
    points = np.concatenate([points, rng.uniform(low, high, (len(points) // 25, 3))])
    found, clean = studio.make_object(points, "Found"), studio.make_object(points, "Clean")
    for obj, action in ((found, "SHOW"), (clean, "DELETE")):
        studio.activate(obj)
        bpy.ops.meshfree.stray_points(action=action)
        studio.show(obj, "lb_stray", radius=0.6)
        studio.set_range(obj, 0.0, 1.0)
    row((found, clean), path, legend=None)


def thin_out(path):
    """A shape four times as dense on one half, and thinned out to one spacing."""
    points = demo.Coral().sample(4 * demo.POINTS)
    points = points[(points[:, 0] > 0.0) | (np.arange(len(points)) % 4 == 0)]
    before, after = studio.make_object(points, "Before"), studio.make_object(points, "After")
    bpy.ops.meshfree.thin_out(spacing=2.0 * SPACING)
    for obj in (before, after):
        studio.show_shape(obj, like=before)
    row((before, after), path, legend=None)


def import_tiles(path):
    """Four tiles of a terrain: an overview of 8,000 points, and a place of it with all points, enlarged five times."""
    random, write = np.random.default_rng(5), part("core.files").write_points
    with TemporaryDirectory() as folder:
        names = [f"tile_{x}_{y}.ply" for x in (0, 1) for y in (0, 1)]
        for name in names:
            places = random.uniform(0.0, 50.0, (60_000, 2)) + 50.0 * np.array([int(word) for word in name[5:8:2]])
            x, y = 0.1 * places.T
            height = (
                3.0 * np.sin(x) * np.cos(0.7 * y) + np.sin(2.3 * x + 1.0) * np.sin(1.9 * y) + 0.3 * np.sin(7.0 * x + y)
            )
            table = part("core.files").PointTable(np.column_stack([places, height]), {"height": height})
            write(Path(folder) / name, table)
        tiles = {"directory": folder, "files": [{"name": name} for name in names], "color": "height"}
        bpy.ops.meshfree.import_tiles(count=8000, **tiles)
        overview = bpy.context.object
        bpy.ops.object.empty_add(type="CUBE", radius=10.0, location=(63.0, 45.0, 0.0))
        bpy.ops.meshfree.import_tiles(density="ALL", box=bpy.context.object.name, **tiles)
    detail = bpy.context.object
    detail.scale = 3 * (5.0,)
    for obj, radius in ((overview, 0.9), (detail, 1.5)):  # the points inside the box are random, so gaps are wider
        studio.show(obj, "height", radius=radius)
        studio.set_range(obj, -4.0, 4.0)
    grid([[overview, detail]], path, view=(0.3, -1.0, 0.9), size=(800, 300), gap=0.04)


def sequence(path):
    """Four frames of the shape as it grows upwards, of other points each, with one mode in one range."""
    random = np.random.default_rng(3)
    with TemporaryDirectory() as folder:
        for number, height in enumerate((0.8, 1.0, 1.2, 1.4)):
            points = random.permutation(demo.Coral().sample(demo.POINTS))[: demo.POINTS - 500 * number]
            np.save(Path(folder) / f"coral_{number}.npy", points * (1.0, 1.0, height))
        bpy.ops.meshfree.import_points(filepath=str(Path(folder) / "coral_0.npy"), sequence=True)
    bpy.ops.meshfree.analyze_sequence(modes=6, shown_mode=3)
    frames = part("operators.tools.sequence").frames_of(bpy.context.object)
    bpy.data.objects.remove(bpy.context.object)
    bpy.context.view_layer.layer_collection.children[0].exclude = False
    for obj in frames:
        studio.show(obj, "lb_eigenvector_003")
    row(frames, path, legend=frames[0])


def mode_shape(path):
    """A spherical harmonic as a displacement: found among the modes of a sphere, and exact.

    The eleven modes of the fifth frequency are any basis of their space, so the harmonic is put together from them.
    """
    laplacian, (_, harmonic) = paper_pictures.harmonics()
    objects = [paper_pictures.colored_sphere(laplacian, values, amplitude=0.3) for values in harmonic]
    row(objects, path, legend=objects[0])


def segment(path):
    """The shape in parts: a body and its arms."""
    obj = coral()
    bpy.ops.meshfree.segment(parts=7)
    single(obj, "lb_segment", path)


def signature(path):
    """A heat signature: high at the tips of arms, low between them."""
    obj = coral()
    bpy.ops.meshfree.signature(kind="HEAT", count=8)
    single(obj, "lb_heat_signature_004", path)


def distance(path):
    """Distances from one point, with lines of equal distance."""
    obj = coral()
    obj.meshfree.iso_lines, obj.meshfree.coverage = LINES, 100.0
    studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "SOURCE")
    bpy.ops.meshfree.geodesic_distance()
    single(obj, "lb_distance", path)


def path(path):
    """The shortest path between the tips of two arms, over the distances from one of them."""
    obj = coral()
    obj.meshfree.coverage = 100.0
    studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "SOURCE")
    bpy.ops.meshfree.geodesic_distance()
    positions = np.array([vertex.co for vertex in obj.data.vertices])
    ends = [int((positions @ direction).argmax()) for direction in ((1.0, -1.0, 0.0), (0.0, 0.0, 1.0))]
    obj.data.vertices.foreach_set("select", np.isin(np.arange(len(positions)), ends))
    bpy.ops.meshfree.geodesic_path(thickness=0.4 * SPACING)
    bpy.data.objects[f"{obj.name} Path"].data.materials.append(studio.paint("Path", studio.CLAY))
    single(obj, "lb_distance", path)


def section(path):
    """The section by a plane that leans towards the viewer, on the shape."""
    obj = coral()
    bpy.ops.object.empty_add(rotation=(-0.3, 0.2, 0.0))
    plane = bpy.context.object
    studio.activate(obj)
    obj.meshfree.coverage = 100.0
    bpy.ops.meshfree.cross_section(plane=plane.name, thickness=0.7 * SPACING)
    bpy.data.objects[f"{obj.name} Section"].data.materials.append(studio.paint("Section", studio.CLAY))
    bpy.ops.meshfree.analyze()
    single(obj, "lb_mean_curvature", path)


def iso_lines(path):
    """Lines of equal height of a mode, shown on discs and as tubes of their own."""
    shown, made = coral(), coral()
    for obj in (shown, made):
        studio.activate(obj)
        bpy.ops.meshfree.analyze(modes=4)
        obj.meshfree.iso_lines = LINES
        studio.show(obj, "lb_eigenvector_004")
    bpy.ops.meshfree.iso_lines_to_curves(thickness=0.3 * SPACING)
    bpy.data.objects[f"{made.name} Iso Lines"].data.materials.append(studio.paint("Tubes", studio.CLAY))
    studio.line_up([shown, made])
    bpy.data.objects[f"{made.name} Iso Lines"].matrix_world = made.matrix_world
    made.hide_render = True
    studio.take(path, legend=shown)


def signed_distance(path):
    """Distance from a circle around the shape, by sides."""
    obj = coral()
    bpy.ops.curve.primitive_bezier_circle_add(radius=1.5)
    curve = bpy.context.object
    bpy.context.view_layer.objects.active = obj
    obj.meshfree.iso_lines = LINES
    bpy.ops.meshfree.signed_distance(curve=curve.name)
    single(obj, "lb_signed_distance", path)


def nearest_source(path):
    """Cells around sixty points that lie apart."""
    obj = coral()
    local = studio.world_points(obj)
    chosen = np.random.default_rng(3).permutation(len(local))[:60]
    studio.group(obj, np.isin(np.arange(len(local)), chosen), "SOURCE")
    obj.meshfree.color_map = "CATEGORICAL"
    bpy.ops.meshfree.nearest_source()
    single(obj, "lb_cell", path)


def unwrap(path):
    """A checkerboard around the tip of an arm."""
    obj = coral()
    studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "SOURCE")
    bpy.ops.meshfree.unwrap(radius=3.0)
    row([obj], path, legend=None)


def extend_direction(path):
    """A direction carried from the tip of an arm."""
    obj = coral()
    studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "SOURCE")
    bpy.ops.meshfree.extend_direction()
    single(obj, "lb_direction", path)


def field(path):
    """A harmonic field between the tips of two arms."""
    obj = coral()
    obj.meshfree.iso_lines = LINES
    studio.harmonic_field(obj, low=(-1.0, 0.0, 0.0), high=(1.0, -1.0, 0.0))
    single(obj, "lb_field", path)


def weights_from_selection(path):
    """Weights that fall off with the distance from the tip of an arm, and that blend between the tips of two."""
    objects = [coral(), coral()]
    for obj in objects:
        obj.meshfree.iso_lines = LINES
        studio.group(obj, studio.tip(obj, (-1.0, 0.0, 0.0)), "LOW", grown=0.4)
        studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "HIGH", grown=0.4)
    studio.activate(objects[0])
    bpy.ops.meshfree.weights_from_selection(group="High", radius=2.0)
    studio.activate(objects[1])
    bpy.ops.meshfree.weights_from_selection(group="High", method="BETWEEN")
    row(objects, path, legend=objects[1])


def smooth_weights(path):
    """Weights of a bone that end at a hard edge, and the same after they were smoothed."""
    objects = [coral(), coral()]
    for obj in objects:
        points = studio.world_points(obj)
        own = points @ [1.0, -1.0, 0.2] > 0.3
        part("operators.rigging.weights").write_weights(obj, ["Arm", "Rest"], np.column_stack([own, ~own]) * 1.0)
    studio.activate(objects[1])
    bpy.ops.meshfree.smooth_weights(length=0.6)
    for obj in objects:
        weights = part("operators.rigging.weights").read_weights(obj)[:, 0]
        part("operators.objects.attributes").write_attribute(obj.data, "lb_weight", weights)
        studio.show(obj, "lb_weight")
    row(objects, path, legend=objects[1])


def deform(path):
    """An arm bent by its tip."""
    rest, obj = coral(), coral()
    studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.5)), "HANDLE", grown=0.35)
    studio.group(obj, studio.world_points(obj)[:, 2] < -0.7, "ANCHOR")
    studio.deform(obj, move=(0.0, 0.0, 1.0), rotate=(-0.5, -0.5, 0.0))
    studio.deformed_row(rest, obj, path)


def minimal(path):
    """A cylinder that becomes a catenoid, the least area between its boundaries."""
    around, height = np.meshgrid(2.0 * np.pi * np.arange(196) / 196, np.linspace(-1.0, 1.0, 40))
    points = np.column_stack([2.0 * np.cos(around.ravel()), 2.0 * np.sin(around.ravel()), height.ravel()])
    objects = []
    for name in ("Cylinder", "Catenoid"):
        obj = studio.make_object(points, name)
        if name == "Catenoid":
            bpy.ops.meshfree.minimal_surface(target="IN_PLACE")
        bpy.ops.meshfree.analyze(show=False)
        obj.meshfree.color_map = "COOL_WARM"  # gray where the mean curvature is zero
        studio.show(obj, "lb_mean_curvature")
        studio.set_range(obj, -0.4, 0.4)
        objects.append(obj)
    studio.line_up(objects)
    for obj in objects:
        ends = studio.world_points(obj)[np.abs(points[:, 2]) == 1.0]
        studio.mark(ends, studio.ANCHORS, studio.MARKS * 2.0 / 40)
    studio.take(path, legend=objects[0])


def motion(kind, last, **settings):
    """Return a function that renders a motion from the tip of an arm as a loop: to a frame, and back to the first."""

    def take(path):
        scene, obj, frames = bpy.context.scene, coral(), part("operators.objects.motion")
        scene.frame_start, scene.frame_end = 1, FRAMES
        studio.group(obj, studio.tip(obj, (1.0, -1.0, 0.0)), "SOURCE")
        bpy.ops.meshfree.simulate(kind=kind, **settings)
        shown = [frames.frame_of(obj, frame) for frame in np.linspace(1, last, LOOP - FADE)]
        shares = np.arange(1, FADE + 1) / (FADE + 1)
        shown += [(1.0 - share) * shown[-1] + share * shown[0] for share in shares]
        obj.meshfree.motion_file = ""  # which Blender would play as it renders
        studio.loop(obj, (partial(frames.show_values, obj, values) for values in shown), path)

    return take


PICTURES = {
    "area": result("lb_area"),
    "normal": result("lb_normal"),
    "curvature": result("lb_mean_curvature"),
    "gaussian": result("lb_gaussian_curvature"),
    "mode": mode,
    "boundary": boundary,
    "smooth": smooth,
    "stray_points": stray_points,
    "thin_out": thin_out,
    "import_tiles": import_tiles,
    "sequence": sequence,
    "mode_shape": mode_shape,
    "segment": segment,
    "surface": surface,
    "mesh": mesh,
    "align": align,
    "compare": compare,
    "shape_index": shape_index,
    "curvature_direction": curvature_direction,
    "roughness": roughness,
    "surface_variation": surface_variation,
    "orient": orient,
    "signature": signature,
    "distance": distance,
    "path": path,
    "section": section,
    "iso_lines": iso_lines,
    "signed_distance": signed_distance,
    "nearest_source": nearest_source,
    "unwrap": unwrap,
    "extend_direction": extend_direction,
    "field": field,
    "weights_from_selection": weights_from_selection,
    "smooth_weights": smooth_weights,
    "deform": deform,
    "minimal": minimal,
    "motion_heat": motion("HEAT", 70, width=1.0, distance=2.5),
    "motion_wave": motion("WAVE", 75, width=0.5, distance=6.0, height=0.25),
    "motion_reaction": motion("REACTION", 100, distance=0.55),
    "motion_front": motion("FRONT", 70, width=0.4),
    **follow_pictures.PICTURES,
    **paper_pictures.PICTURES,
    **release_pictures.PICTURES,
    **rig_pictures.PICTURES,
    **scan_pictures.PICTURES,
    **transfer_pictures.PICTURES,
}


def main():
    """Render the pictures that are asked for, each in a scene of its own."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"pictures to renew: {', '.join(PICTURES)}")
    names = parser.parse_args().names or list(PICTURES)
    unknown = [name for name in names if name not in PICTURES]
    if unknown:
        parser.error(f"there is no picture {', '.join(unknown)}")
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with studio.extension():
        for name in names:
            if name in {**scan_pictures.PICTURES, **follow_pictures.PICTURES} and not scan_pictures.FOLDER:
                print(f"left out {name}: MESHFREE_SCANS names no folder of scans", flush=True)
                continue
            began, path = perf_counter(), OUTPUT / f"{name}.png"
            with studio.silence():
                bpy.ops.wm.read_homefile(use_empty=True)
                PICTURES[name](path)
            print(f"written  {path.relative_to(package.ROOT)}  {perf_counter() - began:.1f} s", flush=True)


if __name__ == "__main__":
    main()
