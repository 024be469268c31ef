"""Neural garments: trained models that dress animated characters.

    import unic

    model = unic.Model.load("tshirt.unic")
    motion = unic.Motion.load("walk.bvh", model)
    positions = unic.Animator(model).animate(motion)    # (frames, vertices, 3), metres

Right-handed, +Y up, characters face +Z; metres, seconds, radians, float32. Rotations are unit
quaternions x, y, z, w.
"""

from . import _scenes
from ._unic import (
    Animator,
    Capture,
    CapturedClip,
    Character,
    Collider,
    Mesh,
    Model,
    Motion,
    Pose,
    VertexAnimation,
    __version__,
    read_character,
    read_mesh,
    read_vertex_animation,
)
from .errors import Error, Fault, FileError

__all__ = [
    "Animator",
    "Capture",
    "CapturedClip",
    "Character",
    "Collider",
    "Error",
    "Fault",
    "FileError",
    "Mesh",
    "Model",
    "Motion",
    "Pose",
    "VertexAnimation",
    "__version__",
    "read_character",
    "read_mesh",
    "read_vertex_animation",
]

_scenes.read_in_processes()
