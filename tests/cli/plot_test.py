#!/usr/bin/env python3
"""The pictures of tools/kiln/picture/plot.py: sizes, colours, and that words stand clear of each other.

    python3 plot_test.py FOLDER        of plot.py; exit code 69 where matplotlib is missing
"""
import io
import itertools
import json
import os
import random
import sys
import tempfile
import unittest

sys.path.insert(0, sys.argv.pop())
import matplotlib.image  # noqa: E402
import plot  # noqa: E402
import plot_labels  # noqa: E402
from plot import np  # noqa: E402


def page_of(data):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "x_plot.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(data, file)
        return plot.draw(path)


def pixels_of(page):
    buffer = io.BytesIO()
    page.figure.savefig(buffer, format="png", dpi=plot.DPI, metadata={"Software": None})
    data = buffer.getvalue()
    return data, (matplotlib.image.imread(io.BytesIO(data))[..., :3] * 255).round().astype(int)


def words_on(page):
    """Every word that is drawn, with its box."""
    page.figure.canvas.draw()
    ticks, shown = set(), set()
    for axes in page.figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            labels = axis.get_ticklabels()
            ticks.update(labels)
            shown.update(label for place, label in zip(axis.get_majorticklocs(), labels)
                         if low <= place <= high)
    return [(text.get_text(), page.extent(text))
            for text in page.figure.findobj(plot.matplotlib.text.Text)
            if text.get_visible() and text.get_text() and (text not in ticks or text in shown)]


class Legible(unittest.TestCase):
    def expect_legible(self, page, at_least):
        words = words_on(page)
        self.assertGreaterEqual(len(words), at_least)
        for text, box in words:
            inside = (box[:2] >= 0).all() and box[2] <= page.width and box[3] <= page.height
            self.assertTrue(inside, f"'{text}' leaves the page: {box}")
        for (one, a), (two, b) in itertools.combinations(words, 2):
            self.assertEqual(plot_labels.shared_area(a, b), 0, f"'{one}' and '{two}' overlap")


def chart(errors, seed=1):
    """\\param errors  of a panel each: the least, and powers of ten that they span"""
    some = random.Random(seed)
    panels = []
    for least, span in errors:
        marks = []
        for i in range(19):
            seconds = 0.05 * 40 ** some.random() if i % 2 else 0.25 * (1 + 0.2 * some.random())
            marks.append({"label": f"{i} views of 1024²", "family": "ab"[i % 2],
                          "seconds": seconds, "front": i < 2,
                          "runs": [seconds * 0.95, seconds, seconds * 1.1],
                          "error": least * 10 ** (span * some.random())})
        panels.append({"name": "x", "title": "The error", "unit": "Mean, % of the diagonal",
                       "marks": marks})
    panels[0]["marks"][3]["error"] = 0
    styles = [{"family": "a", "title": "one", "mark": "o", "color": "#0072b2"},
              {"family": "b", "title": "two", "mark": "x", "color": "#d55e00"}]
    return {"kind": "chart", "title": "Title", "subtitle": "Subtitle", "seconds_title": "Seconds",
            "styles": styles, "groups": [{"title": "bunny_$high$", "note": "", "panels": panels}]}


class Chart(Legible):
    ERRORS = ((0.2, 1.3), (2, 0.2), (0.0982, 0.003), (0.0000123, 1))

    def test_words_stand_clear(self):
        page = page_of(chart(self.ERRORS))
        self.assertEqual((page.width, page.height), (1900, 112 + 64 + 106 + 2 * (520 + 112)))
        self.expect_legible(page, 4 * 19 + 4 * 8)

    def test_legends_too_wide_for_a_line_take_two(self):
        for count, lines in ((3, 1), (10, 2)):
            data = chart(self.ERRORS[:1])
            data["styles"] += [{"family": "c", "title": f"a rather long name, {i}", "mark": "o",
                                "color": "#0072b2"} for i in range(count - 2)]
            page = page_of(data)
            page.figure.draw(page.renderer)  # texts have no places before
            legend, = page.figure.legends
            self.assertEqual(len({round(page.extent(text)[1]) for text in legend.get_texts()}), lines)
            self.assertGreaterEqual(page.extent(legend)[0], 0)
            self.assertLessEqual(page.extent(legend)[2], page.width)

    def test_same_bytes(self):
        data = chart(self.ERRORS[:1])
        one, pixels = pixels_of(page_of(data))
        self.assertEqual(one, pixels_of(page_of(data))[0])
        self.assertEqual(pixels.shape, (112 + 64 + 106 + 520 + 112, 1900, 3))
        self.assertNotIn(b"matplotlib", one.lower())


class Labels(unittest.TestCase):
    def test_beside_its_mark_where_there_is_room(self):
        (box, end), = plot_labels.place_labels([(400, 300)], [(100, 20)], (0, 0, 800, 600))
        self.assertIsNone(end)
        self.assertAlmostEqual((box[1] + box[3]) / 2, 300)
        self.assertLess(min(abs(box[0] - 400), abs(box[2] - 400)), 20)

    def test_none_covers_another(self):
        for seed in range(3):
            some = random.Random(seed)
            marks = np.array([(some.gauss(400, 60), some.gauss(300, 40)) for _ in range(20)])
            kept = [np.array([10, 10, 150, 90])]
            places = plot_labels.place_labels(marks, [(110, 20)] * 20, (0, 0, 800, 600), kept)
            boxes = [box for box, _ in places]
            for box in boxes:
                self.assertTrue((box[:2] >= 0).all() and box[2] <= 800 and box[3] <= 600)
                self.assertEqual(plot_labels.shared_area(box, kept[0]), 0)
            for one, two in itertools.combinations(boxes, 2):
                self.assertEqual(plot_labels.shared_area(one, two), 0, seed)

    def test_avoids_lines(self):
        line = [(np.array([400.0, 300]), np.array([800.0, 300]))]
        (box, _), = plot_labels.place_labels([(400, 300)], [(100, 20)], (0, 0, 800, 600), (), line)
        self.assertLessEqual(box[2], 400)


class Study(Legible):
    def test_words_stand_clear(self):
        ticks = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48]
        no_rings = {"title": "", "x": [], "y": []}
        panel = {"y_title": "Mean angle between normals, degrees", "rings": no_rings,
                 "curves": [{"title": "paper: least depth difference", "look": "paper", "x": ticks,
                             "y": [30 / x + 2 for x in ticks]},
                            {"title": "Kiln: best angle, refined", "look": "kiln", "x": ticks,
                             "y": [20 / x + 1 for x in ticks]}],
                 "levels": [{"title": "rays", "look": "ray", "y": 1.1},
                            {"title": "no map", "look": "none", "y": 12}]}
        data = {"kind": "study", "title": "Title", "x_title": "Views", "x_ticks": ticks,
                "x_note": {"x": 12, "text": "12: the paper's choice"}, "panels": [panel, panel]}
        page = page_of(data)
        self.expect_legible(page, 2 * (11 + 3 + 4 + 1))
        self.assertEqual(page.width, 1860)
        rings = {"title": "larger maps gain less than 5%", "x": [4], "y": [8]}
        curves = [{"title": f"{k} faces", "look": k / 5, "x": ticks, "y": [k + 3 for _ in ticks]}
                  for k in range(6)]
        single = {**panel, "curves": curves, "levels": [], "rings": rings}
        self.expect_legible(page_of({**data, "panels": [single]}), 11 + 3 + 7)


if __name__ == "__main__":
    unittest.main()
