// The correspondence: what a match writes for each sample.
#ifndef KILN_SHARED_MATCH_H
#define KILN_SHARED_MATCH_H

#include "shared/common.h"

/// Provenance of a sample: which method decided it, or why none did.
enum kiln_sample_status {
  KILN_STATUS_NONE = 0,     ///< No sample here (texel not covered)
  KILN_STATUS_OUTWARD = 1,  ///< Ray along the direction
  KILN_STATUS_INWARD = 2,   ///< Ray against the direction
  KILN_STATUS_CAGE = 3,     ///< Ray from the cage inward
  KILN_STATUS_MISS = 4,     ///< No point within the distance
  KILN_STATUS_VIEW = 5,     ///< Seen in a depth view
  KILN_STATUS_CLOSEST = 6,  ///< The nearest point
  KILN_STATUS_UV = 7,       ///< The point with the same UV
  KILN_STATUS_OUTERMOST = 8,  ///< Ray along the direction, past a nearer face
  KILN_STATUS_COUNT = 9
};

#endif
