"""Weights of bones, their transfer, and surfaces that follow bones."""

from .bone_weights import bone_weights as bone_weights
from .bone_weights import nearest_bones as nearest_bones
from .envelopes import envelope_share as envelope_share
from .inpainting import inpaint as inpaint
from .inpainting import inpaint_labels as inpaint_labels
from .mixing import are_normalized as are_normalized
from .mixing import mix_weights as mix_weights
from .places import SurfaceMatch as SurfaceMatch
from .places import match_surface as match_surface
from .skinning import Skinner as Skinner
from .skinning import skin as skin
from .smoothing import smooth_weights as smooth_weights
from .transfer import transfer_labels as transfer_labels
from .transfer import transfer_values as transfer_values
