// Two quadrics as one vector: costs of two edges at a time.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vectors.h"
#include "mesh/quadric.h"
#include "mesh/two_boxes.h"

namespace kiln {

/// Two quadrics at once, with the same bits as Quadric.
class TwoQuadrics {
 public:
  struct Point {
    Double2 x, y, z;
    Point(const Vec3d& one, const Vec3d& other)
        : x{one.x, other.x}, y{one.y, other.y}, z{one.z, other.z} {}
    Point(Double2 x_, Double2 y_, Double2 z_) : x(x_), y(y_), z(z_) {}
    Vec3d at(int i) const { return {x[i], y[i], z[i]}; }
    friend Point operator+(const Point& a, const Point& b) {
      return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend Point operator-(const Point& a, const Point& b) {
      return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend Point operator*(const Point& a, Double2 s) { return {a.x * s, a.y * s, a.z * s}; }
    friend Double2 dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend Point cross(const Point& a, const Point& b) {
      return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
  };

  /// The sum of a and b, and that of k and l.
  TwoQuadrics(const Quadric& a, const Quadric& b, const Quadric& k, const Quadric& l)
      : xx{a.xx + b.xx, k.xx + l.xx},
        xy{a.xy + b.xy, k.xy + l.xy},
        xz{a.xz + b.xz, k.xz + l.xz},
        yy{a.yy + b.yy, k.yy + l.yy},
        yz{a.yz + b.yz, k.yz + l.yz},
        zz{a.zz + b.zz, k.zz + l.zz},
        x{a.x + b.x, k.x + l.x},
        y{a.y + b.y, k.y + l.y},
        z{a.z + b.z, k.z + l.z},
        c{a.c + b.c, k.c + l.c},
        area{a.area + b.area, k.area + l.area} {}

  Quadric at(int i) const {
    return {xx[i], xy[i], xz[i], yy[i], yz[i], zz[i], x[i], y[i], z[i], c[i], area[i]};
  }
  /// As Quadric::off().
  Double2 off(const Point& p) const {
    const Double2 value = p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
                          p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + c;
    return root(larger(value, Double2{0, 0}) * area);
  }
  /// As Quadric::best_near().
  Point best_near(const Point& pa, const Point& pb) const {
    const Point middle = (pa + pb) * Double2{0.5, 0.5};
    const Double2 pull = Quadric::kPull * (xx + yy + zz);
    const Point slope{xx * middle.x + xy * middle.y + xz * middle.z + x,
                      xy * middle.x + yy * middle.y + yz * middle.z + y,
                      xz * middle.x + yz * middle.y + zz * middle.z + z};
    const Point r = slope * Double2{-1, -1};
    const Point row0{xx + pull, xy, xz}, row1{xy, yy + pull, yz}, row2{xz, yz, zz + pull};
    const Point c12 = cross(row1, row2), c20 = cross(row2, row0), c01 = cross(row0, row1);
    const Point step = (c12 * r.x + c20 * r.y + c01 * r.z) * (1 / dot(row0, c12));
    const Point edge = pb - pa;
    Point best = middle + step;
    const Double2 way = dot(step, step), longest = dot(edge, edge);
    for (int i = 0; i < 2; ++i) {
      if (way[i] <= longest[i]) continue;  // Not where the step is not a number.
      const Vec3d other = at(i).best_near(pa.at(i), pb.at(i));
      best.x[i] = other.x, best.y[i] = other.y, best.z[i] = other.z;
    }
    return best;
  }

  static Double2 root(Double2 value) { return Double2{std::sqrt(value[0]), std::sqrt(value[1])}; }

  Double2 xx, xy, xz, yy, yz, zz, x, y, z, c, area;
};

}  // namespace kiln
