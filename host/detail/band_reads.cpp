#include "detail/band_reads.h"

#include <utility>

namespace kiln {

template <typename T>
void BandReads::spare() {
  std::vector<std::vector<T>>& list = std::get<std::vector<std::vector<T>>>(spare_);
  for (auto& [array, values] : std::get<Kept<T>>(band_)) list.push_back(std::move(values));
  std::get<Kept<T>>(band_).clear();
}

void BandReads::next_band() {
  // Drops spare arrays that the band before had no use for.
  spare_ = {};
  spare<std::uint32_t>();
  spare<float>();
  spare<std::uint8_t>();
}

void BandReads::next_source() {
  next_band();
  source_ = {};
  ++source_version_;
}

}  // namespace kiln
