#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "carving.h"
#include "scenes.h"
#include "sweep.h"

namespace kiln::sample {
namespace {

/// The profile from the middle of the foot to the tip of the knob. The names are the places where bands
/// of relief begin and end.
enum Mark : std::size_t {
  foot_low = 3,
  foot_high = 5,
  ring_low = 9,
  ring_high = 11,
  leaves_low = 12,
  leaves_high = 15,
  braid_high = 17,
  scales_high = 19,
  key_high = 21,
  neck_low = 23,
  neck_high = 26,
  lip_low = 27,
  lip_high = 29,
  lid_low = 32,
  lid_high = 36,
  knob_low = 38,
  knob_high = 42,
};
const std::vector<Profile::ProfileControl> kUrnProfile = {
    {0.000, 0.000}, {0.300, 0.000}, {0.385, 0.006},                                  // underside
    {0.402, 0.030}, {0.407, 0.060}, {0.395, 0.095},                                  // foot
    {0.340, 0.115}, {0.270, 0.160}, {0.238, 0.220},                                  // stem
    {0.245, 0.262}, {0.262, 0.290}, {0.255, 0.318},                                  // ring
    {0.268, 0.345}, {0.390, 0.430}, {0.525, 0.560}, {0.618, 0.720},                  // leaves
    {0.655, 0.840}, {0.662, 0.935},                                                  // braid
    {0.642, 1.060}, {0.590, 1.175},                                                  // scales
    {0.530, 1.250}, {0.462, 1.310},                                                  // key
    {0.395, 1.350}, {0.362, 1.395}, {0.345, 1.470}, {0.345, 1.545}, {0.362, 1.610},  // neck
    {0.395, 1.638}, {0.428, 1.672}, {0.412, 1.708},                                  // lip
    {0.375, 1.718}, {0.378, 1.735}, {0.392, 1.750},                                  // lid
    {0.345, 1.815}, {0.262, 1.868}, {0.165, 1.902}, {0.095, 1.925}, {0.062, 1.958},
    {0.070, 1.990}, {0.110, 2.030}, {0.128, 2.085},  // knob
    {0.108, 2.145}, {0.062, 2.190}, {0.000, 2.210}};

class Urn {
 public:
  Urn() : profile_(kUrnProfile) {}
  const Profile& profile() const { return profile_; }

  Point operator()(const SurfacePoint& at) const {
    const Point& p = at.position;
    // The shape leans and swells slightly, since hand-made stone is irregular.
    const double swell = 0.010 * gradient_noise(1.7 * p, 11);
    double height = relief(at);
    height = wear(p, height) + swell + stone(p, at.spacing);
    const Point moved = p + height * at.normal;
    return {moved.x, moved.y - 1.105, moved.z};
  }

 private:
  struct Band {
    double arc_low, arc_high;
  };
  Band between(Mark low, Mark high) const {
    return {profile_.arc_of_control(low), profile_.arc_of_control(high)};
  }

  /// True if a point lies in a band; also returns its coordinates in the band.
  static bool in_band(const SurfacePoint& at, const Band& band, int repeats, BandPoint& p) {
    if (at.arc < band.arc_low || at.arc > band.arc_high) return false;
    p.height = band.arc_high - band.arc_low;
    p.y = (at.arc - band.arc_low) / p.height;
    p.x = at.angle / (2 * std::numbers::pi) * repeats;
    p.width = 2 * std::numbers::pi * at.radius / repeats;
    p.edge = std::max(0.004, 1.8 * at.spacing);
    return true;
  }

  /// A half-round moulding of a given width centred on an arc length.
  static double bead_line(const SurfacePoint& at, double arc, double half_width) {
    const double d = (at.arc - arc) / half_width;
    return std::abs(d) >= 1 ? 0 : 0.8 * half_width * std::sqrt(1 - d * d);
  }

  double relief(const SurfacePoint& at) const {
    BandPoint p{};
    double h = 0;
    if (in_band(at, between(foot_low, foot_high), 44, p)) h = std::max(h, beads(p));
    if (in_band(at, between(ring_low, ring_high), 34, p)) h = std::max(h, rope(p));
    if (in_band(at, between(leaves_low, leaves_high), 16, p)) h = std::max(h, leaves(p));
    const double line = 0.013;
    const Band braid{profile_.arc_of_control(leaves_high) + 2.2 * line,
                     profile_.arc_of_control(braid_high)};
    if (in_band(at, braid, 11, p)) h = std::max(h, guilloche(p));
    const Band scale_band{braid.arc_high + 2.2 * line, profile_.arc_of_control(scales_high)};
    if (in_band(at, scale_band, 44, p)) h = std::max(h, scales(p, 4));
    const Band meander_band{scale_band.arc_high + 2.4 * line, profile_.arc_of_control(key_high)};
    if (in_band(at, meander_band, 21, p)) h = std::max(h, meander(p));
    if (in_band(at, between(lip_low, lip_high), 52, p)) h = std::max(h, rope(p));
    if (in_band(at, between(lid_low, lid_high), 18, p)) h = std::max(h, gadroons(p, 1.6));
    if (in_band(at, between(knob_low, knob_high), 12, p)) h = std::max(h, scales(p, 5));
    for (const double arc :
         {braid.arc_low - 1.1 * line, braid.arc_high + 1.1 * line, scale_band.arc_high + 1.2 * line,
          meander_band.arc_high + 1.1 * line}) {
      h = std::max(h, bead_line(at, arc, line));
    }
    if (in_band(at, between(neck_low, neck_high), 26, p)) h += flutes(p);
    return h;
  }

  /// Wear: edges are abraded in some regions, and pieces have broken off.
  static double wear(const Point& p, double height) {
    const double rubbed = 0.72 + 0.28 * smooth_step(-0.4, 0.3, fractal_noise(2.6 * p, 3, 21));
    height *= rubbed;
    const double where = fractal_noise(3.1 * p, 2, 31);
    const double limit =
        0.004 + 0.10 * smooth_step(0.56, 0.38, where) + 0.010 * ridged_noise(14 * p, 3, 41);
    return std::min(height, limit);
  }

  /// Cracks, pits and grain.
  static double stone(const Point& p, double spacing) {
    const Point warp{fractal_noise(5 * p, 3, 51), fractal_noise(5 * p, 3, 61),
                     fractal_noise(5 * p, 3, 71)};
    const Point q = p + 0.06 * warp;
    const Cells blocks = cellular_noise(2.3 * q, 81);
    const double crack_width = std::max(0.006, 1.2 * spacing) *
                               (0.6 + 0.8 * smooth_step(-0.3, 0.6, gradient_noise(6 * p, 82)));
    const double cracked = smooth_step(0.02, 0.25, gradient_noise(1.3 * p, 83));
    double h = -0.016 * cracked * smooth_step(crack_width, 0, blocks.border / 2.3);
    h += 0.005 * cracked *
         (unit_from(blocks.cell_hash) - 0.5);  // blocks between cracks have different depths

    const Cells holes = cellular_noise(24 * p, 91);
    const double size = 0.10 + 0.28 * unit_from(holes.cell_hash);
    const double pitted = smooth_step(0.0, 0.5, gradient_noise(2.2 * p, 92));
    if (unit_from(holes.cell_hash * 2654435761u) < 0.45 * pitted) {
      h -= 0.005 * smooth_step(size, 0.35 * size, holes.nearest);
    }
    h += 0.0016 * fractal_noise(16 * p, 3, 101);
    // Grain finer than the mesh's edges would alias.
    h += 0.0009 * smooth_step(0.012, 0.003, spacing) * fractal_noise(85 * p, 2, 111);
    return h;
  }

  Profile profile_;
};

}  // namespace

void urn(std::uint64_t faces, MeshPieceSink& sink) {
  const Urn shape;
  sweep(
      shape.profile(), faces, [&](const SurfacePoint& at) { return shape(at); }, sink);
}

Mesh urn(std::uint64_t faces) {
  const Urn shape;
  Mesh mesh = sweep(shape.profile(), faces, [&](const SurfacePoint& at) { return shape(at); });
  mesh.name = "urn";
  return mesh;
}

}  // namespace kiln::sample
