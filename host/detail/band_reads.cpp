#include "detail/band_reads.h"

namespace kiln {

void BandReads::next_band() { band_ = {}; }

void BandReads::next_source() {
  next_band();
  source_ = {};
  ++source_version_;
}

}  // namespace kiln
