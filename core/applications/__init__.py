"""What uses the operator: filters, segments, fields, distances, deformation, minimal surfaces, meshes."""

from .cleaning.smoothing import DETAIL, roughness
