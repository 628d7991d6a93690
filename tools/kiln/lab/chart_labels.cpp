#include "lab/chart_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace kiln::cli {
namespace {

constexpr int kAngles = 24;
constexpr std::array<double, 11> kGaps = {4, 12, 24, 38, 54, 74, 98, 130, 170, 220, 280};  // pixels
constexpr double kLeaderGap = 10;
constexpr int kSweeps = 30;

// Costs: what is never wanted by far above what is merely not nice.
constexpr double kOutside = 1e7, kOnLabel = 1e5, kOnMark = 3e4, kOnKept = 3e4, kOnLine = 800;
constexpr double kLeaderOnMark = 2000, kLeadersCross = 3000, kLeaderOnLabel = 5000;
constexpr double kNearerOther = 600;  // without a leader, one would read it as the other's
constexpr double kAPixelAway = 6;

double shared_area(const Box& a, const Box& b) {
  const double x = (a.width + b.width) / 2 - std::abs(a.center.x - b.center.x);
  const double y = (a.height + b.height) / 2 - std::abs(a.center.y - b.center.y);
  return x > 0 && y > 0 ? x * y : 0;
}

Box around(const Point& p, double radius) { return {p, 2 * radius, 2 * radius}; }

/// The part of a line inside a box, 0 to 1 of its length (Liang and Barsky 1984).
double inside(const Line& line, const Box& box) {
  double enter = 0;
  double leave = 1;
  const auto clip = [&](double from, double to, double middle, double size) {
    const double step = to - from;
    const double low = middle - size / 2 - from;
    const double high = middle + size / 2 - from;
    if (step == 0) {
      if (low > 0 || high < 0) leave = -1;
      return;
    }
    enter = std::max(enter, std::min(low / step, high / step));
    leave = std::min(leave, std::max(low / step, high / step));
  };
  clip(line.from.x, line.to.x, box.center.x, box.width);
  clip(line.from.y, line.to.y, box.center.y, box.height);
  return std::max(0.0, leave - enter);
}

double distance(const Point& p, const Box& box) {
  return std::hypot(std::max(0.0, std::abs(p.x - box.center.x) - box.width / 2),
                    std::max(0.0, std::abs(p.y - box.center.y) - box.height / 2));
}

bool cross(const Line& a, const Line& b) {
  const auto side = [](const Line& l, const Point& p) {
    return (l.to.x - l.from.x) * (p.y - l.from.y) - (l.to.y - l.from.y) * (p.x - l.from.x);
  };
  return side(a, b.from) * side(a, b.to) < 0 && side(b, a.from) * side(b, a.to) < 0;
}

struct Candidate {
  Box box;
  Line leader;
  bool has_leader = false;
  double alone = 0;  ///< Cost without the other labels
};

class Placement {
 public:
  Placement(const std::vector<Point>& marks, const std::vector<Box>& sizes, const LabelScene& scene)
      : marks_(marks), scene_(scene), candidates_(marks.size()), chosen_(marks.size(), 0) {
    for (std::size_t i = 0; i < marks.size(); ++i) make_candidates(i, sizes[i]);
  }

  std::vector<PlacedLabel> run() {
    for (std::size_t i = 0; i < marks_.size(); ++i) choose(i, i);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      bool changed = false;
      for (std::size_t i = 0; i < marks_.size(); ++i) {
        changed = choose(i, marks_.size()) || changed;
      }
      if (!changed) break;
    }
    // Where one still covers something, it may be another that must give way.
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      if (cost_of(i, chosen_[i], marks_.size()) >= std::min(kOnMark, kOnKept)) push_others(i);
    }
    std::vector<PlacedLabel> result;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const Candidate& c = candidates_[i][chosen_[i]];
      result.push_back({c.box, c.has_leader});
    }
    return result;
  }

 private:
  void make_candidates(std::size_t i, const Box& size) {
    for (const double gap : kGaps) {
      for (int k = 0; k < kAngles; ++k) {
        const double angle = 2 * std::numbers::pi * k / kAngles;
        const double dx = std::cos(angle);
        const double dy = std::sin(angle);
        // The box touches the circle of the gap: its support in that direction added.
        const double reach = scene_.mark_radius + gap;
        Candidate c;
        c.box = size;
        c.box.center = {marks_[i].x + dx * reach + std::clamp(2 * dx, -1.0, 1.0) * size.width / 2,
                        marks_[i].y + dy * reach + std::clamp(2 * dy, -1.0, 1.0) * size.height / 2};
        const Point nearest = {std::clamp(marks_[i].x, c.box.center.x - size.width / 2,
                                          c.box.center.x + size.width / 2),
                               std::clamp(marks_[i].y, c.box.center.y - size.height / 2,
                                          c.box.center.y + size.height / 2)};
        c.has_leader = gap >= kLeaderGap;
        c.leader = {marks_[i], nearest};
        c.alone = cost_alone(i, c, gap);
        candidates_[i].push_back(c);
      }
    }
  }

  double cost_alone(std::size_t i, const Candidate& c, double gap) const {
    double cost = kAPixelAway * gap;
    const Box& p = scene_.panel;
    if (std::abs(c.box.center.x - p.center.x) > (p.width - c.box.width) / 2 ||
        std::abs(c.box.center.y - p.center.y) > (p.height - c.box.height) / 2) {
      cost += kOutside;
    }
    for (const Box& kept : scene_.kept) {
      if (overlap(kept, c.box)) cost += kOnKept;
    }
    for (const Line& line : scene_.lines) {
      const double length =
          std::hypot(line.to.x - line.from.x, line.to.y - line.from.y) * inside(line, c.box);
      if (length > 0) cost += kOnLine + 10 * length;
    }
    for (std::size_t k = 0; k < marks_.size(); ++k) {
      const Box mark = around(marks_[k], scene_.mark_radius);
      if (overlap(mark, c.box)) cost += kOnMark;
      if (k != i && distance(marks_[k], c.box) < distance(marks_[i], c.box) + 6) {
        cost += c.has_leader ? kNearerOther / 4 : kNearerOther;
      }
      if (k != i && c.has_leader && inside(c.leader, mark) > 0) cost += kLeaderOnMark;
    }
    // Beside a mark reads better than above or below it.
    cost += 30 * std::abs(c.box.center.y - marks_[i].y) / (c.box.height + scene_.mark_radius);
    return cost;
  }

  double cost_with(const Candidate& a, const Candidate& b) const {
    double cost = 0;
    if (overlap(a.box, b.box)) cost += kOnLabel + shared_area(a.box, b.box);
    if (a.has_leader && b.has_leader && cross(a.leader, b.leader)) cost += kLeadersCross;
    if (a.has_leader && inside(a.leader, b.box) > 0) cost += kLeaderOnLabel;
    if (b.has_leader && inside(b.leader, a.box) > 0) cost += kLeaderOnLabel;
    return cost;
  }

  /// Of a label at one of its places beside the first `count` others.
  double cost_of(std::size_t i, std::size_t place, std::size_t count) const {
    const Candidate& candidate = candidates_[i][place];
    double cost = candidate.alone;
    for (std::size_t k = 0; k < count; ++k) {
      if (k != i) cost += cost_with(candidate, candidates_[k][chosen_[k]]);
    }
    return cost;
  }

  double total() const {
    double cost = 0;
    for (std::size_t i = 0; i < marks_.size(); ++i) cost += cost_of(i, chosen_[i], i);
    return cost;
  }

  /// Tries every place for a label with the labels in its way moved to their next best.
  void push_others(std::size_t i) {
    const std::size_t count = marks_.size();
    std::vector<std::size_t> best = chosen_;
    double least = total();
    const std::vector<std::size_t> before = chosen_;
    for (std::size_t c = 0; c < candidates_[i].size(); ++c) {
      if (candidates_[i][c].alone >= least) continue;
      chosen_ = before;
      chosen_[i] = c;
      for (std::size_t k = 0; k < count; ++k) {
        if (k != i && overlap(candidates_[k][chosen_[k]].box, candidates_[i][c].box)) {
          choose(k, count);
        }
      }
      const double cost = total();
      if (cost < least) {
        least = cost;
        best = chosen_;
      }
    }
    chosen_ = best;
  }

  /// The best of a label's places beside the first `count` others. \returns whether it moved
  bool choose(std::size_t i, std::size_t count) {
    std::size_t best = chosen_[i];
    double least = -1;
    for (std::size_t c = 0; c < candidates_[i].size(); ++c) {
      const double cost = cost_of(i, c, count);
      // The present one is kept among equals, so that the search ends.
      if (least < 0 || cost < least || (cost == least && c == chosen_[i])) {
        least = cost;
        best = c;
      }
    }
    const bool moved = best != chosen_[i];
    chosen_[i] = best;
    return moved;
  }

  const std::vector<Point>& marks_;
  const LabelScene& scene_;
  std::vector<std::vector<Candidate>> candidates_;
  std::vector<std::size_t> chosen_;
};

}  // namespace

bool overlap(const Box& a, const Box& b) { return shared_area(a, b) > 0; }

std::vector<PlacedLabel> place_labels(const std::vector<Point>& marks,
                                      const std::vector<Box>& sizes, const LabelScene& scene) {
  return Placement(marks, sizes, scene).run();
}

}  // namespace kiln::cli
