"""Types and descriptions of the extension module. Import the names from `unic`."""

from collections.abc import Iterator, Sequence
from os import PathLike
from typing import Any, Literal, TypeAlias, final, overload

import numpy as np
import numpy.typing as npt

_Path: TypeAlias = str | PathLike[str]
_Floats: TypeAlias = npt.NDArray[np.float32]
_Indices: TypeAlias = npt.NDArray[np.uint32]
_Precision: TypeAlias = Literal["auto", "f32", "bf16", "int16", "int8"]
_Intersections: TypeAlias = Literal["off", "paper", "robust"]
_Wearer: TypeAlias = Model | Capture | Character

__version__: str

@final
class Mesh:
    """Triangle mesh. Its arrays are views that cannot be written to."""

    @property
    def vertices(self) -> _Floats:
        """Positions, shape (V, 3)."""
    @property
    def faces(self) -> _Indices:
        """Vertex indices, shape (F, 3), counter-clockwise seen from outside."""
    @property
    def uvs(self) -> _Floats | None:
        """Texture coordinates, shape (N, 2), v upwards."""
    @property
    def uv_faces(self) -> _Indices | None:
        """Indices into `uvs`, shape (F, 3)."""

@final
class Character:
    """Skinned body with its skeleton."""

    @property
    def joint_names(self) -> list[str]: ...
    @property
    def parents(self) -> list[int]:
        """Index of each joint's parent, -1 for the root."""
    @property
    def joints(self) -> _Floats:
        """Positions of the joints in the rest pose, shape (J, 3)."""
    @property
    def root(self) -> int:
        """Index of the root joint."""
    @property
    def body(self) -> Mesh:
        """Body in the rest pose."""

@final
class Model:
    """Trained garment of a character. It does not change, and all threads may use it."""

    @staticmethod
    def load(path: _Path) -> Model:
        """Reads a model file (.unic)."""
    @staticmethod
    def from_bytes(content: bytes) -> Model:
        """Reads the content of a model file."""
    @staticmethod
    def shipped(name: Literal["tshirt", "skirt"]) -> Model:
        """Reads a garment that comes with the package, on the built-in human."""
    def with_precision(self, precision: _Precision, error: float = 0.01) -> Model:
        """Same model with networks in another number format.

        "auto", the choice of a model that is read, is the fastest format of this processor whose
        error, as training has measured it, is at most the share `error` above that of "f32". A format
        that is slower than "f32" on this processor gives a `UserWarning`.
        """
    def with_sampling(self, share: float) -> Model:
        """Same model with the networks evaluated at a share of the vertices, 0 to 1."""
    def with_mesh(self, mesh: Mesh) -> Model:
        """Same model on another mesh of the garment, in the same rest space."""
    def with_mask(self, mask: npt.ArrayLike) -> Model:
        """Same model blended with skinning: shape (V,), 1 is the model, 0 the skinned rest shape."""
    @property
    def name(self) -> str:
        """Name of the capture that the model was trained on."""
    @property
    def provenance(self) -> str:
        """Source and licence of the training data."""
    @property
    def training(self) -> Any:
        """Settings and results of training, as JSON holds them."""
    @property
    def fps(self) -> float:
        """Steps a second."""
    @property
    def precision(self) -> str:
        """Number format of the networks."""
    @property
    def vertex_count(self) -> int: ...
    @property
    def parameter_count(self) -> int: ...
    @property
    def joint_names(self) -> list[str]: ...
    @property
    def mesh(self) -> Mesh:
        """Rest shape of the garment."""
    @property
    def character(self) -> Character: ...

@final
class Pose:
    """Pose of a character in one frame, with the ground and the air around it.

    `rotations` are relative to the parent, and to the world at the root: quaternions of shape
    (J, 4) or axes times angles of shape (J, 3). `translation` is the position of the root joint
    minus its rest position. `wind` is the velocity of the air in m/s. `next` is the pose of the next
    frame where it is known, which only models of the preset `paper` read.
    """

    def __new__(
        cls,
        rotations: npt.ArrayLike,
        translation: npt.ArrayLike | None = None,
        *,
        ground_height: float = 0.0,
        wind: npt.ArrayLike | None = None,
        next: Pose | None = None,
    ) -> Pose: ...
    @staticmethod
    def from_world(
        character: _Wearer,
        rotations: npt.ArrayLike,
        root: npt.ArrayLike,
        *,
        rotations_are: Literal["world", "from_rest"] = "world",
        ground_height: float = 0.0,
        wind: npt.ArrayLike | None = None,
    ) -> Pose:
        """Pose of rotations in the world, shape (J, 4), and the position of the root joint.

        "from_rest" rotations are those of skinning matrices: the identity in the rest pose, whatever
        the axes of a rig's bones.
        """
    @staticmethod
    def rest(character: _Wearer) -> Pose:
        """Rest pose of a character."""
    @property
    def rotations(self) -> _Floats:
        """Rotations relative to the parents, shape (J, 4), a copy."""
    @property
    def translation(self) -> _Floats: ...
    @property
    def wind(self) -> _Floats: ...
    @property
    def ground_height(self) -> float: ...
    def joints(self, character: _Wearer) -> _Floats:
        """Positions of the joints in the world, shape (J, 3)."""

@final
class Motion:
    """Motion of a character: a sequence of poses. A slice of step 1 is a motion too.

    The constructor takes `rotations` of shape (T, J, 4) or (T, J, 3), `translations` of shape (T, 3)
    and `wind` of shape (T, 3), with the meanings of `Pose`.
    """

    def __new__(
        cls,
        rotations: npt.ArrayLike,
        translations: npt.ArrayLike,
        fps: float,
        *,
        ground_height: float = 0.0,
        wind: npt.ArrayLike | None = None,
        name: str = "",
    ) -> Motion: ...
    @staticmethod
    def load(
        path: _Path,
        character: _Wearer,
        *,
        fps: float | None = None,
        fps_of_file: float | None = None,
        metres_per_unit: float | None = None,
        up: Literal["auto", "y", "z"] = "auto",
        ground: Literal["auto", "keep", "on_ground"] = "auto",
        feet: Literal["auto", "keep", "hold"] = "auto",
        low_pass: float | None = None,
        repeat: int | None = None,
        bone_map: _Path | None = None,
        force: bool = False,
    ) -> Motion:
        """Reads a motion file for a character: npz, BVH, glTF, FBX or USD, as `unic animate` does.

        The motion is resampled to `fps`: unless given that of the model or the capture, and for a
        character that of the file. `low_pass` is a cutoff in Hz, 0 for none. A probable mistake in
        the file is an error; with `force` it is a note.
        """
    @staticmethod
    def built_in(name: str, character: _Wearer, fps: float | None = None) -> Motion:
        """Makes a built-in motion, one of those of `unic simulate --motion`."""
    @property
    def name(self) -> str: ...
    @property
    def fps(self) -> float: ...
    @property
    def ground_height(self) -> float: ...
    @property
    def notes(self) -> list[str]:
        """Conversions that made the motion, one sentence each."""
    @property
    def rotations(self) -> _Floats:
        """Rotations relative to the parents, shape (T, J, 4), a copy."""
    @property
    def translations(self) -> _Floats:
        """Positions of the root joint minus its rest position, shape (T, 3), a copy."""
    @property
    def wind(self) -> _Floats:
        """Velocity of the air, shape (T, 3), a copy."""
    def resampled(self, fps: float) -> Motion:
        """Same motion at another frame rate."""
    def save(self, path: _Path, character: _Wearer) -> None:
        """Writes an npz file with the character's joint names, in the layout of AMASS."""
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, index: int, /) -> Pose: ...
    @overload
    def __getitem__(self, index: slice, /) -> Motion: ...
    def __iter__(self) -> Iterator[Pose]: ...

@final
class Collider:
    """Solid shape with its place in the world: the ground or a prop."""

    @staticmethod
    def ground(height: float = 0.0) -> Collider: ...
    @staticmethod
    def sphere(radius: float, centre: npt.ArrayLike) -> Collider: ...
    @staticmethod
    def capsule(radius: float, start: npt.ArrayLike, end: npt.ArrayLike) -> Collider: ...
    @staticmethod
    def mesh(
        mesh: Mesh, rotation: npt.ArrayLike | None = None, translation: npt.ArrayLike | None = None
    ) -> Collider:
        """Inner side of a mesh with outward normals."""
    def at(self, rotation: npt.ArrayLike | None, translation: npt.ArrayLike) -> Collider:
        """Same shape at another place; None keeps the rotation. A mesh is shared."""

@final
class Animator:
    """Garment in motion.

    `precision` and `sampling` are those of `Model.with_precision` and `Model.with_sampling`;
    `intersections` replaces the model's own handling. `threads` is the number of threads that a step
    works on: one for every core unless given. Results are the same bytes for every number.

    One thread at a time may use an animator; another one gets an error. Calls release the
    interpreter's lock. Each returns a new array of positions of shape (V, 3), or fills `out` and
    returns it. `normals` gets the unit normals. Both are arrays of float32 in C order.
    """

    def __new__(
        cls,
        model: Model,
        *,
        precision: _Precision | None = None,
        sampling: float | None = None,
        intersections: _Intersections | None = None,
        threads: int | None = None,
    ) -> Animator: ...
    @property
    def model(self) -> Model:
        """Model with the animator's precision and sampling."""
    def reset(
        self,
        pose: Pose,
        *,
        start: npt.ArrayLike | None = None,
        out: _Floats | None = None,
        normals: _Floats | None = None,
    ) -> _Floats:
        """Begins a sequence, at its first frame or after a cut.

        The garment starts in the mean shape of training, or at the positions `start`.
        """
    def step(
        self, pose: Pose, *, out: _Floats | None = None, normals: _Floats | None = None
    ) -> _Floats:
        """Advances the garment by one tick of 1 / `Model.fps` seconds, to a new pose."""
    def display(
        self,
        pose: Pose,
        share: float,
        *,
        out: _Floats | None = None,
        normals: _Floats | None = None,
    ) -> _Floats:
        """Garment on any pose, a share of the way from the previous tick (0) to the last one (1)."""
    def animate(self, motion: Motion, *, start: npt.ArrayLike | None = None) -> npt.NDArray[np.float32]:
        """Resets and steps through a motion of the model's rate. Ctrl-C stops it.

        The result, shape (T, V, 3), is handed over without a copy.
        """
    @property
    def positions(self) -> _Floats:
        """Positions at the last tick, shape (V, 3), a copy."""
    @property
    def normals(self) -> _Floats:
        """Unit normals at the last tick, shape (V, 3), a copy."""
    def body(self) -> _Floats:
        """Positions of the body's vertices at the last tick, shape (B, 3)."""
    def state(self) -> bytes:
        """Saves everything that the next step depends on, in the form of the C interface."""
    def restore(self, state: bytes) -> _Floats:
        """Restores a saved state of the same model. Later steps give the same bytes as after it."""
    def set_positions(self, positions: npt.ArrayLike) -> None:
        """Replaces the garment at the current frame, shape (V, 3)."""
    def set_colliders(self, colliders: Sequence[Collider]) -> None:
        """Sets ground and props, for intersection handling "robust". Resets keep them."""
    def set_layers(self, layer_of_vertex: _Indices | None = None) -> None:
        """Sets the layer of each vertex, shape (V,); unless given by connected parts."""

@final
class Capture:
    """Capture: a garment that moves on a character. Clips are read when they are asked for."""

    @staticmethod
    def open(folder: _Path) -> Capture:
        """Opens the folder of a capture."""
    @property
    def name(self) -> str: ...
    @property
    def provenance(self) -> str: ...
    @property
    def fps(self) -> float: ...
    @property
    def character(self) -> Character: ...
    @property
    def mesh(self) -> Mesh:
        """Rest shape of the garment."""
    @property
    def splits(self) -> dict[str, list[str]]:
        """Names of the clips of the splits train, validation and test."""
    @property
    def clips(self) -> list[str]:
        """Names of all clips in the folder."""
    def clip(self, name: str) -> CapturedClip:
        """Reads a clip. A garment in a file of its own is mapped."""

@final
class CapturedClip:
    """One clip of a capture. Its arrays are views that cannot be written to."""

    @property
    def motion(self) -> Motion: ...
    @property
    def garment(self) -> _Floats:
        """Positions of the garment, shape (T, V, 3)."""
    @property
    def body(self) -> _Floats | None:
        """Positions of the body, shape (T, B, 3), if they are not those of skinning."""
    @property
    def notes(self) -> list[str]:
        """Probable mistakes in the motion, one sentence each."""

@final
class VertexAnimation:
    """Positions of vertices over time, in the unit and axes of their file."""

    @property
    def frames(self) -> _Floats:
        """Positions, shape (T, V, 3): a view that cannot be written to."""
    @property
    def fps(self) -> float | None:
        """Frames a second, if the file states them."""
    @property
    def mesh(self) -> Mesh | None:
        """First frame with its faces, if the file has faces."""

def read_mesh(path: _Path) -> Mesh:
    """Reads an OBJ file, in its own unit and axes."""

def read_character(path: _Path, body: str | None = None) -> Character:
    """Reads a character: npz, glTF, FBX, USD or a pickle of SMPL, in metres and +Y up.

    `body` is the name of the mesh, for files with several.
    """

def read_vertex_animation(path: _Path, object: str | None = None) -> VertexAnimation:
    """Reads PC2, MDD, npz, npy, Alembic, USD or a folder of OBJ files.

    `object` is the name of the mesh, for files with several.
    """

def run(words: Sequence[str]) -> int:
    """Runs the program with the words of a command line, its name first. Once in a process."""

def read_scenes_with(command: Sequence[str]) -> None:
    """Lets FBX and USD files be read in processes of a command, which must call `read_scene`."""

def read_scene() -> int:
    """Reads the file that the parent process names on stdin. Returns the exit code."""
