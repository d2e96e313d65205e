"""The viewer's server as its tests use it: scenes, and a client that says and hears what a page would."""

import io
import json
import math
import struct
import time
import urllib.request
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Pillow
from viewer_page import MODELS, SCENE

pytest.importorskip("uvicorn", reason="the extra viewer is not installed")

from websockets.sync.client import connect

from renderer import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene
from renderer.viewer.viewpoint import camera_of

# Seconds for an answer that should come at once: what a machine with other work may take.
PATIENCE = 120.0
# 16,272 faces: by brute force 256 x 256 pixels take seconds, and a tile of them a tenth of one.
HEAVY = f"""{SCENE}
[[objects]]
mesh = "{MODELS / "teapot.ply"}"
material = "red"
translate = [0.0, 0.0, -1.0]
"""
# What reflects and lets light through by constants, which a file can set to nothing.
PLAIN = SCENE.replace('type = "dielectric"', "diffuse = 0.2\ntransmittance = 0.6\nior = 1.3")
SIZE = {"w": 200, "h": 150}
LONG = {"mode": "brute", "w": 256, "h": 256}


@dataclass
class Got:
    """A binary message: its header, and its payload."""

    kind: int
    seq: int
    step: int
    last: int
    w: int
    rows: int
    first: int
    h: int
    ms: float
    rate: float
    payload: bytes

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """The picture of a message of kind 1, or its band."""
        rgba = np.frombuffer(self.payload, np.uint8).reshape(self.rows, self.w, 4)
        assert self.kind == 1 and (rgba[..., 3] == 255).all()
        return rgba[..., :3]


class Client:
    """A page, as far as the server can tell."""

    def __init__(self, url: str) -> None:
        origin = url.rstrip("/")
        self.connection = connect(f"{origin.replace('http', 'ws')}/ws", origin=origin, max_size=None)
        self.seq = 0

    def __enter__(self) -> "Client":
        self.socket = self.connection.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self.connection.__exit__(*error)

    def send(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def view(self, eye: tuple[float, float, float] = (0.5, 2.6, 5.5), **changes: Any) -> int:
        self.seq += 1
        self.send(**{"type": "view", "seq": self.seq, "mode": "octree", **looking(eye), **SIZE, **changes})
        return self.seq

    def next(self, timeout: float = PATIENCE) -> Got | dict[str, Any]:
        message = self.socket.recv(timeout)
        if isinstance(message, str):
            return json.loads(message)
        return Got(*struct.unpack("<8I2f", message[:40]), message[40:])

    def acknowledge(self, got: Got) -> None:
        self.send(type="ack", seq=got.seq, step=got.step)

    def told(self, kind: str) -> dict[str, Any]:
        """The next text message, which is of that type; pictures before it are acknowledged."""
        while isinstance(message := self.next(), Got):
            self.acknowledge(message)
        assert message["type"] == kind, message
        return message

    def passes(self, seq: int) -> list[Got]:
        """All pictures up to the last of view ``seq``, acknowledged."""
        pictures = []
        while not (pictures and pictures[-1].seq == seq and pictures[-1].last):
            message = self.next()
            if isinstance(message, Got):
                pictures.append(message)
                self.acknowledge(message)
            else:
                assert message["type"] in ("progress", "legend"), message
        return pictures

    def final(self, **changes: Any) -> Got:
        return self.passes(self.view(**changes))[-1]


def camera(eye: tuple[float, float, float]) -> PerspectiveCamera:
    return PerspectiveCamera(eye=eye, target=(0.0, 0.5, 0.0), fov=38.0)


def looking(eye: tuple[float, float, float]) -> dict[str, Any]:
    right, up, forward = camera(eye).frame()
    return {"m": [*right, 0.0, *up, 0.0, *-forward, 0.0, *eye, 1.0], "fovy": math.radians(38.0)}


def rendered(scene: Scene, eye: tuple[float, float, float] = (0.5, 2.6, 5.5), **options: Any) -> Any:
    """What ``render`` gives for the camera that ``Client.view`` sends."""
    view = looking(eye)
    seen = scene.model_copy(update={"camera": camera_of(view["m"], view["fovy"])})
    return render(seen, **{"resolution": (200, 150), "max_depth": 6, **options})


def seen_by(shown: dict[str, Any], scene: Scene, **options: Any) -> Any:
    """What ``render`` gives for the camera and the size that a page reports."""
    camera = camera_of(shown["m"], shown["fovy"], height=shown.get("height"))
    return render(scene, camera=camera, **{"resolution": (shown["w"], shown["h"]), **options})


def fetched(url: str, path: str) -> bytes:
    with urllib.request.urlopen(url + path, timeout=PATIENCE) as answer:
        return answer.read()


def wait_for(happened: Any, seconds: float) -> None:
    end = time.monotonic() + seconds
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.01)


def decoded(file: bytes) -> Any:
    """The pixels of a picture's file."""
    return np.asarray(Pillow.open(io.BytesIO(file)).convert("RGB"))


def frames(file: bytes) -> list[Any]:
    """The pixels of each picture of a GIF or a WebP."""
    opened = Pillow.open(io.BytesIO(file))
    seen: list[Any] = []
    for i in range(opened.n_frames):
        opened.seek(i)
        seen.append(np.asarray(opened.convert("RGB")))
    return seen
