#!/usr/bin/env python3
"""Parts and pictures become height maps that the program presses. usage: shape_map_test.py MERKEL SOURCE_FOLDER"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np
from PIL import Image

merkel, source = sys.argv[1:]
tool = pathlib.Path(source) / "tools/shape_map"


def run(*arguments):
    return subprocess.run([str(a) for a in arguments], capture_output=True, text=True)


def png(columns, rows, text):
    """A picture of zeros in 16 bits, with a compressed comment of `text` bytes."""
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    def zeros(count):
        packer = zlib.compressobj(9)
        return b"".join(packer.compress(bytes(min(1 << 20, count - k))) for k in range(0, count, 1 << 20)) + packer.flush()
    lines = zeros(rows * (1 + 2 * columns) if rows < 20000 else 1 << 20)
    comment = chunk(b"zTXt", b"comment\0\0" + zeros(text)) if text else b""
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0)) + comment
            + chunk(b"IDAT", lines) + chunk(b"IEND", b""))


def stl(path, triangles):
    with open(path, "w") as file:
        file.write("solid part\n")
        for triangle in triangles:
            file.write("facet normal 0 0 1\nouter loop\n")
            for corner in triangle:
                file.write("vertex %g %g %g\n" % tuple(corner))
            file.write("endloop\nendfacet\n")
        file.write("endsolid part\n")


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    # A pyramid of 4 x 4 mm that stands on its apex, 1 mm deep, with a lid that is not seen from below.
    corners = [(-2, -2, 1), (2, -2, 1), (2, 2, 1), (-2, 2, 1)]
    sides = [[corners[k], corners[(k + 1) % 4], (0, 0, 0)] for k in range(4)]
    stl(folder / "part.stl", sides + [corners[:3], [corners[0], corners[2], corners[3]]])
    made = run(tool, folder / "part.stl", folder / "part.npy", "--pixel-mm", "0.1")
    assert made.returncode == 0 and "4 x 4 mm, heights to" in made.stdout and not made.stderr, made
    heights = np.load(folder / "part.npy")
    at = (np.arange(40) - 19.5) * 0.1
    wanted = np.maximum(np.abs(at)[None, :], np.abs(at)[:, None]) / 2
    assert np.allclose(heights, wanted - wanted.min(), atol=1e-6), np.abs(heights - wanted).max()

    # The same part lying on its side: up is the old z.
    turned = [[(z, x, y) for x, y, z in t] for t in sides]
    stl(folder / "side.stl", turned)
    assert run(tool, folder / "side.stl", folder / "side.npy", "--pixel-mm", "0.1", "--up", "x").returncode == 0
    assert np.allclose(np.load(folder / "side.npy"), heights, atol=1e-6)

    (folder / "s.toml").write_text('[[probe]]\ntip = "shape"\nshape = "part.npy"\npixel_mm = 0.1\n')
    pressed = run(merkel, "inspect", "contact", "--scene", folder / "s.toml", "--depth-mm", "0.5")
    assert pressed.returncode == 0, pressed.stderr

    picture = np.zeros((30, 40), np.uint16)
    picture[0, :] = 65535  # the upper edge touches: the largest y, the last row
    Image.fromarray(picture).save(folder / "map.png")
    made = run(tool, folder / "map.png", folder / "map.npy", "--pixel-mm", "0.1", "--relief-mm", "0.5")
    assert made.returncode == 0, made.stderr
    assert (np.load(folder / "map.npy") == np.r_[np.full((29, 40), 0.5), np.zeros((1, 40))]).all()

    Image.fromarray(picture.astype(np.uint8)).save(folder / "coarse.png")
    (folder / "own.npy").write_bytes((folder / "map.png").read_bytes())
    (folder / "bad.stl").write_text("solid part\nendsolid part\n")
    (folder / "huge.stl").write_text((folder / "part.stl").read_text().replace("vertex 2 ", "vertex 1e30 "))
    (folder / "folder.npy").mkdir()
    for name, columns, rows, text in (("bomb", 60000, 60000, 0), ("large", 9000, 9000, 0), ("text", 4, 4, 1 << 23)):
        (folder / f"{name}.png").write_bytes(png(columns, rows, text))
    for arguments, sentence in (
            (("bomb.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "1"), "60000 x 60000 pixels"),
            (("large.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "1"), "scale it down"),
            (("text.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "1"), "export it again"),
            (("map.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "-1"), "--relief-mm must be above 0"),
            (("map.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "nan"), "--relief-mm must be above 0"),
            (("map.png", "m.npy", "--pixel-mm", "1e-300", "--relief-mm", "1"), "--pixel-mm must be from"),
            (("part.stl", "m.npy", "--pixel-mm", "1e-300"), "--pixel-mm must be from"),
            (("huge.stl", "m.npy", "--pixel-mm", "0.1"), "export the part in mm"),
            (("part.stl", "folder.npy", "--pixel-mm", "0.1"), "Is a directory"),
            (("part.stl", "none/m.npy", "--pixel-mm", "0.1"), "No such file"),
            (("own.npy", "own.npy", "--pixel-mm", "0.1", "--relief-mm", "1"), "would be destroyed"),
            (("map.png", "map.npy", "--pixel-mm", "0.1"), "add --relief-mm"),
            (("coarse.png", "m.npy", "--pixel-mm", "0.1", "--relief-mm", "1"), "export it as 16-bit grey PNG"),
            (("bad.stl", "m.npy", "--pixel-mm", "0.1"), "export the part again"),
            (("part.stl", "m.npy", "--pixel-mm", "0.0001"), "increase --pixel-mm"),
            (("part.stl", "m.csv", "--pixel-mm", "0.1"), "must end in .npy")):
        refused = run(tool, folder / arguments[0], folder / arguments[1], *arguments[2:])
        assert refused.returncode == 1 and sentence in refused.stderr, (arguments, refused)
        assert refused.stderr.count("\n") == 1 and not list(folder.glob("*.part")), (arguments, refused)
    assert (folder / "own.npy").read_bytes() == (folder / "map.png").read_bytes()
print("height maps of parts and pictures are right")
