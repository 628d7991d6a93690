// The correspondence: the results of a match per sample.
#ifndef KILN_SHARED_MATCH_H
#define KILN_SHARED_MATCH_H

#include "shared/common.h"

/// Provenance of a sample: the method that decided it, or the kind of miss.
enum kiln_sample_status {
  KILN_STATUS_NONE = 0,     ///< No sample here (texel not covered)
  KILN_STATUS_OUTWARD = 1,  ///< Ray outward, along the direction
  KILN_STATUS_INWARD = 2,   ///< Ray inward, against the direction
  KILN_STATUS_CAGE = 3,     ///< Ray from the cage inward
  KILN_STATUS_MISS = 4,     ///< No point within the distance
  KILN_STATUS_VIEW = 5,     ///< Seen in a depth view
  KILN_STATUS_CLOSEST = 6,  ///< Nearest point
  KILN_STATUS_UV = 7,       ///< Point of the high poly with the same UV
  KILN_STATUS_OUTERMOST = 8,  ///< Ray outward that passed through a nearer face
  KILN_STATUS_COUNT = 9
};

#endif
