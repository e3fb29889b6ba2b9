"""Nodal domains and segments against the paper's Figures 10, 11 and 16."""

import time
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import connected_components

import core

from .labels import agreement
from .samplings import fibonacci_sphere, parabolic_cylinder, sausage, trimmed_star
from .speed import SCANS, read_ply
from .targets import Goal, judge

PARTS = range(2, 13)


def isometry():
    """Figure 10: nodal domains on a plane and on two parabolic cylinders that are isometric to it."""
    plane = core.build_laplacian(parabolic_cylinder(0.0))
    modes = plane.eigenpairs(11).eigenvectors
    for bend in (0.5, 1.0):
        bent = core.build_laplacian(parabolic_cylinder(bend))
        spectrum = bent.eigenpairs(11)
        for mode in (2, 4, 10):
            flat = modes[:, mode - 1]
            sure = np.abs(flat) > 0.02 * np.abs(flat).max()
            domains = [
                core.spectral.nodal_domains(plane, flat),
                core.spectral.nodal_domains(bent, spectrum.eigenvectors[:, mode - 1]),
            ]
            figures = [
                ("labels that agree, above 2 %", agreement(*(label[sure] for label in domains)), 0.97),
                ("labels that agree, all points", agreement(*domains), None),
            ]
            for figure, value, bound in figures:
                goal = Goal(figure, bound, "{:.1%}", least=True)
                yield goal.row(f"Figure 10, mode {mode}, a = {bend:g}, {domains[0].max() + 1} domains", value)


def noise():
    """Figure 11: nodal domains of mode 6 on a trimmed star, with noise and without."""
    for kind, arms, seed in (("even", 6, None), ("random", 6, 0), ("even", 5, None)):
        points = trimmed_star(arms=arms, seed=seed)
        clean = core.build_laplacian(points)
        spectrum = clean.eigenpairs(8)
        domains = core.spectral.nodal_domains(clean, spectrum.eigenvectors[:, 5])
        spacing = np.sqrt(clean.areas.sum() / len(points))
        around = np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))
        diagonal = np.linalg.norm(np.ptp(points, axis=0))
        for name, size in (("spacing", spacing), ("rms radius", around), ("diagonal", diagonal)):

            def measure(size=size, points=points, spacing=spacing, domains=domains):
                shares = []
                for seed in range(3):
                    shift = 0.03 * size * np.random.default_rng(seed).standard_normal(points.shape)
                    rough = core.build_laplacian(points + shift)
                    mode = rough.eigenpairs(8).eigenvectors[:, 5]
                    shares.append(agreement(domains, core.spectral.nodal_domains(rough, mode)))
                yield np.mean(shares)
                yield 0.03 * size / spacing

            case = f"Figure 11, {kind} star of {arms} arms, {domains.max() + 1} domains, noise of 3 % of the {name}"
            goals = [Goal("labels that agree", 0.95, "{:.1%}", least=True), Goal("noise in spacings", form="{:.2f}")]
            yield from judge(case, goals, measure())


def sausages():
    """Figure 16: the second mode, the first that is not constant, divides a bent sausage in the middle."""

    def measure(bent):
        points, along = sausage(bent=bent)
        laplacian = core.build_laplacian(points)
        domains = core.spectral.nodal_domains(laplacian, laplacian.eigenpairs(2).eigenvectors[:, 1])
        yield domains.max() + 1
        middle = 0.5 * (along.min() + along.max())
        yield agreement(domains, (along > middle).astype(int))

    for bent in (False, True):
        goals = [Goal("domains", form="{:d}"), Goal("labels that agree with halves", 0.97, "{:.1%}", least=True)]
        yield from judge(f"Figure 16, sausage, {'bent' if bent else 'straight'}", goals, measure(bent))


def connected(labels, laplacian):
    """Count the labels that hang together through the pairs of the stiffness, or lack only what it does not couple."""
    lone = 0
    for label in range(labels.max() + 1):
        own = np.flatnonzero(labels == label)
        piece = connected_components(laplacian.stiffness[own][:, own], directed=False)[1]
        lone += len(np.unique(piece)) - 1
    return lone


def scans():
    """Segments of scans: all parts connected, and the time."""
    paths = sorted(Path(SCANS).glob("*.ply")) if SCANS else []
    if not paths:
        yield ["scans", "segments", "left out: MESHFREE_SCANS names no folder with scans", "", ""]
    for path in paths:
        laplacian = core.build_laplacian(read_ply(path))
        began = time.perf_counter()
        laplacian.eigenpairs(core.spectral.modes_needed(laplacian, max(PARTS)))  # which it keeps
        yield Goal("seconds for its modes", form="{:.1f}").row(f"scan, {path.stem}", time.perf_counter() - began)
        wrong, cut, seconds = 0, 0, []
        whole = connected(laplacian.component, laplacian)
        for parts in PARTS:
            began = time.perf_counter()
            labels = core.spectral.segment(laplacian, parts)
            seconds.append(time.perf_counter() - began)
            wrong += len(np.unique(labels)) != parts or labels.min() < 0
            cut += connected(labels, laplacian) - whole
        yield Goal("wrong numbers of parts, 2 to 12", 0, "{:d}").row(f"scan, {path.stem}", int(wrong))
        yield Goal("pieces cut off, 2 to 12 parts", 0, "{:d}").row(f"scan, {path.stem}", int(cut))
        yield Goal("seconds, slowest", form="{:.1f}").row(f"scan, {path.stem}", max(seconds))


def paths():
    """Distances that `grow` reaches: the area of a cap on the unit sphere against 2 pi (1 - cos d)."""
    points = fibonacci_sphere(8000)
    laplacian = core.build_laplacian(points)
    for distance in (0.3, 1.0, 2.0):
        reached = np.arccos(np.clip(points @ points[0], -1.0, 1.0))[core.distance.grow(laplacian, [0], distance)].max()
        yield Goal("reach / distance - 1", 0.05, "{:.1%}").row(
            f"grow by {distance:g} on a sphere", reached / distance - 1
        )


GROUPS = {"isometry": isometry, "noise": noise, "sausages": sausages, "paths": paths, "scans": scans}
