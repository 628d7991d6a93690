#include "reference/layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace kiln::test {
namespace {

struct Point {
  std::int64_t x = 0, y = 0;
};
using Corners = std::array<Point, 3>;

std::int64_t turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// True if a side of `a` has all of `b` on its outer side or on it (both counter-clockwise).
bool has_separating_side(const Corners& a, const Corners& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &from = a[k], &to = a[(k + 1) % 3];
    if (turn(from, to, b[0]) <= 0 && turn(from, to, b[1]) <= 0 && turn(from, to, b[2]) <= 0) {
      return true;
    }
  }
  return false;
}

/// True if the point is nearer to the segment than `border`, without rounding.
bool nearer(const Point& p, const Point& a, const Point& b, std::int64_t border) {
  const std::int64_t ex = b.x - a.x, ey = b.y - a.y, px = p.x - a.x, py = p.y - a.y;
  const std::int64_t along = px * ex + py * ey, length2 = ex * ex + ey * ey;
  if (along <= 0) return px * px + py * py < border * border;
  if (along >= length2) {
    const std::int64_t qx = p.x - b.x, qy = p.y - b.y;
    return qx * qx + qy * qy < border * border;
  }
  __extension__ using Wide = __int128;
  const Wide across = Wide{px} * ey - Wide{py} * ex;
  return across * across < Wide{border} * border * length2;
}

/// For triangles that do not overlap: some corner of one is nearest to a side of the other.
bool too_near(const Corners& a, const Corners& b, std::int64_t border) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (nearer(a[i], b[k], b[(k + 1) % 3], border)) return true;
      if (nearer(b[i], a[k], a[(k + 1) % 3], border)) return true;
    }
  }
  return false;
}

double area(const Mesh& mesh, const Triangle& t) {
  std::array<std::array<double, 3>, 2> e{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3 &from = mesh.positions[t[0]], &to = mesh.positions[t[k + 1]];
    e[k] = {double{to.x} - double{from.x}, double{to.y} - double{from.y},
            double{to.z} - double{from.z}};
  }
  return 0.5 * std::hypot(e[0][1] * e[1][2] - e[0][2] * e[1][1],
                          e[0][2] * e[1][0] - e[0][0] * e[1][2],
                          e[0][0] * e[1][1] - e[0][1] * e[1][0]);
}

}  // namespace

LayoutFacts check_layout(const Mesh& mesh, std::int64_t grid, std::int64_t border,
                         std::int64_t size) {
  LayoutFacts facts;
  const auto fault = [&](const std::string& what) {
    if (facts.first_fault.empty()) facts.first_fault = what;
  };
  if (mesh.uv_triangles.size() != mesh.triangles.size()) {
    fault("UV indices are not complete");
    return facts;
  }
  const std::size_t count = mesh.triangles.size();
  std::vector<Corners> corners(count);
  std::vector<std::uint32_t> chart(count);
  std::iota(chart.begin(), chart.end(), 0u);
  const auto root = [&](std::uint32_t t) {
    while (chart[t] != t) t = chart[t];
    return t;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> sides;
  double weight = 0, sum = 0, squares = 0;
  facts.smallest_texels = 1e300;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Triangle& uv = mesh.uv_triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = double{mesh.uvs.at(uv[k]).x} * static_cast<double>(grid);
      const double y = double{mesh.uvs.at(uv[k]).y} * static_cast<double>(grid);
      corners[t][k] = {std::llround(x), std::llround(y)};
      // Single precision holds a share of one to 2^-24.
      const double tolerance = std::ldexp(static_cast<double>(grid), -23);
      if (!(std::abs(x - std::round(x)) <= tolerance && std::abs(y - std::round(y)) <= tolerance)) {
        fault("triangle " + std::to_string(t) + " is off the grid");
      }
      const Point& p = corners[t][k];
      if (p.x < 0 || p.y < 0 || p.x > grid || p.y > grid) {
        fault("triangle " + std::to_string(t) + " leaves the map");
      }
    }
    const std::int64_t doubled = turn(corners[t][0], corners[t][1], corners[t][2]);
    if (doubled < 0) fault("triangle " + std::to_string(t) + " is mirrored");
    if (doubled == 0) {
      ++facts.collapsed;
      continue;
    }
    const auto steps = static_cast<double>(grid);
    const double uv_area = 0.5 * static_cast<double>(doubled) / (steps * steps);
    facts.coverage += uv_area;
    facts.smallest_texels = std::min(
        facts.smallest_texels, uv_area * static_cast<double>(size) * static_cast<double>(size));
    const double surface = area(mesh, mesh.triangles[t]);
    const double density = std::log2(uv_area) - std::log2(surface);
    weight += surface, sum += surface * density, squares += surface * density * density;
    for (std::size_t k = 0; k < 3; ++k) {
      sides[{uv[k], uv[(k + 1) % 3]}] = t;
      const auto other = sides.find({uv[(k + 1) % 3], uv[k]});
      if (other != sides.end()) {
        const std::uint32_t a = root(t), b = root(other->second);
        chart[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  facts.density_spread = std::sqrt(std::max(0.0, squares / weight - sum * sum / (weight * weight)));

  // A triangle is compared with those that start further right, as far as the border reaches.
  std::vector<std::uint32_t> order;
  std::vector<std::array<std::int64_t, 4>> box(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    if (turn(corners[t][0], corners[t][1], corners[t][2]) == 0) continue;
    order.push_back(t);
    facts.charts += chart[t] == t;
    const auto [x0, x1] = std::minmax({corners[t][0].x, corners[t][1].x, corners[t][2].x});
    const auto [y0, y1] = std::minmax({corners[t][0].y, corners[t][1].y, corners[t][2].y});
    box[t] = {x0, x1, y0, y1};
  }
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return box[a][0] < box[b][0]; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t a = order[i];
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const std::uint32_t b = order[j];
      if (box[b][0] >= box[a][1] + border) break;
      if (box[b][2] >= box[a][3] + border || box[a][2] >= box[b][3] + border) continue;
      const std::string pair = std::to_string(a) + " and " + std::to_string(b);
      if (!has_separating_side(corners[a], corners[b]) &&
          !has_separating_side(corners[b], corners[a])) {
        fault("triangles " + pair + " overlap");
      } else if (root(a) != root(b) && too_near(corners[a], corners[b], border)) {
        fault("triangles " + pair + " of two charts are too near");
      }
    }
  }
  return facts;
}

}  // namespace kiln::test
