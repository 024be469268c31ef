"""A small capture, written with numpy alone in the format of docs/reference/capture.md.

The character is a column of six joints, and the garment a wide tube around it.
"""

import numpy as np

FPS, FRAMES = 30, 40


def tube(radius, heights, around=16):
    """Vertices and faces of an open cylinder about +Y, with the faces counter-clockwise outside."""
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.stack([radius * np.sin(angle), 0 * angle, radius * np.cos(angle)], axis=1)
    vertices = np.concatenate([ring + [0, y, 0] for y in heights])
    faces = []
    for row in range(len(heights) - 1):
        for i in range(around):
            a, b = row * around + i, row * around + (i + 1) % around
            faces += [[a, b, b + around], [a, b + around, a + around]]
    return vertices.astype(np.float32), np.array(faces, np.int32)


def unrolled(faces, around=16):
    """Texture coordinates of a tube that is cut open, and their indices at the face corners."""
    rows = faces.max() // around + 1
    uvs = np.array([[i / around, row / rows] for row in range(rows) for i in range(around + 1)])
    row, i = faces // around, faces % around
    # A face that closes the ring uses the coordinates at the far side of the cut.
    i = np.where((i == 0) & (i.max(axis=1, keepdims=True) == around - 1), around, i)
    return uvs, row * (around + 1) + i


def write_character(path):
    """Writes character.npz, with a rest pose that is not zero."""
    vertices, faces = tube(0.15, np.linspace(0, 1.6, 17))
    joints = np.array([[0, y, 0] for y in (0.9, 0.5, 1.1, 1.4, 0.2, 1.55)], np.float32)
    nearness = np.exp(-(((vertices[:, None, 1] - joints[None, :, 1]) / 0.3) ** 2))
    weights = nearness / nearness.sum(axis=1, keepdims=True)
    rest_pose = np.array([[0, 0.2, 0], [0.1, 0, 0], [0, 0, 0.3], [0, -0.2, 0.1], [0, 0, 0.1], [0.2, 0, 0]],
                         np.float32)
    parents = np.array([-1, 0, 0, 2, 1, 3])
    np.savez(path, vertices=vertices, faces=faces, joints=joints, parents=parents,
             weights=weights.astype(np.float32), rest_pose=rest_pose)


def motion(seed):
    """Smooth random poses (T, 3 J) and translations (T, 3)."""
    random = np.random.default_rng(seed)
    t = np.arange(FRAMES)[:, None] / FPS
    wave = lambda size, n: size * np.sin(2 * np.pi * random.uniform(0.3, 1.5, n) * t + random.uniform(0, 6, n))
    return wave(0.4, 18), wave(0.3, 3) * [1, 0.1, 1]


def write_clip(folder, name, seed, garment_rest, character):
    """Writes a clip whose garment follows the nearest body vertices, with a wave of 2 cm."""
    poses, trans = motion(seed)
    weights = character["weights"]
    nearest = np.linalg.norm(garment_rest[:, None] - character["vertices"][None], axis=2).argmin(axis=1)
    garment = skinned(character, poses, trans, garment_rest, weights[nearest])
    garment += 0.02 * np.sin(4 * garment[:, :, 1:2] + np.arange(FRAMES)[:, None, None] / 5)
    np.savez(folder / f"{name}.npz", poses=poses, trans=trans, mocap_framerate=float(FPS))
    np.save(folder / f"{name}.garment.npy", garment.astype(np.float32))


def write_capture(root):
    """Writes a capture with two training clips, a validation clip and a test clip."""
    (root / "clips").mkdir(parents=True)
    (root / "capture.toml").write_text(
        'version = 1\nname = "tube"\nfps = 30.0\nup = "y"\nunits = "metres"\n'
        'provenance = "made by tests/readers.py"\ncontact_joints = [1, 1, 1, 1]\n'
        '[splits]\ntrain = ["a", "b"]\nvalidation = ["c"]\ntest = ["d"]\n')
    write_character(root / "character.npz")
    vertices, faces = tube(0.2, np.linspace(0.6, 1.4, 9))
    uvs, corners = unrolled(faces)
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"vt {u} {v}" for u, v in uvs]
    lines += ["f " + " ".join(f"{v}/{vt}" for v, vt in zip(*f)) for f in zip(faces + 1, corners + 1)]
    (root / "garment.obj").write_text("\n".join(lines) + "\n")
    character = np.load(root / "character.npz")
    for seed, name in enumerate("abcd"):
        write_clip(root / "clips", name, seed, vertices, character)


# ---- kinematics, from docs/reference/capture.md -------------------------------------------------


def matrices(axis_angles):
    """Rotation matrices of axis-angle vectors (..., 3), by Rodrigues' formula."""
    angle = np.linalg.norm(axis_angles, axis=-1, keepdims=True)
    x, y, z = np.moveaxis(axis_angles / np.maximum(angle, 1e-12), -1, 0)
    o = np.zeros_like(x)
    k = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*x.shape, 3, 3)
    s, c = np.sin(angle)[..., None], np.cos(angle)[..., None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def globals_of(local, parents):
    """Global rotations from local ones."""
    turned = []
    for j, parent in enumerate(parents):
        turned.append(local[j] if parent < 0 else turned[parent] @ local[j])
    return turned


def skinned(character, poses, trans, rest, weights):
    """World positions (T, V, 3) of vertices given in the rest pose."""
    joints, parents = character["joints"].astype(float), character["parents"]
    bind = globals_of(matrices(character["rest_pose"].astype(float)), parents)
    frames = []
    for local, offset in zip(matrices(poses.reshape(len(poses), -1, 3)), trans):
        turned, places, moved = globals_of(local, parents), [], 0
        for j, parent in enumerate(parents):
            places.append(joints[j] + offset if parent < 0 else
                          places[parent] + turned[parent] @ bind[parent].T @ (joints[j] - joints[parent]))
            rigid = (rest - joints[j]) @ (turned[j] @ bind[j].T).T + places[j]
            moved = moved + weights[:, j:j + 1] * rigid
        frames.append(moved)
    return np.stack(frames)
