"""Reads DDS and KTX2 that Kiln wrote by others' programs, and compares each with the PNG of the same map.

    for format in png16 dds ktx2; do kiln bake HIGH LOW --maps normal,ao,color --format $format --mips --out FOLDER; done
    python texture_readers.py FOLDER

    pip install numpy pillow zstandard

DDS by Pillow. KTX2 as its specification says, its levels by zstandard, and their texels again by Pillow, in a DDS. Of BC5 x
and y are compared. Prints the most that a map differs, in 255ths, and exits with 1 where a level is missing.
"""

import glob
import io
import os
import struct
import sys

import numpy as np
import zstandard
from PIL import Image

DXGI_BY_VK_FORMAT = {139: 80, 141: 83, 37: 28, 43: 29}  # DXGI formats by VkFormat: BC4, BC5, RGBA, sRGB
# side of a block in texels, and its bytes
BLOCK_SIZES = {139: (4, 8), 141: (4, 16), 37: (1, 4), 43: (1, 4)}


def make_dds(dxgi, width, height, texels):
    head = struct.pack("<4s7I11I", b"DDS ", 124, 0x81007, height, width, len(texels), 0, 1, *[0] * 11)
    pixels = struct.pack("<2I4s5I5I5I", 32, 4, b"DX10", *[0] * 5, 0x1000, *[0] * 4, dxgi, 3, 0, 1, 0)
    return Image.open(io.BytesIO(head + pixels + texels))


def read_ktx2_levels(path):
    data = open(path, "rb").read()
    assert data[:12] == b"\xABKTX 20\xBB\r\n\x1A\n"
    format, type_size, width, height, _, _, faces, count, packing = struct.unpack_from("<9I", data, 12)
    side, size = BLOCK_SIZES[format]
    assert packing in (0, 2) and type_size == 1 and faces == 1
    for number in range(count):
        at, length, whole = struct.unpack_from("<3Q", data, 80 + 24 * number)
        texels = data[at:at + length]
        if packing == 2:
            texels = zstandard.ZstdDecompressor().decompress(texels)
        wide, tall = max(1, width >> number), max(1, height >> number)
        assert len(texels) == whole == -(-wide // side) * -(-tall // side) * size
        yield make_dds(DXGI_BY_VK_FORMAT[format], wide, tall, texels)


def compare_pictures(name, png, image):
    there = np.asarray(Image.open(png)).astype(float)
    if there.max() > 255:
        there /= 257
    found = np.asarray(image).astype(float)
    if found.ndim == 2:
        found = found[..., None]
    if there.ndim == 2:
        there = there[..., None]
    assert found.shape[:2] == there.shape[:2], name
    channels = min(found.shape[2], there.shape[2], 2 if "normal" in name else 3)
    return np.abs(found[..., :channels] - there[..., :channels]).max()


failed = False
for png in sorted(glob.glob(os.path.join(sys.argv[1], "*.png"))):
    stem = png[:-4]
    if ".mip" in stem or not os.path.exists(stem + ".ktx2"):
        continue
    pngs = [png, *sorted(glob.glob(stem + ".mip*.png"))]
    levels = list(read_ktx2_levels(stem + ".ktx2"))
    failed = failed or len(levels) != len(pngs)
    most = [compare_pictures(stem, *pair) for pair in zip(pngs, levels)]
    first = compare_pictures(stem, png, Image.open(stem + ".dds"))
    print(f"{os.path.basename(stem)}: DDS {first:.1f}, KTX2 {max(most):.1f}, {len(levels)} of {len(pngs)} levels")
sys.exit(failed)
