#!/usr/bin/env python3
"""Pages of `kiln view` in a headless Chromium: opened, turned, each switch clicked, pictures compared.

python3 view_test.py KILN     exit code 69 where Chromium or three.js is missing
"""

import http.server
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

KILN = os.path.abspath(sys.argv.pop())
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
THREE = pathlib.Path(os.environ.get("KILN_THREE") or "/usr/share/javascript/three")
FLAGS = ["--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-dev-shm-usage", "--window-size=640,480"]  # fmt: skip

# Clicks what a list names. Of each picture's right half it notes the mean and the deviation of the colours, the mean
# difference of neighbours (detail), and a hash; of the left half a hash.
ROBOT = """
<script>
(() => {
const steps = @STEPS@, pictures = {};
const waitFrames = (count) => new Promise((done) => {
  const wait = () => (count-- > 0 ? requestAnimationFrame(wait) : done());
  wait();
});
function look() {
  const from = document.querySelector("#view canvas"), to = document.createElement("canvas");
  to.width = 320; to.height = 240;
  const context = to.getContext("2d");
  context.drawImage(from, 0, 0, 320, 240);
  const data = context.getImageData(160, 0, 160, 240).data;
  const sum = [0, 0, 0], squares = [0, 0, 0];
  let hash = 0, shown = 0, detail = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (Math.abs(data[i] - 0x23) + Math.abs(data[i + 1] - 0x26) + Math.abs(data[i + 2] - 0x2b) < 6) continue;
    ++shown;
    if (i >= 640) detail += Math.abs(data[i + 1] - data[i - 639]);
    for (let c = 0; c < 3; ++c) { sum[c] += data[i + c]; squares[c] += data[i + c] ** 2; hash = (hash * 31 + data[i + c]) | 0; }
  }
  let left = 0;
  for (const value of context.getImageData(0, 0, 160, 240).data) left = (left * 31 + value) | 0;
  const mean = sum.map((s) => s / Math.max(1, shown));
  return { mean, shown, hash, left, detail: detail / Math.max(1, shown),
           deviation: squares.map((s, c) => Math.sqrt(Math.max(0, s / Math.max(1, shown) - mean[c] ** 2))) };
}
async function run() {
  while (!window.kiln.ready && !document.documentElement.dataset.failure) await new Promise((r) => setTimeout(r, 50));
  for (const [name, clicks] of steps) {
    for (const id of clicks) {
      if (id.includes("=")) {
        const [slider, value] = id.split("=");
        document.getElementById(slider).value = value;
      } else document.getElementById(id).click();
    }
    await waitFrames(3);
    pictures[name] = look();
  }
}
async function report() {
  let failure = null;
  try { await run(); } catch (error) { failure = String(error); }
  failure = document.documentElement.dataset.failure || failure;
  fetch("http://127.0.0.1:@PORT@/", { method: "POST", mode: "no-cors", body: JSON.stringify({ pictures, failure }) });
}
report();
})();
</script>
"""


def run_kiln(*words):
    done = subprocess.run([KILN, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"kiln {words}: {done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def write_ball(path):
    """A ball with waves, whose halves have two colours."""
    rows, columns = 60, 120
    lines = []
    for j in range(rows + 1):
        for i in range(columns):
            up, around = math.pi * j / rows, 2 * math.pi * i / columns
            radius = 1 + 0.03 * math.sin(8 * up) * math.sin(8 * around)
            x, y, z = math.sin(up) * math.cos(around), math.cos(up), math.sin(up) * math.sin(around)
            colour = (0.9, 0.2, 0.1) if y > 0 else (0.1, 0.3, 0.9)
            lines.append("v " + " ".join(f"{value:.6f}" for value in (radius * x, radius * y, radius * z, *colour)))
    for j in range(rows):
        for i in range(columns):
            a, b = j * columns + i + 1, j * columns + (i + 1) % columns + 1
            lines.append(f"f {a} {b} {b + columns} {a + columns}")
    path.write_text("\n".join(lines) + "\n")


def write_gltf(path, material, sets, images):
    """A square that faces +Z, with several sets of UVs and pictures of four texels: lists of four colours."""
    import base64
    import struct
    import zlib

    def png(colours):
        rows = b"".join(b"\0" + bytes(sum(colours[2 * y : 2 * y + 2], [])) for y in (0, 1))
        chunk = lambda name, data: (struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)))
        head = struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0)
        return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")

    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    parts = [struct.pack("<12f", *sum(corners, ())), struct.pack("<6H", 0, 1, 2, 0, 2, 3)]
    parts += [struct.pack("<8f", *sum(uvs, ())) for uvs in sets]
    data, views = b"", []
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    accessors += [{"bufferView": 2 + i, "componentType": 5126, "count": 4, "type": "VEC2"} for i in range(len(sets))]
    attributes = {"POSITION": 0, **{f"TEXCOORD_{i}": 2 + i for i in range(len(sets))}}
    uri = lambda kind, content: f"data:{kind};base64," + base64.b64encode(content).decode()
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1, "material": 0}]}],
        "materials": [{"name": "paint", **material}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": uri("application/octet-stream", data)}],
        "images": [{"uri": uri("image/png", png(image))} for image in images],
        "samplers": [{"magFilter": 9728, "minFilter": 9728}],
        "textures": [{"source": i, "sampler": 0} for i in range(len(images))],
    }))  # fmt: skip


RED, BLUE, WHITE, BLACK = [255, 0, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0]
WHOLE = [(0, 1), (1, 1), (1, 0), (0, 0)]
CORNER = [(0.1, 0.1)] * 4


def pictures_of(page, steps, folder):
    """What the robot saw: it sends its pictures to a server of this process."""
    received = []

    class Receiver(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            received.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Receiver) as server:
        server.timeout = 1
        robot = folder / "robot.html"
        text = ROBOT.replace("@STEPS@", json.dumps(steps)).replace("@PORT@", str(server.server_port))
        robot.write_text(page.read_text().replace("</html>", text + "</html>"))
        browser = subprocess.Popen([CHROMIUM, *FLAGS, f"--user-data-dir={folder / 'profile'}", robot.as_uri()],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # fmt: skip
        try:
            end = time.monotonic() + 240
            while not received and time.monotonic() < end and browser.poll() is None:
                server.handle_request()
        finally:
            browser.terminate()
            browser.wait()
    assert received, f"{page}: the page sent nothing"
    assert received[0]["failure"] is None, f"{page}: {received[0]['failure']}"
    return received[0]["pictures"]


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.ball = cls.folder / "ball.obj"
        write_ball(cls.ball)
        cls.glb = cls.folder / "ball.glb"
        run_kiln("bake", cls.ball, "--out", cls.glb, "--faces", 400, "--size", 256, "--ao-rays", 16)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def page(self, name, *words):
        page = self.folder / name
        run_kiln("view", *words, "--out", page)
        return page

    def test_each_switch_changes_the_picture(self):
        page = self.page("both.html", self.glb, "--reference", self.ball)
        steps = [("lit", []), ("wire", ["wire"]), ("flat", ["wire", "flat"]), ("again", ["flat"]),
                 ("dark", ["strength=20"]), ("turned", ["strength=100", "azimuth=-120"]), ("lit2", ["azimuth=40"]),
                 ("color", ["mode-color"]), ("normal", ["mode-normal"]), ("occlusion", ["mode-occlusion"]),
                 ("normals", ["mode-normals"]), ("error", ["mode-error"]), ("error_flat", ["flat"]),
                 ("alone", ["flat", "mode-lit", "split"]), ("spun", ["turn"])]  # fmt: skip
        found = pictures_of(page, steps, self.folder)
        for name, picture in found.items():
            self.assertGreater(picture["shown"], 2000, name)
            self.assertGreater(max(picture["deviation"]), 2, name)
        for one in ("again", "lit2"):
            self.assertEqual(found[one]["hash"], found["lit"]["hash"], one)
        for name in ("wire", "flat", "dark", "turned", "color", "normal", "occlusion", "normals", "error", "spun"):
            self.assertNotEqual(found[name]["hash"], found["lit"]["hash"], name)
        self.assertLess(sum(found["dark"]["mean"]), 0.6 * sum(found["lit"]["mean"]))
        # A normal map is blue; occlusion is grey.
        self.assertGreater(found["normal"]["mean"][2], found["normal"]["mean"][0] + 50)
        grey = found["occlusion"]["mean"]
        self.assertLess(max(grey) - min(grey), 3)
        # Red and blue halves.
        self.assertGreater(found["color"]["deviation"][0], 40)
        # The scale goes from dark blue to red: without the map the normals are farther off.
        self.assertGreater(found["error_flat"]["mean"][0], found["error"]["mean"][0] + 20)
        # Without its map the low poly has less detail.
        self.assertLess(found["flat"]["detail"], 0.97 * found["lit"]["detail"])
        # The bar parts the picture in halves: the low poly is to the right of it, and on both sides where it is alone.
        self.assertGreater(found["alone"]["shown"], 2000)
        self.assertEqual(found["alone"]["hash"], found["lit"]["hash"])
        self.assertNotEqual(found["alone"]["left"], found["lit"]["left"])

    def test_every_encoding_shows_the_same(self):
        plain = pictures_of(self.page("plain.html", self.glb), [("color", ["mode-color"]), ("lit", ["mode-lit"])], self.folder)
        for words in (("--format", "webp"), ("--format", "jpeg"), ("--mesh-compression", "meshopt"), ("--mesh-compression", "draco")):
            glb = self.folder / f"{words[1]}.glb"
            run_kiln("bake", self.ball, "--out", glb, "--faces", 400, "--size", 256, "--ao-rays", 16, *words)
            other = pictures_of(self.page(f"{words[1]}.html", glb), [("color", ["mode-color"]), ("lit", ["mode-lit"])], self.folder)
            for step, picture in other.items():
                for a, b in zip(picture["mean"], plain[step]["mean"]):
                    self.assertLess(abs(a - b), 3, f"{words[1]} {step}")

    def test_pictures_lie_on_the_uvs_that_their_material_names(self):
        """Those of another set than the first were drawn with the first."""
        file = self.folder / "sets.gltf"
        base = {"baseColorTexture": {"index": 0, "texCoord": 1}, "metallicFactor": 0}
        write_gltf(file, {"pbrMetallicRoughness": base}, [CORNER, WHOLE], [[RED, RED, BLUE, BLUE]])
        found = pictures_of(self.page("sets.html", file), [("color", ["mode-color", "azimuth=0"])], self.folder)["color"]
        self.assertGreater(found["deviation"][0], 60)
        self.assertGreater(found["deviation"][2], 60)

    def test_each_material_has_its_own_numbers(self):
        """Three squares with one material each: the page's data hold each one's factors, wraps, alpha and sides."""
        looks = [
            {"colour": [1, 0.5, 0.25], "rough": 0.25, "metal": 0.75, "emits": [0, 0.5, 0], "wrap": 10497, "sides": False},
            {"colour": [0.25, 1, 0.5], "rough": 0.5, "metal": 0.5, "emits": [0.5, 0, 0.25], "wrap": 33071, "sides": True},
            {"colour": [0.5, 0.25, 1], "rough": 0.75, "metal": 0.25, "emits": [0, 0, 1], "wrap": 33648, "sides": False},
        ]
        file = self.folder / "three.gltf"
        write_gltf(file, {}, [WHOLE], [[RED, BLUE, WHITE, BLACK]])
        document = json.loads(file.read_text())
        (mesh,) = document["meshes"]
        (primitive,) = mesh["primitives"]
        document["materials"], document["samplers"], document["textures"] = [], [], []
        for i, look in enumerate(looks):
            document["samplers"].append({"wrapS": look["wrap"], "wrapT": 10497})
            document["textures"].append({"source": 0, "sampler": i})
            document["materials"].append({
                "name": f"paint {i}", "doubleSided": look["sides"],
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*look["colour"], 1], "baseColorTexture": {"index": i},
                    "roughnessFactor": look["rough"], "metallicFactor": look["metal"]},
                "emissiveFactor": look["emits"], "emissiveTexture": {"index": i}})  # fmt: skip
        document["meshes"] = [{"primitives": [{**primitive, "material": i}]} for i in range(3)]
        document["nodes"] = [{"mesh": i, "translation": [3 * i, 0, 0]} for i in range(3)]
        document["scenes"] = [{"nodes": [0, 1, 2]}]
        file.write_text(json.dumps(document))
        text = self.page("three.html", file).read_text()
        (mesh,) = json.JSONDecoder().raw_decode(text[text.index('{"title":"') :])[0]["meshes"]
        self.assertEqual([material["name"] for material in mesh["materials"]], ["paint 0", "paint 1", "paint 2"])
        # A square each, of two triangles: first index, count, material.
        self.assertEqual(mesh["groups"], [[0, 6, 0], [6, 6, 1], [12, 6, 2]])
        names = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
        for look, material in zip(looks, mesh["materials"]):
            slots = material["slots"]
            for slot, value in (("color", look["colour"]), ("emission", look["emits"]),
                                ("roughness", [look["rough"]] * 3), ("metallic", [look["metal"]] * 3)):  # fmt: skip
                for ours, asked in zip(slots[slot]["value"], value):
                    self.assertAlmostEqual(ours, asked, 5, f"{material['name']}: {slot}")
            for slot in ("color", "emission"):
                self.assertEqual(slots[slot]["wrap"], [names[look["wrap"]], "repeat"])
            self.assertEqual(material["double_sided"], look["sides"])

    def test_pictures_on_a_second_set_are_left_out_with_a_word(self):
        file = self.folder / "two.gltf"
        base = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
        other = {"emissiveTexture": {"index": 1, "texCoord": 1}, "emissiveFactor": [1, 1, 1]}
        write_gltf(file, {"pbrMetallicRoughness": base, **other}, [WHOLE, CORNER], [[RED] * 4, [WHITE, BLACK, BLACK, BLACK]])
        page = self.folder / "two.html"
        self.assertRegex(run_kiln("view", file, "--out", page), "'paint': its picture of emission uses UV set 1.*left out")
        found = pictures_of(page, [("color", ["mode-color"])], self.folder)["color"]
        self.assertGreater(found["mean"][0], 200)

    def test_emission_and_opacity_without_colour_pictures_are_shown(self):
        file = self.folder / "glow.gltf"
        write_gltf(file, {"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [0, 1, 0]}, [WHOLE], [])
        found = pictures_of(self.page("glow.html", file), [("emission", ["mode-emission"])], self.folder)["emission"]
        self.assertGreater(found["mean"][1], found["mean"][0] + 150)
        # An OBJ's picture of opacity: the upper half is clear.
        write_gltf(self.folder / "mask.gltf", {}, [WHOLE], [[BLACK, BLACK, WHITE, WHITE]])
        picture = json.loads((self.folder / "mask.gltf").read_text())["images"][0]["uri"].split(",")[1]
        (self.folder / "mask.png").write_bytes(__import__("base64").b64decode(picture))
        for name, line in (("solid", ""), ("cut", "map_d mask.png\n")):
            (self.folder / f"{name}.mtl").write_text(f"newmtl paint\nKd 1 0 0\n{line}")
            corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
            (self.folder / f"{name}.obj").write_text(f"mtllib {name}.mtl\n{corners}usemtl paint\nf 1/1 2/2 3/3 4/4\n")
        shown = {
            name: pictures_of(self.page(f"{name}.html", self.folder / f"{name}.obj"), [("color", ["mode-color"])], self.folder)
            for name in ("solid", "cut")
        }
        # Filtered over its four texels, the picture lets half of the background through in the mean.
        self.assertLess(shown["cut"]["color"]["mean"][0], 0.75 * shown["solid"]["color"]["mean"][0])

    def test_lit_pictures_follow_the_material(self):
        black = {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}
        rough, smooth = ({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": r}} for r in (1, 0.3))
        glow = {"pbrMetallicRoughness": black, "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]}
        tilted = {"pbrMetallicRoughness": {"metallicFactor": 0}, "normalTexture": {"index": 0}}
        corner = {"KHR_texture_transform": {"offset": [0.1, 0.1], "scale": [0.1, 0.1]}}
        part = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": corner}, "metallicFactor": 0}}
        files = {
            "rough": (rough, []), "smooth": (smooth, []), "glow": (glow, [[BLUE] * 4]),
            "up": (tilted, [[[128, 218, 218]] * 4]), "down": (tilted, [[[128, 37, 218]] * 4]),
            "part": (part, [[RED, BLUE, BLUE, BLUE]]), "back": ({**rough, "doubleSided": True}, []),
        }  # fmt: skip
        found = {}
        for name, (material, images) in files.items():
            file = self.folder / f"lit_{name}.gltf"
            write_gltf(file, material, [WHOLE], images)
            if name == "back":
                turned = file.read_text().replace('"nodes": [{"mesh": 0}]', '"nodes": [{"mesh": 0, "rotation": [0, 1, 0, 0]}]')
                file.write_text(turned)
            found[name] = pictures_of(self.page(f"lit_{name}.html", file), [("lit", [])], self.folder)["lit"]
        self.assertNotEqual(found["rough"]["hash"], found["smooth"]["hash"])
        self.assertGreater(found["glow"]["mean"][2], 200)
        self.assertLess(found["glow"]["mean"][0], 30)
        # The light comes from above.
        self.assertGreater(found["up"]["mean"][0], found["down"]["mean"][0] + 20)
        # A tenth of the picture, at its red texel.
        self.assertGreater(found["part"]["mean"][0], found["part"]["mean"][2] + 50)
        self.assertGreater(found["back"]["shown"], 2000)

    def test_bakes_write_their_page(self):
        page, glb = self.folder / "new" / "bake.html", self.folder / "viewed.glb"
        run_kiln("bake", self.ball, "--out", glb, "--faces", 400, "--size", 128, "--maps", "normal", "--page", page)
        found = pictures_of(page, [("lit", []), ("error", ["mode-error"])], self.folder)  # HIGH is beside it
        self.assertNotEqual(found["lit"]["hash"], found["error"]["hash"])
        for words, part in ((["--out", "maps", "--page", "x.html"], "--page shows an asset"),
                            (["--out", "x.glb", "--page", "x.png"], "--page 'x.png'")):  # fmt: skip
            done = subprocess.run([KILN, "bake", str(self.ball), "--faces", "50", *words], capture_output=True, text=True,
                                  cwd=self.folder, check=False)  # fmt: skip
            self.assertEqual(done.returncode, 2)
            self.assertIn(part, done.stderr)
            self.assertFalse((self.folder / "x.glb").exists())

    def test_names_are_text(self):
        odd = self.folder / "a<b id=x>&'.glb"
        shutil.copy(self.glb, odd)
        page = self.page("odd.html", odd)
        text = page.read_text()
        self.assertNotIn("<b id=x>", text)
        self.assertNotIn("http://", re.sub(r"(?s)<script>.*?</script>", "", text))
        pictures_of(page, [("lit", [])], self.folder)

    def test_bad_input_is_told(self):
        for words, part in ((["no.glb", "--out", "x.html"], "no.glb"), ([self.glb, "--out", "x.htm"], ".html")):
            done = subprocess.run([KILN, "view", *map(str, words)], capture_output=True, text=True, cwd=self.folder, check=False)
            self.assertIn(done.returncode, (2, 3))
            self.assertIn(part, done.stderr)
        done = subprocess.run([KILN, "view", self.glb, "--out", self.folder / "x.html"], capture_output=True, text=True,
                              env={**os.environ, "KILN_THREE": "/nowhere"}, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 3)
        self.assertIn("libjs-three", done.stderr)
        self.assertFalse((self.folder / "x.html").exists())


if __name__ == "__main__":
    if CHROMIUM is None or not (THREE / "three.min.js").exists():
        print("skipped: there is no chromium, or no three.js (libjs-three)")
        sys.exit(69)
    unittest.main(verbosity=2)
