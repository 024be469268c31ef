"""Evaluation of a binary glTF file with numpy alone, by the specification (ISO/IEC 12113)."""

import json
import struct

import numpy as np

COMPONENTS = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
SHAPES = {"SCALAR": (), "VEC2": (2,), "VEC3": (3,), "VEC4": (4,), "MAT4": (4, 4)}


class Glb:
    """GLB with one animation of a skinned body and a morphed garment, or with a still garment."""

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length, json_length, json_type = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, length, json_type) == (b"glTF", 2, len(data), b"JSON"), data[:20]
        self.json = json.loads(data[20:20 + json_length])
        binary_length, binary_type = struct.unpack_from("<I4s", data, 20 + json_length)
        self.binary = data[28 + json_length:]
        assert (binary_length, binary_type) == (len(self.binary), b"BIN\0")
        self.keys = {}
        for animation in self.json.get("animations", []):
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                target = channel["target"]
                self.keys[target["node"], target["path"]] = self.array(sampler["output"])
                self.times = self.array(sampler["input"])

    def array(self, accessor):
        """Array of an accessor, given by its index."""
        accessor = self.json["accessors"][accessor]
        view = self.json["bufferViews"][accessor["bufferView"]]
        dtype, shape = np.dtype(COMPONENTS[accessor["componentType"]]), SHAPES[accessor["type"]]
        offset = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * int(np.prod(shape))
        flat = np.frombuffer(self.binary, dtype, count, offset)
        return flat.reshape(accessor["count"], *shape)

    def node(self, name):
        return next(i for i, node in enumerate(self.json["nodes"]) if node["name"] == name)

    def primitive(self, name):
        return self.json["meshes"][self.json["nodes"][self.node(name)]["mesh"]]["primitives"][0]

    def attribute(self, name, semantic):
        return self.array(self.primitive(name)["attributes"][semantic])

    def garment(self, frame, semantic="POSITION"):
        """Garment vertices (V, 3) at a key frame, by the morph weights."""
        weights = self.keys[self.node("garment"), "weights"].reshape(len(self.times), -1)[frame]
        shape = self.attribute("garment", semantic).astype(float)
        for weight, target in zip(weights, self.primitive("garment")["targets"]):
            if weight:
                shape = shape + weight * self.array(target[semantic])
        return shape

    def transforms(self, frame):
        """World transforms of all nodes at a key frame, by their indices."""
        worlds = {}

        def descend(index, parent):
            node = self.json["nodes"][index]
            still = {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1], **node}
            t, q = (self.keys[index, path][frame] if (index, path) in self.keys else still[path]
                    for path in ("translation", "rotation"))
            local = np.eye(4)
            local[:3, :3], local[:3, 3] = rotation(np.asarray(q, float)), t
            worlds[index] = parent @ local
            for child in node.get("children", []):
                descend(child, worlds[index])

        for root in self.json["scenes"][self.json["scene"]]["nodes"]:
            descend(root, np.eye(4))
        return worlds

    def body(self, frame, sets=None):
        """Body vertices (B, 3) at a key frame, by the first `sets` sets of influences."""
        skin, worlds = self.json["skins"][0], self.transforms(frame)
        # glTF stores matrices by columns.
        inverse = self.array(skin["inverseBindMatrices"]).astype(float).transpose(0, 2, 1)
        world_from_bind = np.stack([worlds[j] @ m for j, m in zip(skin["joints"], inverse)])
        names = self.primitive("body")["attributes"]
        count = sum(name.startswith("JOINTS_") for name in names)
        count = min(count, sets or count)
        joints, weights = (np.concatenate([self.attribute("body", f"{what}_{i}") for i in range(count)], 1)
                           for what in ("JOINTS", "WEIGHTS"))
        weights = weights / weights.sum(axis=1, keepdims=True, dtype=float)
        rest = self.attribute("body", "POSITION").astype(float)
        moved = np.einsum("bkij,bj->bki", world_from_bind[joints][:, :, :3, :3], rest)
        moved += world_from_bind[joints][:, :, :3, 3]
        return np.einsum("bk,bki->bi", weights, moved)


def rotation(q):
    """Rotation matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = q
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * k + 2 * k @ k
