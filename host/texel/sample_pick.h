// Gathers some samples of a band, and scatters their results back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/kernels_shared.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Copies values of chosen samples on the device, without a transfer to the host (kernels/texel/texel.cl).
class SamplePick {
 public:
  /// \param multiple the length of planes is rounded up to a multiple of this, for kernels that read beyond
  /// the last sample
  SamplePick(cl::Context& context, std::span<const std::uint32_t> samples,
             std::uint32_t multiple = 1)
      : context_(context),
        count_(static_cast<std::uint32_t>(samples.size())),
        capacity_((count_ + multiple - 1) / multiple * multiple),
        samples_(context, samples) {}

  std::uint32_t count() const { return count_; }
  std::uint32_t capacity() const { return capacity_; }

  /// Gathers the picked samples' values from arrays that are stored one after another, one per
  /// component, with elements of 1 or 4 bytes. Elements beyond the last sample are 0. \param
  /// capacity length of each array in `from`
  template <typename T>
  cl::Array<T> of(const cl::Array<T>& from, std::uint32_t capacity, std::uint32_t planes) const {
    static_assert(sizeof(T) == 1 || sizeof(T) == 4);
    const char* const kernel = sizeof(T) == 1 ? "kiln_texel_gather_bytes" : "kiln_texel_gather";
    cl::Array<T> to(context_, std::size_t{planes} * capacity_);
    context_.launch(context_.kernel("texel", kernel), capacity_, kLocal, count_, planes, capacity,
                    capacity_, samples_, from, to);
    return to;
  }

  /// Gathers the samples' points from a band, and none of its other data.
  TexelBand gather_points(const TexelBand& band) const {
    TexelBand some;
    some.sample_count = count_;
    some.capacity = capacity_;
    some.points = of(band.points, band.capacity, 7);
    return some;
  }

  DeviceCorrespondence of(const DeviceCorrespondence& match) const {
    DeviceCorrespondence some;
    some.count = count_;
    some.capacity = capacity_;
    some.triangle = of(match.triangle, match.capacity, 1);
    some.barycentric = of(match.barycentric, match.capacity, 2);
    some.distance = of(match.distance, match.capacity, 1);
    some.status = of(match.status, match.capacity, 1);
    if (!match.seen.empty()) some.seen = of(match.seen, match.capacity, 3);
    return some;
  }

  /// Copies the correspondence of the samples back into `match`; misses leave `match` unchanged.
  void scatter_correspondence(const DeviceCorrespondence& found,
                              const DeviceCorrespondence& match) const {
    context_.launch(context_.kernel("texel", "kiln_texel_scatter_results"), count_, kLocal, count_,
                    found.capacity, match.capacity, samples_, found.triangle, found.barycentric,
                    found.distance, found.status, match.triangle, match.barycentric, match.distance,
                    match.status);
  }

 private:
  cl::Context& context_;
  std::uint32_t count_, capacity_;
  cl::Array<std::uint32_t> samples_;
};

/// Selects, among the first `count` samples, those whose status (kiln_sample_status) satisfies a predicate, in their
/// order. The list is on the host, since later launches need its length.
template <typename Wanted>
std::vector<std::uint32_t> samples_with(cl::Context& context, const DeviceCorrespondence& match,
                                        std::uint32_t count, const Wanted& wanted) {
  std::vector<std::uint8_t> status(count);
  match.status.read(context, status);
  std::vector<std::uint32_t> samples;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (wanted(status[i])) samples.push_back(i);
  }
  return samples;
}

inline bool is_missed(std::uint8_t status) { return status == KILN_STATUS_MISS; }

}  // namespace kiln
