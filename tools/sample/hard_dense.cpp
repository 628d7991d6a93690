// High-poly parts of hard-surface scenes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hard.h"

namespace kiln::sample {
namespace {

/// Positions of the grid lines on a face of a rounded box. They are dense over the rounding, so that its strips turn by
/// equal angles.
std::vector<double> rounded_box_grid_lines(double half, double radius, int steps) {
  // The last grid line lies exactly at the end of the face, so that adjacent faces share vertices.
  const auto line = [&](int i) {
    return i == steps ? half : half - radius + radius * std::tan(std::numbers::pi / 4 * i / steps);
  };
  std::vector<double> lines;
  for (int i = steps; i >= 0; --i) lines.push_back(-line(i));
  for (int i = 0; i <= steps; ++i) lines.push_back(line(i));
  return lines;
}

}  // namespace

Point PartFrame::at(const Point& p) const { return origin + direction(p); }
Point PartFrame::direction(const Point& p) const { return p.x * x + p.y * y + p.z * z; }

PartFrame PartFrame::translated(double along_x, double along_y, double along_z) const {
  PartFrame result = *this;
  result.origin = at({along_x, along_y, along_z});
  return result;
}

PartFrame frame_along(const Point& origin, const Point& axis) {
  PartFrame part_frame;
  part_frame.origin = origin;
  part_frame.z = unit(axis);
  const bool up = std::abs(part_frame.z.y) > 0.9;
  part_frame.x = unit(crossed(up ? Point{0, 0, 1} : Point{0, 1, 0}, part_frame.z));
  part_frame.y = crossed(part_frame.z, part_frame.x);
  return part_frame;
}

HighPolyParts::HighPolyParts(std::string name) { mesh_.name = std::move(name); }

void HighPolyParts::group(std::string name) { mesh_.group_names.push_back(std::move(name)); }

std::uint32_t HighPolyParts::corner(const PartFrame& part_frame, const Point& local,
                                    const Point& normal) {
  mesh_.positions.push_back(to_float(part_frame.at(local)));
  mesh_.normals.push_back(to_float(unit(part_frame.direction(normal))));
  return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
}

void HighPolyParts::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (!mesh_.group_names.empty()) {
    mesh_.groups.push_back(static_cast<std::uint32_t>(mesh_.group_names.size() - 1));
  }
  mesh_.triangles.push_back({a, b, c});
  mesh_.normal_triangles.push_back({a, b, c});
}

void HighPolyParts::quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  triangle(a, b, c);
  triangle(a, c, d);
}

void HighPolyParts::rounded_box(const PartFrame& part_frame, const Point& half, double radius,
                                int steps) {
  const std::array<double, 3> h = {half.x, half.y, half.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t across = (axis + 1) % 3, up = (axis + 2) % 3;
    const std::vector<double> us = rounded_box_grid_lines(h[across], radius, steps);
    const std::vector<double> vs = rounded_box_grid_lines(h[up], radius, steps);
    for (const double side : {-1.0, 1.0}) {
      const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
      for (const double v : vs) {
        for (const double u : us) {
          std::array<double, 3> p{}, inner{};
          p[axis] = side * h[axis];
          p[across] = u;
          p[up] = v;
          for (std::size_t k = 0; k < 3; ++k) {
            inner[k] = std::clamp(p[k], -(h[k] - radius), h[k] - radius);
          }
          const Point base{inner[0], inner[1], inner[2]};
          const Point normal = unit(Point{p[0], p[1], p[2]} - base);
          corner(part_frame, base + radius * normal, normal);
        }
      }
      const auto row = static_cast<std::uint32_t>(us.size());
      for (std::uint32_t j = 0; j + 1 < vs.size(); ++j) {
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
          const std::uint32_t a = first + j * row + i;
          if (side > 0) {
            quad(a, a + 1, a + row + 1, a + row);
          } else {
            quad(a, a + row, a + row + 1, a + 1);
          }
        }
      }
    }
  }
}

void HighPolyParts::add_turned_profile(const PartFrame& part_frame,
                                       const std::vector<ProfileSegment>& profile, int segments) {
  for (const ProfileSegment& part : profile) {
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (int i = 0; i <= segments; ++i) {
      const double angle = 2 * std::numbers::pi * (i % segments) / segments;
      const double c = std::cos(angle), s = std::sin(angle);
      const auto add = [&](const std::array<double, 2>& p, const std::array<double, 2>& n) {
        corner(part_frame, {p[0] * c, p[0] * s, p[1]}, {n[0] * c, n[0] * s, n[1]});
      };
      add(part.from, part.from_normal);
      add(part.to, part.to_normal);
    }
    for (int i = 0; i < segments; ++i) {
      const std::uint32_t a = first + 2 * static_cast<std::uint32_t>(i);
      if (part.from[0] > 0) triangle(a, a + 2, a + 3);
      if (part.to[0] > 0) triangle(a, a + 3, a + 1);
    }
  }
}

void HighPolyParts::disc(const PartFrame& part_frame, double radius, double height, double rounding,
                         int segments) {
  std::vector<ProfileSegment> profile = {
      {{0, 0}, {radius, 0}, {0, -1}, {0, -1}},
      {{radius, 0}, {radius, height - rounding}, {1, 0}, {1, 0}},
  };
  constexpr int kSteps = 4;
  for (int i = 0; i < kSteps; ++i) {
    const double a = std::numbers::pi / 2 * i / kSteps, b = std::numbers::pi / 2 * (i + 1) / kSteps;
    const auto on = [&](double angle) -> std::array<double, 2> {
      return {radius - rounding + rounding * std::cos(angle),
              height - rounding + rounding * std::sin(angle)};
    };
    profile.push_back({on(a), on(b), {std::cos(a), std::sin(a)}, {std::cos(b), std::sin(b)}});
  }
  profile.push_back({{radius - rounding, height}, {0, height}, {0, 1}, {0, 1}});
  add_turned_profile(part_frame, profile, segments);
}

void HighPolyParts::prism(const PartFrame& part_frame, int sides, double radius, double height,
                          double chamfer) {
  const auto at = [&](int i, double r, double z) -> Point {
    const double angle = 2 * std::numbers::pi * (i % sides) / sides;
    return {r * std::cos(angle), r * std::sin(angle), z};
  };
  const double inner = radius - chamfer / std::cos(std::numbers::pi / sides);
  const auto strip = [&](int i, double r0, double z0, double r1, double z1) {
    const Point a = at(i, r0, z0), b = at(i + 1, r0, z0), c = at(i + 1, r1, z1), d = at(i, r1, z1);
    const Point normal = unit(crossed(b - a, d - a));
    const std::uint32_t first = corner(part_frame, a, normal);
    corner(part_frame, b, normal);
    corner(part_frame, c, normal);
    corner(part_frame, d, normal);
    quad(first, first + 1, first + 2, first + 3);
  };
  for (int i = 0; i < sides; ++i) {
    strip(i, radius, 0, radius, height - chamfer);
    strip(i, radius, height - chamfer, inner, height);
    for (const bool top : {false, true}) {
      const double r = top ? inner : radius, z = top ? height : 0;
      const Point normal{0, 0, top ? 1.0 : -1.0};
      const std::uint32_t first = corner(part_frame, {0, 0, z}, normal);
      corner(part_frame, at(top ? i : i + 1, r, z), normal);
      corner(part_frame, at(top ? i + 1 : i, r, z), normal);
      triangle(first, first + 1, first + 2);
    }
  }
}

void HighPolyParts::bent_plate(const PartFrame& part_frame, double inner, double outer,
                               double angle, double span, double half, int segments) {
  const auto at = [&](int i, double r, double z) -> Point {
    const double a = angle + span * i / segments;
    return {r * std::cos(a), r * std::sin(a), z};
  };
  const auto radial = [&](int i) { return unit(at(i, 1, 0)); };
  const auto around = [&](int i) { return Point{-radial(i).y, radial(i).x, 0}; };
  const auto face = [&](const std::array<Point, 4>& p, const std::array<Point, 4>& n) {
    const std::uint32_t first = corner(part_frame, p[0], n[0]);
    for (std::size_t k = 1; k < 4; ++k) corner(part_frame, p[k], n[k]);
    quad(first, first + 1, first + 2, first + 3);
  };
  const Point up{0, 0, 1}, down{0, 0, -1};
  for (int i = 0; i < segments; ++i) {
    const Point n0 = radial(i), n1 = radial(i + 1), b0 = -1.0 * n0, b1 = -1.0 * n1;
    face({at(i, outer, -half), at(i + 1, outer, -half), at(i + 1, outer, half), at(i, outer, half)},
         {n0, n1, n1, n0});
    face({at(i, inner, -half), at(i, inner, half), at(i + 1, inner, half), at(i + 1, inner, -half)},
         {b0, b0, b1, b1});
    face({at(i, inner, half), at(i, outer, half), at(i + 1, outer, half), at(i + 1, inner, half)},
         {up, up, up, up});
    face({at(i, inner, -half), at(i + 1, inner, -half), at(i + 1, outer, -half),
          at(i, outer, -half)},
         {down, down, down, down});
  }
  const Point start = -1.0 * around(0), end = around(segments);
  face({at(0, inner, -half), at(0, outer, -half), at(0, outer, half), at(0, inner, half)},
       {start, start, start, start});
  face({at(segments, inner, -half), at(segments, inner, half), at(segments, outer, half),
        at(segments, outer, -half)},
       {end, end, end, end});
}

void HighPolyParts::extrusion(const PartFrame& part_frame, const Outline& outline,
                              const std::array<double, 2>& centre, double half, double radius,
                              int steps) {
  struct Rim {
    Point at, normal;
  };
  std::vector<Rim> rim;
  const std::size_t count = outline.size();
  const auto point = [&](std::size_t i) -> Point {
    return {outline[i % count][0], outline[i % count][1], 0};
  };
  for (std::size_t i = 0; i < count; ++i) {
    const Point here = point(i);
    const Point in = unit(here - point(i + count - 1)), out = unit(point(i + 1) - here);
    const Point n_in{in.y, -in.x, 0};
    const double turn = std::atan2(in.x * out.y - in.y * out.x, dot(in, out));
    const double cut = radius * std::tan(std::abs(turn) / 2);
    const double side =
        // at a concave corner the circle of the rounding lies outside of the outline
        turn > 0 ? 1 : -1;
    const Point from = here - cut * in;
    const Point middle = from - (side * radius) * n_in;
    for (int k = 0; k <= steps; ++k) {
      const double a = turn * k / steps;
      const Point normal{n_in.x * std::cos(a) - n_in.y * std::sin(a),
                         n_in.x * std::sin(a) + n_in.y * std::cos(a), 0};
      rim.push_back({middle + (side * radius) * normal, normal});
    }
  }
  const Point up{0, 0, half};
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Rim &a = rim[i], &b = rim[(i + 1) % rim.size()];
    const std::uint32_t first = corner(part_frame, a.at - up, a.normal);
    corner(part_frame, b.at - up, b.normal);
    corner(part_frame, b.at + up, b.normal);
    corner(part_frame, a.at + up, a.normal);
    quad(first, first + 1, first + 2, first + 3);
    for (const double z : {-1.0, 1.0}) {
      const Point normal{0, 0, z}, lift = z * up;
      const std::uint32_t cap = corner(part_frame, Point{centre[0], centre[1], 0} + lift, normal);
      corner(part_frame, (z > 0 ? a.at : b.at) + lift, normal);
      corner(part_frame, (z > 0 ? b.at : a.at) + lift, normal);
      triangle(cap, cap + 1, cap + 2);
    }
  }
}

void HighPolyParts::open_sheet(const PartFrame& part_frame, double w, double h, int steps,
                               double (*height)(double x, double y)) {
  const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
  constexpr double kStep = 1e-5;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      const double x = w * (2.0 * i / steps - 1), y = h * (2.0 * j / steps - 1);
      const double dx = (height(x + kStep, y) - height(x - kStep, y)) / (2 * kStep);
      const double dy = (height(x, y + kStep) - height(x, y - kStep)) / (2 * kStep);
      corner(part_frame, {x, y, height(x, y)}, {-dx, -dy, 1});
    }
  }
  const auto row = static_cast<std::uint32_t>(steps + 1);
  for (std::uint32_t j = 0; j + 1 < row; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = first + j * row + i;
      quad(a, a + 1, a + row + 1, a + row);
    }
  }
}

}  // namespace kiln::sample
