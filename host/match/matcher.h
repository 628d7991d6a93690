// The match (F), whichever method it is: from a band's samples to their correspondences.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "kiln/bake.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// True if the method decided a sample, or one of its fallbacks.
enum class Decider : std::uint8_t { nothing, method, fallback };

/// Reports and warnings of a match.
struct MatchNotes {
  std::optional<ViewReport> views;
  std::optional<VisibilityReport> visibility;
  std::optional<UvReport> uv;
  std::vector<Warning> warnings;
};

/// The kernels of matches that read sample places index arrays of the map's samples by them: a band of other samples
/// would read beyond these, so it is refused here, where a message is still possible.
/// \throws Error(internal) where the band has another number of samples a texel than `samples` a side
inline void check_samples(const TexelBand& band, std::uint32_t samples) {
  if (band.samples == samples) return;
  throw Error(ErrorCode::internal, "A match made for " + std::to_string(samples) +
                                       " samples a side of a texel was given " +
                                       std::to_string(band.samples) + ".");
}

class Matcher {
 public:
  Matcher() = default;
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;
  virtual ~Matcher() = default;

  /// Writes the correspondences of a band's samples; enqueued, or finished.
  virtual void run(const TexelBand& band, DeviceCorrespondence& match) = 0;

  /// True if it reads more of a band than its points: then it must be given all samples of whole texels.
  virtual bool needs_band() const { return false; }

  /// True if it reads where samples lie within their texels (TexelBand::sample_slot): it serves bands with the
  /// number of samples a texel that it was made for, and no others.
  virtual bool reads_sample_places() const { return false; }

  /// Decider of each sample of the last band; empty where there is no fallback.
  virtual std::span<const Decider> deciders() const { return {}; }

  /// Asks the fallbacks for some samples of a band, in their order.
  /// \param found  grown where it is too small
  /// \throws Error(internal) where there is none
  virtual void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                            DeviceCorrespondence& found);

  /// True if samples keep their points as the high poly's vertices move, so that only distances change.
  virtual bool points_stay() const { return false; }
  /// Called if points_stay(): vertices [first, first + positions.size()) moved. Frame units
  virtual void move(std::uint32_t /*first*/, std::span<const Vec3> /*positions*/) {}
  /// Called if points_stay(): measures the distances of a band's samples anew.
  virtual void measure(const TexelBand& /*band*/, DeviceCorrespondence& /*match*/) {}

  /// Adds what is known after the last band. \throws Error(input) where the match is unfit
  virtual void finish(MatchNotes& /*notes*/) {}
};

}  // namespace kiln
