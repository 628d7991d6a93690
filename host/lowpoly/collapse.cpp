#include "lowpoly/collapse.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/parallel.h"

namespace kiln {
namespace {

/// Weight of the planes that stand on open borders, against a triangle's own.
constexpr double border_weight = 10;
/// Share of the squared edge length that counts as deviation: where the surface is flat, short edges
/// go first and triangles stay even.
constexpr double length_weight = 1e-5;
/// Collapses that leave bad shapes wait until they are this much cheaper than good ones. Refusing
/// them for good would leave the slivers of a dense mesh (at a sphere's poles) to stay as they are.
constexpr double penalty = 6;
constexpr std::uint32_t most_lenient = 2;
/// Cosine of the largest turn of a triangle in one collapse, by leniency.
constexpr std::array<double, 3> turn_limits{0.5, 0.2, 0.0};
/// Quality below which a triangle must not get worse. 1: equilateral; 0: no area.
constexpr double quality_limit = 0.35;
/// Vertices with more triangles wait until nothing else is left: each look at them costs as many.
constexpr std::uint32_t valence_limit = 256;

/// Sides of a height field's rectangle.
constexpr std::uint8_t kLeft = 1, kRight = 2, kBottom = 4, kTop = 8;

double quality(const Vec3d& a, const Vec3d& b, const Vec3d& c, double doubled_area) {
  const Vec3d ab = b - a, bc = c - b, ca = a - c;
  return 2 * std::sqrt(3.0) * doubled_area / (dot(ab, ab) + dot(bc, bc) + dot(ca, ca));
}

}  // namespace

void EdgeCollapser::Quadric::add_plane(const Vec3d& n, const Vec3d& through, double weight) {
  const double d = -dot(n, through);
  xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z;
  yy += weight * n.y * n.y, yz += weight * n.y * n.z, zz += weight * n.z * n.z;
  x += weight * n.x * d, y += weight * n.y * d, z += weight * n.z * d;
  c += weight * d * d;
}

EdgeCollapser::Quadric& EdgeCollapser::Quadric::operator+=(const Quadric& o) {
  xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
  x += o.x, y += o.y, z += o.z, c += o.c, area += o.area;
  return *this;
}

double EdgeCollapser::Quadric::at(const Vec3d& p) const {
  const double value = p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
                       p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + c;
  return std::max(value, 0.0);
}

bool EdgeCollapser::Entry::operator<(const Entry& o) const {
  return std::tie(cost, a, b) > std::tie(o.cost, o.a, o.b);
}

EdgeCollapser::EdgeCollapser(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                             bool height_field)
    : points_(positions.begin(), positions.end()),
      triangles_(triangles.begin(), triangles.end()),
      alive_(triangles.size(), 1),
      quadrics_(positions.size()),
      stamps_(positions.size(), 0),
      valence_(positions.size(), 0),
      around_(positions.size()),
      faces_(triangles.size()) {
  for (const Triangle& t : triangles_) {
    for (const std::uint32_t vertex : t) ++valence_[vertex];
  }
  for (std::size_t v = 0; v < around_.size(); ++v) around_[v].reserve(valence_[v]);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (const std::uint32_t vertex : triangles_[t]) around_[vertex].push_back(t);
  }
  if (height_field) find_sides();
  build_quadrics();
  fill_heap();
}

void EdgeCollapser::find_sides() {
  Vec3d low = points_.empty() ? Vec3d{} : points_[0], high = low;
  for (const Vec3d& p : points_) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), 0};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), 0};
  }
  sides_.reserve(points_.size());
  for (const Vec3d& p : points_) {
    sides_.push_back(
        static_cast<std::uint8_t>((p.x == low.x ? kLeft : 0) | (p.x == high.x ? kRight : 0) |
                                  (p.y == low.y ? kBottom : 0) | (p.y == high.y ? kTop : 0)));
  }
}

void EdgeCollapser::build_quadrics() {
  struct Side {
    std::uint64_t key;
    std::uint32_t triangle;
  };
  std::vector<Side> sides;
  sides.reserve(triangles_.size() * 3);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const Triangle& v = triangles_[t];
    const Vec3d normal = cross(points_[v[1]] - points_[v[0]], points_[v[2]] - points_[v[0]]);
    const double length = std::sqrt(dot(normal, normal));
    Quadric quadric;
    quadric.area = length / 6;  // A third of the area for each corner.
    if (length > 0) quadric.add_plane(normal * (1 / length), points_[v[0]], quadric.area);
    for (std::size_t k = 0; k < 3; ++k) {
      quadrics_[v[k]] += quadric;
      const std::uint64_t a = v[k], b = v[(k + 1) % 3];
      sides.push_back({a < b ? a << 32 | b : b << 32 | a, t});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].key == sides[begin].key) ++end;
    if (end - begin != 1) continue;
    const auto a = static_cast<std::uint32_t>(sides[begin].key >> 32);
    const auto b = static_cast<std::uint32_t>(sides[begin].key);
    const Triangle& v = triangles_[sides[begin].triangle];
    const Vec3d edge = points_[b] - points_[a];
    Vec3d normal = cross(edge, cross(points_[v[1]] - points_[v[0]], points_[v[2]] - points_[v[0]]));
    normal = normal * (1 / std::sqrt(dot(normal, normal)));
    if (!std::isfinite(normal.x + normal.y + normal.z)) continue;
    for (const std::uint32_t vertex : {a, b}) {
      quadrics_[vertex].add_plane(normal, points_[a], border_weight * dot(edge, edge) / 2);
    }
  }
}

/// All edges, each once, as lower vertex << 32 | higher vertex, in order.
std::vector<std::uint64_t> EdgeCollapser::edges() const {
  // Half-edges bucketed by their lower vertex; the few in a bucket are then sorted.
  std::vector<std::uint32_t> start(points_.size() + 1, 0);
  const auto each = [&](const auto& body) {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (alive_[t] == 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
        body(std::min(a, b), std::max(a, b));
      }
    }
  };
  each([&](std::uint32_t a, std::uint32_t) { ++start[a + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  std::vector<std::uint32_t> higher(start.back()), next(start.begin(), start.end() - 1);
  each([&](std::uint32_t a, std::uint32_t b) { higher[next[a]++] = b; });
  std::vector<std::uint64_t> result;
  result.reserve(higher.size() / 2 + 1);
  for (std::size_t a = 0; a + 1 < start.size(); ++a) {
    const auto first = higher.begin() + start[a], last = higher.begin() + start[a + 1];
    std::sort(first, last);
    for (auto b = first; b != last; ++b) {
      if (b == first || *b != *(b - 1)) result.push_back(std::uint64_t{a} << 32 | *b);
    }
  }
  return result;
}

EdgeCollapser::Entry EdgeCollapser::entry_for(std::uint32_t a, std::uint32_t b) const {
  Quadric sum = quadrics_[a];
  sum += quadrics_[b];
  const Vec3d edge = points_[b] - points_[a];
  const double cost = sum.at(best_point(a, b, sum)) + length_weight * dot(edge, edge) * sum.area;
  return {cost, a, b, stamps_[a], stamps_[b], 0};
}

void EdgeCollapser::fill_heap() {
  const std::vector<std::uint64_t> all = edges();
  heap_.resize(all.size());
  parallel_for(all.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      heap_[i] =
          entry_for(static_cast<std::uint32_t>(all[i] >> 32), static_cast<std::uint32_t>(all[i]));
    }
  });
  std::make_heap(heap_.begin(), heap_.end());
}

void EdgeCollapser::push(std::uint32_t a, std::uint32_t b) {
  heap_.push_back(entry_for(std::min(a, b), std::max(a, b)));
  std::push_heap(heap_.begin(), heap_.end());
}

Vec3d EdgeCollapser::best_point(std::uint32_t a, std::uint32_t b, const Quadric& q) const {
  const Vec3d& pa = points_[a];
  const Vec3d& pb = points_[b];
  if (!sides_.empty() && (sides_[a] | sides_[b]) != 0) {
    // Along the side that one of them lies on; a corner stays.
    const Vec3d& fixed = sides_[a] >= sides_[b] ? pa : pb;
    const auto on = static_cast<std::uint8_t>(sides_[a] | sides_[b]);
    const bool x_fixed = (on & (kLeft | kRight)) != 0, y_fixed = (on & (kBottom | kTop)) != 0;
    if (x_fixed && y_fixed) return fixed;
    Vec3d best = free_point(pa, pb, q);
    (x_fixed ? best.x : best.y) = x_fixed ? fixed.x : fixed.y;
    return best;
  }
  return free_point(pa, pb, q);
}

Vec3d EdgeCollapser::free_point(const Vec3d& pa, const Vec3d& pb, const Quadric& q) {
  const Vec3d middle = (pa + pb) * 0.5;
  // Solve for the step from the middle, with a slight pull towards it: it decides where the planes
  // leave a direction free, and keeps the matrix regular.
  const double pull = 1e-3 * (q.xx + q.yy + q.zz);
  const double m00 = q.xx + pull, m11 = q.yy + pull, m22 = q.zz + pull;
  const Vec3d r{-(q.xx * middle.x + q.xy * middle.y + q.xz * middle.z + q.x),
                -(q.xy * middle.x + q.yy * middle.y + q.yz * middle.z + q.y),
                -(q.xz * middle.x + q.yz * middle.y + q.zz * middle.z + q.z)};
  const Vec3d row0{m00, q.xy, q.xz}, row1{q.xy, m11, q.yz}, row2{q.xz, q.yz, m22};
  const Vec3d c12 = cross(row1, row2), c20 = cross(row2, row0), c01 = cross(row0, row1);
  const double determinant = dot(row0, c12);
  const Vec3d step = (c12 * r.x + c20 * r.y + c01 * r.z) * (1 / determinant);
  const Vec3d edge = pb - pa;
  if (dot(step, step) <= dot(edge, edge)) {  // Also false where the step is not a number.
    return middle + step;
  }
  const double at_a = q.at(pa), at_b = q.at(pb), at_middle = q.at(middle);
  if (at_middle <= at_a && at_middle <= at_b) return middle;
  return at_a <= at_b ? pa : pb;
}

bool EdgeCollapser::contains(std::uint32_t triangle, std::uint32_t vertex) const {
  const Triangle& t = triangles_[triangle];
  return t[0] == vertex || t[1] == vertex || t[2] == vertex;
}

void EdgeCollapser::tidy(std::uint32_t vertex) {
  std::erase_if(around_[vertex], [&](std::uint32_t t) { return alive_[t] == 0; });
}

/// Neighbours with the number of triangles on the edge to each, by vertex.
void EdgeCollapser::gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours) const {
  neighbours.clear();
  for (const std::uint32_t t : around_[vertex]) {
    for (const std::uint32_t other : triangles_[t]) {
      if (other != vertex) neighbours.push_back({other, 1});
    }
  }
  std::sort(neighbours.begin(), neighbours.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.vertex < b.vertex; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (kept != 0 && neighbours[kept - 1].vertex == neighbours[i].vertex) {
      ++neighbours[kept - 1].triangles;
    } else {
      neighbours[kept++] = neighbours[i];
    }
  }
  neighbours.resize(kept);
}

bool EdgeCollapser::keeps_topology(std::uint32_t a, std::uint32_t b) {
  gather(a, near_a_);
  gather(b, near_b_);
  std::uint32_t on_edge = 0, common = 0;
  bool border_a = false, border_b = false;
  for (const Neighbour& n : near_a_) {
    border_a = border_a || n.triangles == 1;
    if (n.vertex == b) on_edge = n.triangles;
  }
  for (const Neighbour& n : near_b_) border_b = border_b || n.triangles == 1;
  for (std::size_t i = 0, j = 0; i < near_a_.size() && j < near_b_.size();) {
    if (near_a_[i].vertex == near_b_[j].vertex)
      ++common, ++i, ++j;
    else if (near_a_[i].vertex < near_b_[j].vertex)
      ++i;
    else
      ++j;
  }
  if (on_edge == 0 || common != on_edge) return false;
  if (border_a && border_b && on_edge != 1) return false;
  // Something must be left, and no two triangles may come to lie on the same corners.
  bool something = false;
  for (const std::uint32_t t : around_[a]) something = something || !contains(t, b);
  for (const std::uint32_t t : around_[b]) something = something || !contains(t, a);
  if (!something) return false;
  for (const std::uint32_t s : around_[a]) {
    if (contains(s, b)) continue;
    std::uint32_t shared = 0;
    for (const std::uint32_t vertex : triangles_[s]) {
      shared += std::binary_search(
          near_b_.begin(), near_b_.end(), Neighbour{vertex, 0},
          [](const Neighbour& x, const Neighbour& y) { return x.vertex < y.vertex; });
    }
    if (shared < 3) continue;  // The corner a itself is a neighbour of b.
    for (const std::uint32_t t : around_[b]) {
      if (contains(t, a)) continue;
      std::uint32_t same = 0;
      for (const std::uint32_t vertex : triangles_[s]) same += contains(t, vertex);
      if (same == 2) return false;
    }
  }
  return true;
}

/// Checks the triangles around `moved` that survive.
bool EdgeCollapser::keeps_shape(std::uint32_t moved, std::uint32_t other, const Vec3d& target,
                                std::uint32_t leniency) const {
  for (const std::uint32_t t : around_[moved]) {
    if (contains(t, other)) continue;
    const Triangle& v = triangles_[t];
    const std::size_t k = v[0] == moved ? 0 : v[1] == moved ? 1 : 2;
    const Vec3d& b = points_[v[(k + 1) % 3]];
    const Vec3d& c = points_[v[(k + 2) % 3]];
    const Vec3d before = cross(b - points_[moved], c - points_[moved]);
    const Vec3d after = cross(b - target, c - target);
    const double length_before = std::sqrt(dot(before, before));
    const double length_after = std::sqrt(dot(after, after));
    const double limit = turn_limits[leniency];
    if (!(length_after > 0)) return false;
    if (!sides_.empty() && before.z > 0 && !(after.z > 0)) return false;
    if (!(dot(before, after) > limit * length_before * length_after)) return false;
    if (leniency > 0) continue;
    const double quality_after = quality(target, b, c, length_after);
    if (quality_after < quality_limit &&
        quality_after < quality(points_[moved], b, c, length_before)) {
      return false;
    }
  }
  return true;
}

bool EdgeCollapser::keeps_shapes(const Entry& e, const Vec3d& target) const {
  if (e.leniency < most_lenient && std::max(valence_[e.a], valence_[e.b]) > valence_limit) {
    return false;
  }
  if (!sides_.empty()) {
    // From one side to another: one would leave its own.
    const std::uint8_t a = sides_[e.a], b = sides_[e.b], both = a & b;
    if (both != a && both != b) return false;
  }
  return keeps_shape(e.a, e.b, target, e.leniency) && keeps_shape(e.b, e.a, target, e.leniency);
}

void EdgeCollapser::collapse(std::uint32_t a, std::uint32_t b, const Vec3d& target) {
  for (const std::uint32_t t : around_[b]) {
    if (contains(t, a)) {
      alive_[t] = 0;
      --faces_;
      for (const std::uint32_t vertex : triangles_[t]) --valence_[vertex];
    } else {
      for (std::uint32_t& vertex : triangles_[t]) {
        if (vertex == b) vertex = a;
      }
      around_[a].push_back(t);
      ++valence_[a];
    }
  }
  around_[b] = {};
  valence_[b] = 0;
  ++stamps_[b];
  ++stamps_[a];
  points_[a] = target;
  if (!sides_.empty()) sides_[a] |= sides_[b];
  quadrics_[a] += quadrics_[b];
  tidy(a);
}

void EdgeCollapser::run(std::size_t faces, double distance) {
  while (true) {
    bool changed = false;
    while (faces_ > faces && !heap_.empty()) {
      const Entry entry = heap_.front();
      if (entry.stamp_a != stamps_[entry.a] || entry.stamp_b != stamps_[entry.b]) {
        std::pop_heap(heap_.begin(), heap_.end());
        heap_.pop_back();
        continue;
      }
      Quadric sum = quadrics_[entry.a];
      sum += quadrics_[entry.b];
      if (entry.cost > distance * distance * sum.area) return;
      std::pop_heap(heap_.begin(), heap_.end());
      heap_.pop_back();
      tidy(entry.a);
      tidy(entry.b);
      const Vec3d target = best_point(entry.a, entry.b, sum);
      if (!keeps_shapes(entry, target)) {
        if (entry.leniency == most_lenient) continue;
        heap_.push_back(entry);
        heap_.back().cost *= penalty;
        ++heap_.back().leniency;
        std::push_heap(heap_.begin(), heap_.end());
      } else if (keeps_topology(entry.a, entry.b)) {
        collapse(entry.a, entry.b, target);
        gather(entry.a, near_a_);
        for (const Neighbour& n : near_a_) push(entry.a, n.vertex);
        changed = true;
      }
    }
    if (faces_ <= faces || !changed) return;
    fill_heap();  // What was refused may be allowed by now.
  }
}

void EdgeCollapser::extract(std::vector<Vec3d>& positions, std::vector<Triangle>& triangles) const {
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> renumbered(points_.size(), unused);
  positions.clear();
  triangles.clear();
  for (std::size_t v = 0; v < points_.size(); ++v) {
    if (valence_[v] == 0) continue;
    renumbered[v] = static_cast<std::uint32_t>(positions.size());
    positions.push_back(points_[v]);
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (alive_[t] == 0) continue;
    const Triangle& v = triangles_[t];
    triangles.push_back({renumbered[v[0]], renumbered[v[1]], renumbered[v[2]]});
  }
}

}  // namespace kiln
