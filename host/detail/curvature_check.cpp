#include "detail/curvature_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "mesh/usable.h"

namespace kiln {
namespace {

// The pieces gathered around a centre also serve points up to this far from it, as a share of the
// radius
constexpr double kGatherSlack = 0.25;
constexpr int kStrips = 64;
// Two faces count as opposed if the cosine of the angle between their normals is below this
constexpr double kMaxOpposedCosine = -0.6;
constexpr std::uint32_t kNoPiece = std::numeric_limits<std::uint32_t>::max();

Vec3d unit_normal(const std::array<Vec3d, 3>& c) {
  const Vec3d n = cross(c[1] - c[0], c[2] - c[0]);
  return n * (1 / length(n));
}

/// Length of the part of a segment that lies within a ball around the origin.
double length_in_ball(const Vec3d& a, const Vec3d& b, double radius) {
  const double segment_length = length(b - a);
  if (!(segment_length > 0)) return 0;
  const Vec3d direction = (b - a) * (1 / segment_length);
  const double foot = -dot(a, direction), line_distance = length(a + direction * foot);
  if (line_distance >= radius) return 0;
  const double half_chord = std::sqrt(radius * radius - line_distance * line_distance);
  return std::max(0.0,
                  std::min(segment_length, foot + half_chord) - std::max(0.0, foot - half_chord));
}

/// True if the bounding boxes of a triangle and of a ball are disjoint.
bool are_disjoint(const std::array<Vec3d, 3>& t, const Vec3d& centre, double radius) {
  const auto along = [&](double p, double q, double r, double at) {
    return std::min({p, q, r}) > at + radius || std::max({p, q, r}) < at - radius;
  };
  return along(t[0].x, t[1].x, t[2].x, centre.x) || along(t[0].y, t[1].y, t[2].y, centre.y) ||
         along(t[0].z, t[1].z, t[2].z, centre.z);
}

double min_x(const std::array<Vec3d, 3>& c) { return std::min({c[0].x, c[1].x, c[2].x}); }
/// Binary exponent of a triangle's extent along x, or of the radius if that is larger.
int size_exponent(const std::array<Vec3d, 3>& c, double radius) {
  return std::ilogb(std::max(std::max({c[0].x, c[1].x, c[2].x}) - min_x(c), radius));
}

}  // namespace

CurvatureCheck::CurvatureCheck(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                               double radius)
    : radius_(radius) {
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    if (!has_area(positions, t)) continue;
    Piece& piece = pieces_.emplace_back();
    piece.triangle = i;
    for (std::size_t k = 0; k < 3; ++k) piece.corner[k] = to_double(positions[t[k]]);
    piece.normal = unit_normal(piece.corner);
    piece.size_exponent = size_exponent(piece.corner, radius);
    piece.x = min_x(piece.corner);
  }
  std::stable_sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
    return std::tie(a.size_exponent, a.x) < std::tie(b.size_exponent, b.x);
  });
  piece_of_.assign(triangles.size(), kNoPiece);
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) piece_of_[pieces_[i].triangle] = i;
  find_angles();
}

void CurvatureCheck::find_angles() {
  using Position = std::tuple<double, double, double>;
  struct Side {
    Position low, high;
    bool is_upward;
    std::uint32_t piece, k;
  };
  std::vector<Side> sides;
  sides.reserve(3 * pieces_.size());
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Vec3d &p = pieces_[i].corner[k], &q = pieces_[i].corner[(k + 1) % 3];
      const Position from{p.x, p.y, p.z}, to{q.x, q.y, q.z};
      sides.push_back({std::min(from, to), std::max(from, to), from < to, i, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.is_upward, a.piece) <
           std::tie(b.low, b.high, b.is_upward, b.piece);
  });
  for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
    while (next < sides.size() && sides[next].low == sides[i].low &&
           sides[next].high == sides[i].high) {
      ++next;
    }
    for (std::size_t s = i; s < next; ++s) {
      const Side& after = sides[s + 1 < next ? s + 1 : i];
      pieces_[sides[s].piece].next_side[sides[s].k] = 3 * after.piece + after.k;
    }
    if (next - i != 2 || sides[i].is_upward == sides[i + 1].is_upward) continue;
    Piece &one = pieces_[sides[i].piece], &other = pieces_[sides[i + 1].piece];
    const Vec3d &n = one.normal, &m = other.normal;
    const double angle = std::acos(std::clamp(dot(n, m), -1.0, 1.0));
    // The edge is convex if the opposite corner of the other triangle lies below this triangle's
    // plane.
    const double side = dot(n, other.corner[(sides[i + 1].k + 2) % 3] - one.corner[sides[i].k]);
    one.angle[sides[i].k] = other.angle[sides[i + 1].k] = side <= 0 ? angle : -angle;
  }
}

/// Gathers all pieces that the ball around any point near the centre can overlap.
void CurvatureCheck::gather_pieces(const Vec3d& centre, Scratch& scratch) const {
  scratch.is_gathered = true;
  scratch.centre = centre;
  scratch.nearby_pieces.clear();
  const double reach = radius_ * (1 + kGatherSlack);
  auto piece = pieces_.begin();
  const auto skip_to = [&](int width_exponent, double x) {
    piece = std::partition_point(piece, pieces_.end(), [&](const Piece& other) {
      return std::tie(other.size_exponent, other.x) < std::tie(width_exponent, x);
    });
  };
  while (piece != pieces_.end()) {
    const int width_exponent = piece->size_exponent;
    skip_to(width_exponent, centre.x - reach - std::ldexp(2.0, width_exponent));
    for (; piece != pieces_.end() && piece->size_exponent == width_exponent &&
           piece->x <= centre.x + reach;
         ++piece) {
      if (are_disjoint(piece->corner, centre, reach)) continue;
      scratch.nearby_pieces.push_back(static_cast<std::uint32_t>(piece - pieces_.begin()));
    }
    skip_to(width_exponent + 1, -std::numeric_limits<double>::infinity());
  }
}

/// Marks the pieces that are connected with the point's own piece within the ball.
void CurvatureCheck::find_connected(const Vec3d& point, std::uint32_t seed,
                                    Scratch& scratch) const {
  scratch.is_connected.resize(pieces_.size());
  scratch.visited_pieces.assign(1, seed);
  scratch.is_connected[seed] = 1;
  for (std::size_t i = 0; i < scratch.visited_pieces.size(); ++i) {
    const Piece& piece = pieces_[scratch.visited_pieces[i]];
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (length_in_ball(piece.corner[k] - point, piece.corner[(k + 1) % 3] - point, radius_) <= 0)
        continue;
      const std::uint32_t start = 3 * scratch.visited_pieces[i] + k;
      for (std::uint32_t side = piece.next_side[k]; side != start;
           side = pieces_[side / 3].next_side[side % 3]) {
        if (std::exchange(scratch.is_connected[side / 3], std::uint8_t{1}) == 0) {
          scratch.visited_pieces.push_back(side / 3);
        }
      }
    }
  }
}

double CurvatureCheck::at(const Vec3d& point, std::uint32_t triangle, Scratch& scratch) const {
  const std::uint32_t seed = piece_of_[triangle];
  bool is_connectivity_known = false;
  const auto is_on_sheet = [&](std::uint32_t i) {
    if (seed == kNoPiece || dot(pieces_[i].normal, pieces_[seed].normal) >= kMaxOpposedCosine)
      return true;
    if (!std::exchange(is_connectivity_known, true)) find_connected(point, seed, scratch);
    return scratch.is_connected[i] != 0;
  };
  if (!scratch.is_gathered || length(point - scratch.centre) > radius_ * kGatherSlack)
    gather_pieces(point, scratch);
  double area = 0, bend = 0;
  for (const std::uint32_t i : scratch.nearby_pieces) {
    const Piece& piece = pieces_[i];
    if (are_disjoint(piece.corner, point, radius_) || !is_on_sheet(i)) continue;
    const Vec3d a = piece.corner[0] - point, b = piece.corner[1] - point,
                c = piece.corner[2] - point;
    bend += (piece.angle[0] * length_in_ball(a, b, radius_) +
             piece.angle[1] * length_in_ball(b, c, radius_) +
             piece.angle[2] * length_in_ball(c, a, radius_)) /
            4;
    const double triangle_area = length(cross(b - a, c - a)) / 2;
    if (std::max({length(a), length(b), length(c)}) <= radius_) {
      area += triangle_area;
      continue;
    }
    // The triangle is cut into strips parallel to side bc, starting at corner a. At height y, the
    // ball cuts a chord from the middle line of the strip. Its half-length is sqrt(radius^2 -
    // distance^2), where `distance` is the distance of the line from the centre.
    const double width = length(c - b);
    const Vec3d along = (c - b) * (1 / width);
    const double slant = dot(b - a, along), foot = dot(a, along);
    const Vec3d down = (b - a) - along * slant;
    const double height = length(down), middle = -dot(a, down) / height;
    const double off_plane = dot(a, cross(along, down)) / height;
    const double squared_disc_radius = radius_ * radius_ - off_plane * off_plane;
    const double begin = std::max(0.0, middle - radius_), end = std::min(height, middle + radius_);
    if (begin >= end) continue;
    for (int s = 0; s < kStrips; ++s) {
      const double y = begin + (end - begin) * (s + 0.5) / kStrips;
      const double squared_half_chord = squared_disc_radius - (y - middle) * (y - middle);
      if (!(squared_half_chord > 0)) continue;
      const double half_chord = std::sqrt(squared_half_chord),
                   chord_begin = foot + slant * y / height;
      const double chord_end = chord_begin + width * y / height;
      area += std::max(0.0, std::min(chord_end, half_chord) - std::max(chord_begin, -half_chord)) *
              (end - begin) / kStrips;
    }
  }
  if (is_connectivity_known) {
    for (const std::uint32_t i : scratch.visited_pieces) scratch.is_connected[i] = 0;
  }
  return area > 0 ? bend / area : 0;
}

}  // namespace kiln
