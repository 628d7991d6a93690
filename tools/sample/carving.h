// Relief patterns for bands of a surface of revolution.
//
// All take `x` around and `y` along the band, lengths on the surface, and give a height over the smooth
// surface (negative: carved in). `edge` is the width over which a hard edge rises.
#pragma once

namespace kiln::sample {

/// Coordinates of a point in a band, from `band_at`.
struct BandPoint {
  double x;       ///< Around, in repeats of the pattern: [0, repeats)
  double y;       ///< Along, 0 at the band's start, 1 at its end
  double width;   ///< Length of one repeat around, here
  double height;  ///< Length of the band along
  double edge;    ///< Rise of a hard edge, length
};

/// A row of half spheres that touch, one a repeat.
double beads(const BandPoint& p);

/// A moulding: a half-round over the band's whole height.
double moulding(const BandPoint& p);

/// A twisted cord over the band's whole height, `p.x` in strands.
double rope(const BandPoint& p);

/// Two layers of pointed leaves that grow with y, with midrib and rim; one of each a repeat.
double leaves(const BandPoint& p);

/// Two interlaced cords around bosses; two crossings a repeat.
double guilloche(const BandPoint& p);

/// Overlapping scales in `rows` rows, free edges towards y = 0; one of a row a repeat.
double scales(const BandPoint& p, int rows);

/// A running key pattern; one key a repeat.
double meander(const BandPoint& p);

/// A concave flute with round ends a repeat.
double flutes(const BandPoint& p);

/// Convex lobes that wind around by `twist` repeats over the band.
double gadroons(const BandPoint& p, double twist);

}  // namespace kiln::sample
