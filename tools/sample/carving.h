// Relief patterns for bands of a surface of revolution.
//
// Each function takes a point of the band and returns the height of the relief over the smooth surface, as a length
// (negative: carved in).
#pragma once

namespace kiln::sample {

/// Coordinates of a point in a band, from `band_at`.
struct BandPoint {
  double x;       ///< Position around the axis, in repeats of the pattern: [0, number of repeats)
  double y;       ///< Position across the band: 0 at its start, 1 at its end
  double width;   ///< Length of one repeat of the pattern around the axis at this point
  double height;  ///< Width of the band, measured along the profile
  double edge;    ///< Length over which a hard edge rises
};

/// A row of half spheres that touch, one per repeat.
double beads(const BandPoint& p);

/// A moulding with a half circle as profile over the band's whole height.
double half_round_moulding(const BandPoint& p);

/// A twisted cord over the band's whole height, `p.x` in strands.
double rope(const BandPoint& p);

/// Two layers of pointed leaves with midrib and rim, whose tips point towards y = 1; one leaf of each layer per repeat.
double leaves(const BandPoint& p);

/// Two interlaced cords around bosses, with two crossings per repeat.
double guilloche(const BandPoint& p);

/// Overlapping scales in `rows` rows, with free edges towards y = 0; one scale of each row per repeat.
double scales(const BandPoint& p, int rows);

/// A running key pattern, with one key per repeat.
double meander(const BandPoint& p);

/// Concave flutes with round ends, one per repeat.
double flutes(const BandPoint& p);

/// Convex lobes that wind around by `twist` repeats over the band.
double gadroons(const BandPoint& p, double twist);

}  // namespace kiln::sample
