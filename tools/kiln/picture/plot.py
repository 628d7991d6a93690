#!/usr/bin/env python3
"""Draws the results of `kiln chart` and `kiln measure`. Needs matplotlib (Debian: python3-matplotlib).

    python3 plot.py DATA.json OUT.png     either may be -: standard input, standard output

The command passes this text by -c, and more words: other Pythons, for where this one has no
matplotlib. DATA.json says what to draw by its "kind":

    chart     seconds against errors: groups of panels of marks, each with its name beside it
    study     curves over views, faces or map size: a row of panels

Every size here is in pixels. The same data give the same bytes.
"""
import json
import os
import sys

try:
    import matplotlib
    import numpy as np
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator
    from matplotlib.transforms import IdentityTransform
except ImportError as missing:
    if sys.argv[0] == "-c" and sys.argv[3:] and hasattr(sys, "orig_argv"):
        script = sys.orig_argv[-len(sys.argv)]
        os.execv(sys.argv[3], [sys.argv[3], "-c", script, *sys.argv[1:3], *sys.argv[4:]])
    print(missing, file=sys.stderr)
    sys.exit(69)  # EX_UNAVAILABLE
# The build replaces this line by that file.
from plot_labels import box_around_mark, place_labels, shared_area

TEXT_COLOR, SOFT_COLOR, PALE_COLOR, GRID_COLOR = "#222222", "#555555", "#999999", "#d8d8d8"
FRONT_COLOR, RANGE_COLOR = "#f0c070", "#b0b0b0"
SMALL_FONT, NORMAL_FONT, LARGE_FONT, LARGEST_FONT = (size * 0.72 for size in (13, 15, 19, 24))  # points of 1/72 inch
DPI = 100


class Page:
    """A picture measured from its top left corner."""

    def __init__(self, width, height):
        self.width, self.height = round(width), round(height)
        self.figure = Figure((self.width / DPI, self.height / DPI), DPI, facecolor="white")
        self.renderer = FigureCanvasAgg(self.figure).get_renderer()

    def text(self, x, y, words, size=NORMAL_FONT, color=TEXT_COLOR, **look):
        return self.figure.text(x / self.width, 1 - y / self.height, words, size=size, color=color,
                                **{"va": "center", **look})

    def axes(self, x, y, width, height):
        return self.figure.add_axes((x / self.width, 1 - (y + height) / self.height,
                                     width / self.width, height / self.height))

    def extent(self, artist):
        """Left, bottom, right, top; upwards."""
        return np.array(artist.get_window_extent(self.renderer).extents)

    def legend(self, handles, y, loc, x=0.5):
        """Breaks a text into two lines if it is too wide."""
        for lines in (1, 2):
            made = self.figure.legend(handles=handles, loc=loc, frameon=False,
                                      ncol=-(-len(handles) // lines), fontsize=NORMAL_FONT, bbox_to_anchor=(x, y / self.height), borderpad=0,
                                      columnspacing=1.4, handletextpad=0.5)
            left, _, right, _ = self.extent(made)
            if lines == 2 or right - left <= self.width:
                return
            made.remove()

    def save(self, path):
        self.figure.savefig(sys.stdout.buffer if path == "-" else path, format="png", dpi=DPI,
                            metadata={"Software": None})


def style_axes(axes, x_title, y_title):
    axes.set_axisbelow(True)
    axes.grid(True, color=GRID_COLOR, linewidth=0.7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(SOFT_COLOR)
    axes.tick_params(labelsize=NORMAL_FONT, labelcolor=TEXT_COLOR, color=SOFT_COLOR)
    axes.set_xlabel(x_title, size=NORMAL_FONT, color=TEXT_COLOR, labelpad=6)
    axes.set_ylabel(y_title, size=NORMAL_FONT, color=TEXT_COLOR, labelpad=8)


def format_numbers(values):
    return [f"{value:,.6g}" for value in values]


def log_ticks(low, high):
    """Ticks at 1, 2 and 5 times powers of ten; other steps if these are too dense or too sparse."""
    for factors in ((1, 2, 5), (1,)):
        values = [float(f"{factor}e{power}") for power in range(-12, 13) for factor in factors]
        values = [value for value in values if low <= value <= high]
        if len(values) <= 12:
            break
    if len(values) < 3:
        values = [value for value in MaxNLocator(5).tick_values(low, high) if low <= value <= high]
    return values


def set_log(axes, side, low, high, ticks, labels=None):
    axis = getattr(axes, side + "axis")
    getattr(axes, f"set_{side}scale")("log")
    getattr(axes, f"set_{side}lim")(low, high)
    axis.set_ticks(ticks, labels=labels or format_numbers(ticks))
    axis.set_ticks([], minor=True)


# ---- chart ---------------------------------------------------------------------------------------
def error_axis(errors):
    """\\returns low, high, whether the axis is logarithmic and, if so, the position of 0 and of the break above it"""
    some = [error for error in errors if error > 0]
    has_zero = len(some) < len(errors)
    if not some:
        return 0, 1, False, None
    least, most = min(some), max(some)
    if most < 4 * least:
        margin = max(0.12 * (most - least), 0.02 * most)
        return -margin if has_zero else max(0, least - margin), most + margin, False, None
    step = (most / least) ** 0.1 * 1.05
    if not has_zero:
        return least / step, most * step, True, None
    zero = least / step ** 1.8
    return zero / step, most * step, True, (zero, least / step ** 0.8)


def mark_style(style):
    mark, color = style["mark"], style["color"]
    edge, width = (color, 2) if mark in "x+" else ("white", 0.6)
    return {"marker": mark, "color": color, "linestyle": "none", "markersize": 9,
            "markeredgecolor": edge, "markeredgewidth": width}


def draw_panel(page, data, panel, corner, size):
    marks = [{**mark, "runs": [max(run, 1e-9) for run in mark["runs"]]} for mark in panel["marks"]]
    low, high, is_log, broken = error_axis([mark["error"] for mark in marks])
    axes = page.axes(*corner, *size)
    style_axes(axes, panel.get("seconds_title", data["seconds_title"]) + " (logarithmic)",
               panel["unit"] + (" (logarithmic)" if is_log else " (not from 0)"))
    page.text(corner[0], corner[1] - 22, panel["title"])
    runs = [run for mark in marks for run in mark["runs"]]
    margin_factor = (max(runs) / min(runs)) ** 0.12 * 1.05
    least, most = min(runs) / margin_factor, max(runs) * margin_factor
    set_log(axes, "x", least, most, log_ticks(least, most))
    axes.set_ylim(low, high)
    if is_log:
        ticks = log_ticks(broken[1] if broken else low, high)
        zero, zero_text = ([broken[0]], ["0"]) if broken else ([], [])
        set_log(axes, "y", low, high, zero + ticks, zero_text + format_numbers(ticks))

    def pixel(mark, seconds=None):
        error = mark["error"] if mark["error"] > 0 or not broken else broken[0]
        return axes.transData.transform((max(seconds or mark["seconds"], 1e-9), error))

    def line(points, **look):
        axes.add_line(Line2D(*zip(*points), transform=IdentityTransform(), clip_on=False, **look))

    def words(x, y, text, **look):
        return axes.text(x, y, text, transform=IdentityTransform(), **look)

    left, bottom, right, top = page.extent(axes.patch)
    points = [pixel(mark) for mark in marks]
    kept = []
    if broken:
        y = axes.transData.transform((least, broken[1]))[1]
        line([(left, y), (right, y)], color="#888888", linewidth=1.2, linestyle="--")
        kept.append(page.extent(words(right - 8, y - 5, "below this line: no error at all (0)",
                                      ha="right", va="top", size=SMALL_FONT, color="#888888")))
    better = np.array([left + 4, bottom + 4, left + 138, bottom + 70])
    if not any(shared_area(better, box_around_mark(point)) > 0 for point in points):
        kept.append(better)
        axes.annotate("", (left + 14, bottom + 14), (left + 54, bottom + 54),
                      xycoords="figure pixels", textcoords="figure pixels",
                      arrowprops={"arrowstyle": "-|>", "color": "#bbbbbb", "linewidth": 2.2,
                                  "shrinkA": 0, "shrinkB": 0, "mutation_scale": 18})
        words(left + 62, bottom + 46, "better", color=PALE_COLOR, size=NORMAL_FONT)
    front = [pixel(mark) for mark in sorted(marks, key=lambda m: m["seconds"]) if mark["front"]]
    lines = list(zip(front, front[1:]))
    if front:
        line(front, color=FRONT_COLOR, linewidth=4, zorder=1.5)
    for mark, point in zip(marks, points):
        lines.append((pixel(mark, min(mark["runs"])), pixel(mark, max(mark["runs"]))))
        line(lines[-1], color=RANGE_COLOR, linewidth=1.2, zorder=1.8)
        style = next(style for style in data["styles"] if style["family"] == mark["family"])
        line([point], zorder=3, **mark_style(style))
    texts = [words(0, 0, mark["label"], ha="center", va="center_baseline", zorder=4, size=NORMAL_FONT,
                   color="#111111" if mark["front"] else SOFT_COLOR,
                   weight="bold" if mark["front"] else "normal") for mark in marks]
    boxes = [page.extent(text) for text in texts]
    sizes = [(box[2] - box[0] + 6, 20) for box in boxes]
    places = place_labels(points, sizes, (left + 4, bottom + 4, right - 4, top - 4), kept, lines)
    for text, point, (box, end) in zip(texts, points, places):
        text.set_position((box[:2] + box[2:]) / 2)
        if end is not None:
            line([point, end], color=PALE_COLOR, linewidth=0.8, zorder=1.9)


def draw_chart(data):
    width, head, foot, group_head, panel_height, panel_foot = 1900, 112, 64, 106, 520, 112
    left, between, right, columns = 130, 140, 30, 2
    heights = [group_head + (panel_height + panel_foot) * -(-len(group["panels"]) // columns)
               for group in data["groups"]]
    page = Page(width, head + foot + sum(heights))
    page.text(width / 2, 36, data["title"], LARGEST_FONT, ha="center")
    page.text(width / 2, 76, data["subtitle"], NORMAL_FONT, SOFT_COLOR, ha="center")
    panel_width = (width - left - between - right) / columns
    for k, group in enumerate(data["groups"]):
        top = head + sum(heights[:k])
        page.text(width / 2, top + 18, group["title"], LARGE_FONT, ha="center", weight="bold")
        page.text(width / 2, top + 46, group["note"], NORMAL_FONT, SOFT_COLOR, ha="center")
        for i, panel in enumerate(group["panels"]):
            corner = (left + i % columns * (panel_width + between),
                      top + group_head + i // columns * (panel_height + panel_foot))
            draw_panel(page, data, panel, corner, (panel_width, panel_height))
    page.legend([Line2D([], [], color=FRONT_COLOR, linewidth=4,
                        label="the best: nothing else is both faster and closer")] +
                [Line2D([], [], label=one["title"], **mark_style(one)) for one in data["styles"]],
                20, "lower center")
    return page


# ---- study ---------------------------------------------------------------------------------------
# Curves also differ in lightness and shape (colours by Okabe and Ito, distinguishable with colour blindness).
CURVE_STYLES = {"paper": ("#d55e00", "s", "-"), "kiln": ("#0072b2", "o", "-"),
         "ray": ("#333333", "^", "--"), "none": ("#888888", "D", ":"),
         "max": ("#7f3b08", "v", ":"), "p95": ("#d55e00", "s", "--"), "mean": ("#e69f00", "o", "-")}


def curve_look(look):
    """\\param look  a style name; a shade, 0 light to 1 dark, for ordered curves; or {"thin": shade} in the background"""
    if isinstance(look, dict):
        return {**curve_look(look["thin"]), "linewidth": 1, "markersize": 3.5, "alpha": 0.6}
    shade = None if isinstance(look, str) else np.array(
        [250 - 225 * look, 180 - 150 * look, 80 + 20 * look]) / 255
    color, marker, style = CURVE_STYLES[look] if shade is None else (tuple(shade), "o", "-")
    return {"color": color, "marker": marker, "linestyle": style, "linewidth": 2, "markersize": 7}


def named(axes, x, y, words, offset, size, color, **look):
    """Draws a text at an offset from a point."""
    axes.annotate(words, (x, y), offset, textcoords="offset points", size=size, color=color,
                  annotation_clip=False,
                  bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1},
                  **{"zorder": 4, **look})


def place_beside_point(axes, x, y, words, taken):
    """The offset of a short name from its point with the least overlap, and its box in pixels."""
    def box_at(offset):
        corner = axes.transData.transform((x, y)) + np.array(offset) * DPI / 72
        return np.concatenate([corner, corner + (8 * len(words) + 4, 14)])

    def covered_area(offset):
        return sum(shared_area(box_at(offset), other) for other in taken)

    best = min(((6, 3), (6, -11), (-26, 5), (6, 16), (6, -24), (-26, -14), (-16, 10), (-16, -20)),
               key=covered_area)
    return best, box_at(best)


def marks_of(axes, curves):
    """Boxes around the marks of curves in the foreground, in pixels."""
    return [np.concatenate([mark - 6, mark + 6]) for curve in curves
            if not isinstance(curve["look"], dict)
            for mark in axes.transData.transform(list(zip(curve["x"], curve["y"])))]


def name_rings(page, axes, panel, taken):
    """Places names of curves beside them, inside the panel and off other curves."""
    rings = panel["rings"]
    if not rings.get("labels"):
        return
    texts = [axes.text(0, 0, words, transform=IdentityTransform(), ha="center", zorder=4,
                       va="center_baseline", size=NORMAL_FONT, color="#00694d",
                       bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1})
             for words in rings["labels"]]
    boxes = [page.extent(text) for text in texts]
    sizes = [(box[2] - box[0] + 6, 20) for box in boxes]
    marks = axes.transData.transform(list(zip(rings["x"], rings["y"])))
    lines = []
    for curve in panel["curves"]:
        points = axes.transData.transform(list(zip(curve["x"], curve["y"])))
        lines += zip(points, points[1:])
    left, bottom, right, top = page.extent(axes.patch)
    places = place_labels(marks, sizes, (left + 4, bottom + 4, right - 4, top - 4), taken, lines)
    for text, mark, (box, end) in zip(texts, marks, places):
        text.set_position((box[:2] + box[2:]) / 2)
        if end is not None:
            axes.plot(*zip(mark, end), color="#00694d", linewidth=0.8, zorder=1.9,
                      transform=IdentityTransform())


def draw_study(data):
    panels, left, right, top, height, width = data["panels"], 110, 40, 90, 600, 780
    entries = max(len(panel["levels"]) + sum(not isinstance(curve["look"], dict)
                                             for curve in panel["curves"]) for panel in panels)
    page = Page(len(panels) * (left + width + right), top + height + 124 + 13 * entries)
    page.text(page.width / 2, 40, data["title"], LARGEST_FONT, ha="center")
    ticks = data["x_ticks"]
    for i, panel in enumerate(panels):
        axes = page.axes(i * (left + width + right) + left, top, width, height)
        values = [y for curve in panel["curves"] for y in curve["y"]]
        values += [level["y"] for level in panel["levels"]] + panel["rings"]["y"]
        is_log = min(values) > 0 and max(values) >= 3 * min(values)
        if "title" in panel:
            axes.set_title(panel["title"], size=NORMAL_FONT, color=TEXT_COLOR)
        style_axes(axes, data["x_title"] + " (logarithmic)",
                   panel["y_title"] + (" (logarithmic)" if is_log else ""))
        set_log(axes, "x", ticks[0] / 1.15, ticks[-1] * 1.15, ticks)
        if is_log:
            low, high = min(values) / 1.3, max(values) * 1.25
            set_log(axes, "y", low, high, log_ticks(low, high))
        else:
            axes.set_ylim(0, max(max(values) * 1.25, 1e-9))
        if "x_note" in data:
            axes.axvline(data["x_note"]["x"], color="#bbbbbb", linewidth=1.5, zorder=1)
            axes.text(data["x_note"]["x"] * 1.04, 0.98, data["x_note"]["text"], color="#777777",
                      va="top", size=NORMAL_FONT, transform=axes.get_xaxis_transform())
        taken = marks_of(axes, panel["curves"])  # names of thin curves are added below
        for curve in panel["curves"]:
            thin = isinstance(curve["look"], dict)  # its name is at its end, not in the legend
            axes.plot(curve["x"], curve["y"], label="_" if thin else curve["title"],
                      **curve_look(curve["look"]))
            if thin:
                place, box = place_beside_point(axes, curve["x"][-1], curve["y"][-1], curve["title"], taken)
                taken.append(box)
                named(axes, curve["x"][-1], curve["y"][-1], curve["title"], place, SMALL_FONT, SOFT_COLOR,
                      zorder=1.5)
        for level in panel["levels"]:
            look = {**curve_look(level["look"]), "marker": ""}
            axes.axhline(level["y"], label=level["title"], **look)
        if panel["rings"]["x"]:
            axes.plot(panel["rings"]["x"], panel["rings"]["y"], "o", markersize=16, color="#009e73",
                      markerfacecolor="none", markeredgewidth=2, label=panel["rings"]["title"])
        name_rings(page, axes, panel, taken)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -64 / height), ncol=2, frameon=False,
                    fontsize=NORMAL_FONT, borderpad=0, handlelength=2.6)
    return page


def draw(path):
    """\\returns the figure for a data file; None if there is no data"""
    matplotlib.rcdefaults()  # ignores the user's settings
    matplotlib.rcParams["text.parse_math"] = False  # names of meshes are not formulas
    if path == "-":
        text = sys.stdin.buffer.read()
    else:
        with open(path, "rb") as file:
            text = file.read()
    if not text:
        return None
    data = json.loads(text)
    return {"chart": draw_chart, "study": draw_study}[data["kind"]](data)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit("usage: python3 plot.py DATA.json OUT.png")
    page = draw(sys.argv[1])
    if page:
        page.save(sys.argv[2])
