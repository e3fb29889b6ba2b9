"""Heat, waves, reactions and fronts that travel along a surface."""

from .motion import Heat as Heat
from .motion import Wave as Wave
from .motion import WaveState as WaveState
from .reaction import Mixture as Mixture
from .reaction import ReactionDiffusion as ReactionDiffusion
from .wave_modes import wave_modes as wave_modes
