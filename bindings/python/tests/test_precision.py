"""Contract: a number format that is slower than f32 on this processor is a warning, and only if the caller
names it. Fields with fewer than 64 channels are fastest in f32 on every processor."""

import json
import struct
import warnings

import numpy as np
import pytest
import unic

WIDTH = 32


def narrowed(content):
    """A model file whose field has the first WIDTH channels of each hidden layer."""
    (length,) = struct.unpack("<Q", content[:8])
    header, data = json.loads(content[8 : 8 + length]), content[8 + length :]
    metadata = header.pop("__metadata__")
    about = json.loads(metadata["unic"])
    about.pop("checksum", None)
    about["config"]["field"]["width"] = WIDTH
    last = about["config"]["field"]["hidden_layers"]
    out, parts, start = {"__metadata__": {**metadata, "unic": json.dumps(about)}}, [], 0
    for name, tensor in header.items():
        part = data[slice(*tensor["data_offsets"])]
        if name.startswith("field."):
            layer = int(name.split(".")[1])
            array = np.frombuffer(part, np.float32).reshape(tensor["shape"])
            array = array if layer == last else array[:WIDTH]
            array = array[:, :WIDTH] if array.ndim == 2 and layer > 0 else array
            part, tensor = array.tobytes(), {**tensor, "shape": array.shape}
        out[name] = {**tensor, "data_offsets": [start, start + len(part)]}
        start += len(part)
        parts.append(part)
    text = json.dumps(out).encode()
    return struct.pack("<Q", len(text)) + text + b"".join(parts)


@pytest.fixture(scope="module")
def narrow(model_path):
    return unic.Model.from_bytes(narrowed(model_path.read_bytes()))


def test_a_slow_format_is_a_warning(narrow):
    for name in ("bf16", "int16", "int8"):
        text = f"{name} is slower than f32 on this processor for a field of {WIDTH} channels, and less exact"
        with pytest.warns(UserWarning, match=text):
            assert narrow.with_precision(name).precision == name
        with pytest.warns(UserWarning, match=text):
            unic.Animator(narrow, precision=name)


def test_the_choice_of_the_library_is_none(narrow):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in ("auto", "f32"):
            assert narrow.with_precision(name).precision == "f32"
            unic.Animator(narrow, precision=name)


def test_a_line_of_a_program_warns_once(narrow):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(3):
            narrow.with_precision("int8")
    assert len(caught) == 1


def test_a_warning_that_is_an_error_stops_the_call(narrow):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match="slower than f32"):
            narrow.with_precision("int8")
