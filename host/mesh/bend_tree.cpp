#include "mesh/bend_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "mesh/ball_clip.h"

namespace kiln {
namespace {

constexpr std::size_t kLeaf = 4;      // triangles
constexpr double kFinest = 1.0 / 16;  // of the radius: half the diagonal of boxes not opened
// A box whose diagonal is so many radii lies in no ball: 2, and what rounding could take.
constexpr double kSurelyWider = 2.001;
constexpr float kFlat = 0;
// Leaves that a ball clips, or a group of balls begins at; those too large for a ball count as four, since
// they come in needles and sheets. Seen: 344 small ones (the bunny, radius 10%), 169 large (a bracket).
constexpr std::size_t kMostLeaves = 800;
constexpr std::size_t kLarge = 4;
constexpr std::size_t kMostBoxes = 64;  // of one level, where a ball has more leaves

/// Squared distances from 0 to a box.
double nearest(const Vec3d& low, const Vec3d& high) {
  const Vec3d way{std::max({low.x, -high.x, 0.0}), std::max({low.y, -high.y, 0.0}),
                  std::max({low.z, -high.z, 0.0})};
  return dot(way, way);
}
double farthest(const Vec3d& low, const Vec3d& high) {
  const Vec3d way{std::max(-low.x, high.x), std::max(-low.y, high.y), std::max(-low.z, high.z)};
  return dot(way, way);
}

}  // namespace

BendTree::BendTree(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   std::span<const std::uint8_t> usable,
                   std::span<const std::array<float, 3>> angle)
    : positions_(positions), triangles_(triangles), angle_(angle) {
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (usable[t] == 0) continue;
    Vec3d sum;
    for (const std::uint32_t corner : triangles[t]) sum += Vec3d(positions[corner]);
    const Vec3 centre = to_float(sum * (1.0 / 3));
    order_.push_back({{centre.x, centre.y, centre.z}, t});
  }
  while (order_.size() >> levels_ > kLeaf) ++levels_;
  for (std::uint32_t level = 0; level < levels_; ++level) {
    for_each_of(level, [&](std::size_t i) { split(level, i); });
  }
  nodes_.resize((std::size_t{2} << levels_) - 1);
  whole_.resize(order_.size());
  for_each_of(levels_, [&](std::size_t i) { fill_leaf(i); });
  for (std::uint32_t level = levels_; level-- > 0;) {
    for_each_of(level, [&](std::size_t i) { join(first_of(level) + i); });
  }
}

std::vector<std::uint32_t> BendTree::places(std::span<const std::uint32_t> place) const {
  std::vector<std::uint32_t> found;
  std::vector<std::uint8_t> seen(place.size());
  for (const Item& item : order_) {
    for (const std::uint32_t corner : triangles_[item.triangle]) {
      if (std::exchange(seen[place[corner]], 1) == 0) found.push_back(place[corner]);
    }
  }
  return found;
}

bool BendTree::lies_in_no_ball(const Node& node, double radius) {
  return length(Vec3d(node.high) - Vec3d(node.low)) > radius * kSurelyWider;
}

void BendTree::begin(const Vec3d& low, const Vec3d& high, double radius, Room& room) const {
  room.boxes.clear();
  room.crowded = false;
  if (order_.empty()) return;
  std::array<std::size_t, 66> stack{};  // one level leaves one behind
  std::size_t height = 1, leaves = 0;
  while (height != 0) {
    const std::size_t at = stack[--height];
    const Node& node = nodes_[at];
    ++room.steps;
    // Rounded as within() rounds, so what is left out here is left out there.
    if (nearest(Vec3d(node.low) - high, Vec3d(node.high) - low) >= radius * radius) continue;
    const bool opens = lies_in_no_ball(node, radius);
    if (!opens || at >= first_of(levels_)) {
      room.boxes.push_back(at);
      leaves += opens ? kLarge : 0;
      if (leaves <= kMostLeaves) continue;
      // Each ball looks for its own: the points lie far apart, or much is long.
      room.boxes.assign(1, 0);
      return;
    }
    stack[height++] = 2 * at + 2;
    stack[height++] = 2 * at + 1;
  }
}

BendSums BendTree::within(const Vec3d& centre, double radius, Room& room) const {
  BendSums sums;
  std::array<std::size_t, 66> stack{};  // one level leaves one behind
  std::size_t height = 0, leaves = 0;
  for (std::size_t box = 0; !room.crowded && (height != 0 || box < room.boxes.size());) {
    const std::size_t at = height != 0 ? stack[--height] : room.boxes[box++];
    ++room.steps;
    if (settled(nodes_[at], centre, radius, sums)) continue;
    if (at >= first_of(levels_)) {
      const std::size_t leaf = at - first_of(levels_);
      for (std::size_t i = begin_of(levels_, leaf); i < begin_of(levels_, leaf + 1); ++i) {
        sums += clipped(i, centre, radius * radius);
        ++room.steps;
      }
      leaves += lies_in_no_ball(nodes_[at], radius) ? kLarge : 1;
      room.crowded = leaves > kMostLeaves;  // and so for the rest of the group
    } else {
      stack[height++] = 2 * at + 2;
      stack[height++] = 2 * at + 1;
    }
  }
  return room.crowded ? by_levels(centre, radius, room) : sums;
}

/// The sums in a ball, all boxes of a level before those of the next, as long as they are few.
BendSums BendTree::by_levels(const Vec3d& centre, double radius, Room& room) const {
  BendSums sums;
  const double squared = radius * radius;
  room.front.assign(1, 0);
  for (std::uint32_t level = 0; !room.front.empty(); ++level) {
    room.steps += room.front.size();
    room.next.clear();
    for (const std::size_t at : room.front) {
      if (!settled(nodes_[at], centre, radius, sums)) room.next.push_back(at);
    }
    if (level < levels_ && room.next.size() <= kMostBoxes / 2) {
      room.front.clear();
      for (const std::size_t at : room.next) {
        room.front.push_back(2 * at + 1);
        room.front.push_back(2 * at + 2);
      }
      continue;
    }
    for (const std::size_t at : room.next) {
      const std::size_t i = at - first_of(level);
      const std::size_t middle = (begin_of(level, i) + begin_of(level, i + 1)) / 2;
      const Shares share = shares(middle, centre, squared);
      sums += {nodes_[at].sums.area * share.area, nodes_[at].sums.bend * share.bend};
    }
    room.steps += room.next.size();
    break;
  }
  return sums;
}

/// Adds what is known of a box without opening it. \returns whether that is all of it
bool BendTree::settled(const Node& node, const Vec3d& centre, double radius, BendSums& sums) const {
  const double squared = radius * radius;
  const Vec3d low = Vec3d(node.low) - centre, high = Vec3d(node.high) - centre;
  if (nearest(low, high) >= squared) return true;
  if (farthest(low, high) <= squared) {
    sums += node.sums;
    return true;
  }
  const double half = length(high - low) / 2;
  if (half >= radius * kFinest) return false;
  const double away = length(low + high) / 2;
  const double share = std::clamp((radius + half - away) / (2 * half), 0.0, 1.0);
  sums += {node.sums.area * share, node.sums.bend * share};
  return true;
}

template <typename Body>
void BendTree::for_each_of(std::uint32_t level, const Body& body) const {
  // Some thousand triangles a piece, so that threads are worth it.
  const std::size_t grain = 1 + (std::size_t{1} << 13) / (1 + (order_.size() >> level));
  parallel_for(std::size_t{1} << level, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Halves a node's triangles along the widest side of their centres' box.
void BendTree::split(std::uint32_t level, std::size_t i) {
  const auto at = [&](std::size_t item) {
    return order_.begin() + static_cast<std::ptrdiff_t>(item);
  };
  const auto begin = at(begin_of(level, i)), end = at(begin_of(level, i + 1));
  const auto middle = at(begin_of(level + 1, 2 * i + 1));
  std::array<float, 3> low = begin->centre, high = low;
  for (auto item = begin; item != end; ++item) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], item->centre[k]);
      high[k] = std::max(high[k], item->centre[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  std::nth_element(begin, middle, end, [axis](const Item& a, const Item& b) {
    return std::tie(a.centre[axis], a.triangle) < std::tie(b.centre[axis], b.triangle);
  });
}

void BendTree::fill_leaf(std::size_t leaf) {
  Node& node = nodes_[first_of(levels_) + leaf];
  const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(begin_of(levels_, leaf));
  const auto end = order_.begin() + static_cast<std::ptrdiff_t>(begin_of(levels_, leaf + 1));
  // The order of sums is not left to nth_element.
  std::sort(begin, end, [](const Item& a, const Item& b) { return a.triangle < b.triangle; });
  constexpr float kFar = std::numeric_limits<float>::infinity();
  node.low = {kFar, kFar, kFar};
  node.high = {-kFar, -kFar, -kFar};
  for (auto item = begin; item != end; ++item) {
    for (const std::uint32_t corner : triangles_[item->triangle]) {
      widen(node, positions_[corner], positions_[corner]);
    }
    const auto number = static_cast<std::size_t>(item - order_.begin());
    whole_[number] = whole(item->triangle);
    node.sums += whole_[number];
  }
}

void BendTree::join(std::size_t at) {
  const Node& right = nodes_[2 * at + 2];
  nodes_[at] = nodes_[2 * at + 1];
  widen(nodes_[at], right.low, right.high);
  nodes_[at].sums += right.sums;
}

void BendTree::widen(Node& node, const Vec3& low, const Vec3& high) {
  node.low = {std::min(node.low.x, low.x), std::min(node.low.y, low.y),
              std::min(node.low.z, low.z)};
  node.high = {std::max(node.high.x, high.x), std::max(node.high.y, high.y),
               std::max(node.high.z, high.z)};
}

std::array<Vec3d, 3> BendTree::corners(std::uint32_t triangle, const Vec3d& from) const {
  const Triangle& t = triangles_[triangle];
  return {Vec3d(positions_[t[0]]) - from, Vec3d(positions_[t[1]]) - from,
          Vec3d(positions_[t[2]]) - from};
}

BendSums BendTree::whole(std::uint32_t triangle) const {
  const std::array<Vec3d, 3> p = corners(triangle, {});
  BendSums sums{length(cross(p[1] - p[0], p[2] - p[0])) / 2, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    sums.bend += angle_[triangle][k] * length(p[(k + 1) % 3] - p[k]) / 4;
  }
  return sums;
}

BendSums BendTree::clipped(std::size_t item, const Vec3d& centre, double squared) const {
  const std::uint32_t triangle = order_[item].triangle;
  const std::array<Vec3d, 3> p = corners(triangle, centre);
  const auto [x_low, x_high] = std::minmax({p[0].x, p[1].x, p[2].x});
  const auto [y_low, y_high] = std::minmax({p[0].y, p[1].y, p[2].y});
  const auto [z_low, z_high] = std::minmax({p[0].z, p[1].z, p[2].z});
  if (nearest({x_low, y_low, z_low}, {x_high, y_high, z_high}) >= squared) return {};
  if (std::all_of(p.begin(), p.end(), [&](const Vec3d& c) { return dot(c, c) <= squared; })) {
    return whole_[item];
  }
  BendSums sums{area_within(p, squared), 0};
  for (std::size_t k = 0; k < 3; ++k) {
    if (angle_[triangle][k] == kFlat) continue;
    const Vec3d& q = p[(k + 1) % 3];
    const auto [begin, end] = part_within(p[k], q, squared);
    if (end > begin) sums.bend += angle_[triangle][k] * (end - begin) * length(q - p[k]) / 4;
  }
  return sums;
}

/// One triangle's, for all of its box: of its bend by lengths and the angles' sizes, since angles of
/// both signs may add up to nothing.
BendTree::Shares BendTree::shares(std::size_t item, const Vec3d& centre, double squared) const {
  const std::uint32_t triangle = order_[item].triangle;
  const std::array<Vec3d, 3> p = corners(triangle, centre);
  const double area = std::min(1.0, area_within(p, squared) / whole_[item].area);
  double inside = 0, all = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d& q = p[(k + 1) % 3];
    const double weight = std::abs(double{angle_[triangle][k]}) * length(q - p[k]);
    const auto [begin, end] = part_within(p[k], q, squared);
    inside += std::max(0.0, end - begin) * weight;
    all += weight;
  }
  return {area, all > 0 ? inside / all : area};
}

}  // namespace kiln
