"""Processor seconds of reading a GLB beside a PLY of the same mesh and its pictures alone.

    python glb_reading.py READ_BENCH FOLDER [FACES [SIDE]]    # default: 1,000,000 faces, pictures of 4096²

READ_BENCH is the program read_bench. Needs numpy and Pillow. Prints JSON; "over" is the GLB's time over the sum of
the others.
"""

import io
import json
import os
import struct
import subprocess
import sys

import numpy as np
from PIL import Image

BENCH, FOLDER = sys.argv[1:3]
FACES = int(sys.argv[3]) if len(sys.argv) > 3 else 1_000_000
SIDE = int(sys.argv[4]) if len(sys.argv) > 4 else 4096


def sphere():
    """Positions, normals, UVs and triangles of a bumpy sphere."""
    rings = round((FACES / 4) ** 0.5)
    v, u = np.meshgrid(np.linspace(0, 1, rings + 1), np.linspace(0, 1, 2 * rings + 1), indexing="ij")
    polar, around = np.pi * (0.01 + 0.98 * v), 2 * np.pi * u
    normals = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], -1)
    positions = normals * (1 + 0.02 * np.sin(40 * polar) * np.cos(40 * around))[..., None]
    corner = np.arange(rings)[:, None] * (2 * rings + 1) + np.arange(2 * rings)
    right, below = corner + 1, corner + 2 * rings + 1
    faces = np.stack([corner, right, below, right, below + 1, below], -1).reshape(-1, 3)
    flat = lambda a: a.reshape(-1, a.shape[-1]).astype("<f4")
    return flat(positions), flat(normals), flat(np.stack([u, v], -1)), faces.astype("<u4")


def picture(seed):
    """Broad waves and a little noise: packs to about half, as baked maps do."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    channels = [128 + 90 * np.sin(7 * (k + 1) * x + seed) * np.cos(9 * y) + rng.normal(0, 2, x.shape) for k in range(3)]
    return Image.fromarray(np.clip(np.stack(channels, -1), 0, 255).astype(np.uint8))


def write_ply(path, positions, normals, uvs, faces):
    names = ["x", "y", "z", "nx", "ny", "nz", "s", "t"]
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    with open(path, "wb") as file:
        file.write("\n".join(["ply", "format binary_little_endian 1.0", f"element vertex {len(positions)}",
                              *[f"property float {name}" for name in names], f"element face {len(faces)}",
                              "property list uchar int vertex_indices", "end_header\n"]).encode())
        file.write(np.hstack([positions, normals, uvs]).astype("<f4").tobytes() + rows.tobytes())


def write_glb(path, positions, normals, uvs, faces, pictures):
    parts = [positions.tobytes(), normals.tobytes(), uvs.tobytes(), faces.tobytes(), *pictures]
    views, body = [], b""
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": len(part)})
        body += part + bytes(-len(part) % 4)
    accessors = [{"bufferView": k, "componentType": 5126, "count": len(positions), "type": kind}
                 for k, kind in enumerate(["VEC3", "VEC3", "VEC2"])]
    accessors[0] |= {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
    accessors.append({"bufferView": 3, "componentType": 5125, "count": faces.size, "type": "SCALAR"})
    texture = [{"index": k} for k in range(4)]
    head = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3,
                                        "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": texture[0],
                                                    "metallicRoughnessTexture": texture[1]},
                           "normalTexture": texture[2], "emissiveTexture": texture[3],
                           "emissiveFactor": [1, 1, 1]}],
            "textures": [{"source": k} for k in range(4)],
            "images": [{"bufferView": 4 + k, "mimeType": "image/png"} for k in range(4)],
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(body)}]}
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(body), len(text), 0x4E4F534A))
        file.write(text + struct.pack("<II", len(body), 0x004E4942) + body)


os.makedirs(FOLDER, exist_ok=True)
mesh = sphere()
files = [os.path.join(FOLDER, name) for name in ["mesh.ply", "mesh.glb"] + [f"{k}.png" for k in range(4)]]
pictures = []
for k, file in enumerate(files[2:]):
    stream = io.BytesIO()
    picture(k).save(stream, "png")
    pictures.append(stream.getvalue())
    open(file, "wb").write(pictures[-1])
write_ply(files[0], *mesh)
write_glb(files[1], *mesh, pictures)
lines = subprocess.run([BENCH, "5", *files], check=True, capture_output=True, text=True).stdout.splitlines()
times = [json.loads(line)["cpu_s"] for line in lines]
bytes_of = [os.path.getsize(file) for file in files]
print(json.dumps({"benchmark": "glb_reading", "faces": len(mesh[3]), "pictures": f"4 of {SIDE}²",
                  "ply_cpu_s": times[0], "pictures_cpu_s": round(sum(times[2:]), 3), "glb_cpu_s": times[1],
                  "over": round(times[1] / (times[0] + sum(times[2:])), 2), "ply_bytes": bytes_of[0],
                  "pictures_bytes": sum(bytes_of[2:]), "glb_bytes": bytes_of[1]}))
