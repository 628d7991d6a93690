"""Placement of labels beside marks without overlaps: a part of plot.py.

Local search over places around each mark (after Christensen, Marks and Shieber 1995, "An Empirical
Study of Algorithms for Point-Feature Label Placement"). A box: left, bottom, right, top; upwards.
"""
import random

import numpy as np

MARK_RADIUS = 10  # of a mark, pixels
LABEL_GAPS, ANGLE_COUNT, LEADER_GAP, TRIED_ORDERS = (4, 12, 24, 38, 54, 74, 98, 130, 170, 220, 280), 20, 10, 6
# Costs of a label's place: unreadable labels cost far more than flaws of the layout.
COST_LABEL_OUTSIDE, COST_LABEL_ON_LABEL, COST_LABEL_ON_MARK, COST_LABEL_ON_CURVE = 1e7, 1e5, 3e4, 800
COST_LEADER_ON_LABEL, COST_LEADERS_CROSS, COST_LEADER_ON_MARK, COST_NEARER_OTHER = 5000, 3000, 2000, 600


def shared_area(a, b):
    sides = np.minimum(a[..., 2:], b[..., 2:]) - np.maximum(a[..., :2], b[..., :2])
    return np.prod(np.maximum(sides, 0), axis=-1)


def share_inside_box(start, end, box):
    """The part of a line inside a box, 0 to 1 of its length (Liang and Barsky 1984)."""
    step = np.where(end == start, 1e-9, end - start)
    one, two = (box[..., :2] - start) / step, (box[..., 2:] - start) / step
    enter = np.maximum(np.minimum(one, two).max(-1), 0)
    return np.maximum(np.minimum(np.maximum(one, two).min(-1), 1) - enter, 0)


def segments_cross(a, b, c, d):
    def side(p, q, r):
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)


def box_around_mark(mark):
    return np.concatenate([mark - MARK_RADIUS, mark + MARK_RADIUS])


class LabelPositions:
    """Candidate places of one label: boxes, ends of leader lines, whether a leader is needed, and costs without other labels."""

    def __init__(self, mark, size, marks, panel, kept, lines):
        angle = np.tile(2 * np.pi * np.arange(ANGLE_COUNT) / ANGLE_COUNT, len(LABEL_GAPS))
        gap = np.repeat(np.array(LABEL_GAPS, float), ANGLE_COUNT)
        toward = np.stack([np.cos(angle), np.sin(angle)], -1)
        center = mark + toward * (MARK_RADIUS + gap)[:, None] + np.clip(2 * toward, -1, 1) * size / 2
        self.boxes = boxes = np.concatenate([center - size / 2, center + size / 2], -1)
        self.ends = np.clip(mark, boxes[:, :2], boxes[:, 2:])
        self.mark, self.leader, self.known = mark, gap >= LEADER_GAP, {}
        # Labels beside a mark are easier to read than labels above or below it.
        cost = 6 * gap + 30 * np.abs(center[:, 1] - mark[1]) / (size[1] + MARK_RADIUS)
        cost += COST_LABEL_OUTSIDE * ((boxes[:, :2] < panel[:2]) | (boxes[:, 2:] > panel[2:])).any(-1)
        for box in list(kept) + [box_around_mark(other) for other in marks]:
            cost += COST_LABEL_ON_MARK * (shared_area(boxes, box) > 0)
        for start, end in lines:
            length = np.hypot(*(end - start)) * share_inside_box(start, end, boxes)
            cost += np.where(length > 0, COST_LABEL_ON_CURVE + 10 * length, 0)
        own = np.hypot(*(self.ends - mark).T)
        for other in marks:
            if (other == mark).all():
                continue
            away = np.hypot(*(np.clip(other, boxes[:, :2], boxes[:, 2:]) - other).T)
            cost += COST_NEARER_OTHER * (away < own + 6) / np.where(self.leader, 4, 1)
            cost += COST_LEADER_ON_MARK * (self.leader & (share_inside_box(mark, self.ends, box_around_mark(other)) > 0))
        self.cost = cost

    def cost_next_to(self, other, place):
        """Additional cost of each place if another label is at a given place of its own."""
        if (other, place) not in self.known:
            box, end = other.boxes[place], other.ends[place]
            area = shared_area(self.boxes, box)
            cost = np.where(area > 0, COST_LABEL_ON_LABEL + area, 0)
            cost += COST_LEADER_ON_LABEL * (self.leader & (share_inside_box(self.mark, self.ends, box) > 0))
            if other.leader[place]:
                cost += COST_LEADER_ON_LABEL * (share_inside_box(other.mark, end, self.boxes) > 0)
                cost += COST_LEADERS_CROSS * (self.leader & segments_cross(self.mark, self.ends, other.mark, end))
            self.known[other, place] = cost
        return self.known[other, place]


def place_labels(marks, sizes, panel, kept=(), lines=()):
    """\\returns for each mark the label's box, and the end of a line to it or None"""
    marks = np.array(marks, float)
    labels = [LabelPositions(mark, np.array(size, float), marks, np.array(panel), kept, lines)
              for mark, size in zip(marks, sizes)]
    best, least = {}, np.inf
    for order in range(TRIED_ORDERS):  # orders of labels: each leads to another local minimum
        label_order = list(range(len(labels)))
        random.Random(order).shuffle(label_order)
        chosen, costs, before = {}, {}, None
        for _ in range(30):
            if chosen == before:
                break
            before = dict(chosen)
            for i in label_order:
                cost = labels[i].cost.copy()
                for k, place in chosen.items():
                    if k != i:
                        cost += labels[i].cost_next_to(labels[k], place)
                # A place of equal cost does not replace the current one, so that the search terminates.
                if i not in chosen or cost.min() < cost[chosen[i]]:
                    chosen[i] = int(cost.argmin())
                costs[i] = cost[chosen[i]]
        if sum(costs.values()) < least:
            best, least = chosen, sum(costs.values())
    return [(label.boxes[best[i]], label.ends[best[i]] if label.leader[best[i]] else None)
            for i, label in enumerate(labels)]
