// Low-poly parts of hard-surface scenes, and their charts.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "hard.h"

namespace kiln::sample {
namespace {

struct ChartPacking {
  std::vector<std::array<double, 2>> corner;  ///< Per chart
  bool fits = false;
};

/// Packs charts in rows, the tallest first, with sizes multiplied by `scale`.
ChartPacking packed(const std::vector<std::array<double, 2>>& sizes, double scale, double gap) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sizes[a][1] > sizes[b][1]; });
  ChartPacking result;
  result.corner.resize(sizes.size());
  double x = gap, y = gap, row = 0;
  bool wide = false;
  for (const std::size_t i : order) {
    const double w = scale * sizes[i][0], h = scale * sizes[i][1];
    if (x + w + gap > 1 && x > gap) {
      x = gap;
      y += row + gap;
      row = 0;
    }
    wide = wide || x + w + gap > 1;
    result.corner[i] = {x, y};
    x += w + gap;
    row = std::max(row, h);
  }
  result.fits = !wide && y + row + gap <= 1;
  return result;
}

}  // namespace

LightParts::LightParts(std::string name) { mesh_.name = std::move(name); }

void LightParts::group(std::string name) { mesh_.group_names.push_back(std::move(name)); }

std::uint32_t LightParts::corner(Chart& chart, const PartFrame& part_frame, const Point& local,
                                 const Point& normal, double u, double v) {
  const auto index = static_cast<std::uint32_t>(mesh_.positions.size());
  mesh_.positions.push_back(to_float(part_frame.at(local)));
  mesh_.normals.push_back(to_float(unit(part_frame.direction(normal))));
  mesh_.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
  chart.corners.push_back(index);
  chart.width = std::max(chart.width, u);
  chart.height = std::max(chart.height, v);
  return index;
}

void LightParts::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (!mesh_.group_names.empty()) {
    mesh_.groups.push_back(static_cast<std::uint32_t>(mesh_.group_names.size() - 1));
  }
  mesh_.triangles.push_back({a, b, c});
  mesh_.normal_triangles.push_back({a, b, c});
  mesh_.uv_triangles.push_back({a, b, c});
}

/// Adds a flat polygon as a chart: a triangle fan around its first corner, or around a given centre.
void LightParts::face(const PartFrame& part_frame, const std::vector<Point>& polygon,
                      const Point* centre) {
  const Point along = unit(polygon[1] - polygon[0]);
  const Point normal = unit(crossed(along, polygon[2] - polygon[1]));
  const Point up = crossed(normal, along);
  double least_u = 0, least_v = 0;
  for (const Point& p : polygon) {
    least_u = std::min(least_u, dot(p - polygon[0], along));
    least_v = std::min(least_v, dot(p - polygon[0], up));
  }
  Chart chart;
  const auto add = [&](const Point& p) {
    return corner(chart, part_frame, p, normal, dot(p - polygon[0], along) - least_u,
                  dot(p - polygon[0], up) - least_v);
  };
  const std::uint32_t first = add(polygon[0]);
  for (std::size_t i = 1; i < polygon.size(); ++i) add(polygon[i]);
  const auto count = static_cast<std::uint32_t>(polygon.size());
  if (centre != nullptr) {
    const std::uint32_t middle = add(*centre);
    for (std::uint32_t i = 0; i < count; ++i) {
      triangle(middle, first + i, first + (i + 1) % count);
    }
  } else {
    for (std::uint32_t i = 2; i < count; ++i) triangle(first, first + i - 1, first + i);
  }
  charts_.push_back(std::move(chart));
}

void LightParts::box(const PartFrame& part_frame, const Point& half) {
  const std::array<double, 3> h = {half.x, half.y, half.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto at = [&](double u, double v) -> Point {
        std::array<double, 3> p{};
        p[axis] = side * h[axis];
        p[(axis + 1) % 3] = side * u * h[(axis + 1) % 3];
        p[(axis + 2) % 3] = v * h[(axis + 2) % 3];
        return {p[0], p[1], p[2]};
      };
      face(part_frame, {at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)});
    }
  }
}

void LightParts::cylinder(const PartFrame& part_frame, int sides, double radius, double height,
                          bool smooth) {
  const auto at = [&](int i, double z) -> Point {
    const double angle = 2 * std::numbers::pi * (i % sides) / sides;
    return {radius * std::cos(angle), radius * std::sin(angle), z};
  };
  const double width = length(at(1, 0) - at(0, 0));
  if (smooth) {
    Chart chart;
    std::uint32_t first = 0;
    for (int i = 0; i <= sides; ++i) {
      const Point p = at(i, 0), q = at(i, height);
      const std::uint32_t index = corner(chart, part_frame, p, p, width * i, 0);
      if (i == 0) first = index;
      corner(chart, part_frame, q, p, width * i, height);
    }
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
      const std::uint32_t a = first + 2 * i;
      triangle(a, a + 2, a + 3);
      triangle(a, a + 3, a + 1);
    }
    charts_.push_back(std::move(chart));
  } else {
    for (int i = 0; i < sides; ++i) {
      face(part_frame, {at(i, 0), at(i + 1, 0), at(i + 1, height), at(i, height)});
    }
  }
  std::vector<Point> top, bottom;
  for (int i = 0; i < sides; ++i) {
    top.push_back(at(i, height));
    bottom.push_back(at(sides - i, 0));
  }
  face(part_frame, top);
  face(part_frame, bottom);
}

void LightParts::extrusion(const PartFrame& part_frame, const Outline& outline,
                           const std::array<double, 2>& centre, double half) {
  std::vector<Point> top, bottom;
  const std::size_t count = outline.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<double, 2>&a = outline[i], &b = outline[(i + 1) % count];
    face(part_frame,
         {{a[0], a[1], -half}, {b[0], b[1], -half}, {b[0], b[1], half}, {a[0], a[1], half}});
    top.push_back({a[0], a[1], half});
    const std::array<double, 2>& back = outline[count - 1 - i];
    bottom.push_back({back[0], back[1], -half});
  }
  const Point high{centre[0], centre[1], half}, low{centre[0], centre[1], -half};
  face(part_frame, top, &high);
  face(part_frame, bottom, &low);
}

void LightParts::card(const PartFrame& part_frame, double w, double h) {
  face(part_frame, {{-w, -h, 0}, {w, -h, 0}, {w, h, 0}, {-w, h, 0}});
}

Mesh LightParts::pack_charts_and_finish(double gap) {
  std::vector<std::array<double, 2>> sizes;
  double largest = 0;
  for (const Chart& chart : charts_) {
    sizes.push_back({chart.width, chart.height});
    largest = std::max({largest, chart.width, chart.height});
  }
  double low = 0, high = 1 / largest;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (packed(sizes, middle, gap).fits ? low : high) = middle;
  }
  const ChartPacking places = packed(sizes, low, gap);
  for (std::size_t c = 0; c < charts_.size(); ++c) {
    for (const std::uint32_t i : charts_[c].corners) {
      Vec2& uv = mesh_.uvs[i];
      uv = {static_cast<float>(places.corner[c][0] + low * uv.x),
            static_cast<float>(places.corner[c][1] + low * uv.y)};
    }
  }
  return mesh_;
}

}  // namespace kiln::sample
