// Double-precision points of the plane, such as texture coordinates.
#pragma once

namespace kiln {

struct Vec2d {
  double x = 0, y = 0;
};
inline Vec2d operator-(const Vec2d& a, const Vec2d& b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2d operator+(const Vec2d& a, const Vec2d& b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2d operator*(const Vec2d& a, double s) { return {a.x * s, a.y * s}; }
inline double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }
inline double dot(const Vec2d& a, const Vec2d& b) { return a.x * b.x + a.y * b.y; }

}  // namespace kiln
