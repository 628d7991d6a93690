// The interface of matches: from a band's samples to their correspondences.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// The method that found a sample's point: none, the match itself, or a fallback.
enum class DecidingMethod : std::uint8_t { nothing, method, fallback };

/// The report and the warnings of a match.
struct MatchNotes {
  std::optional<ViewReport> views;
  std::optional<VisibilityReport> visibility;
  std::optional<UvReport> uv;
  std::vector<Warning> warnings;
};

/// Checks the number of samples per texel. Kernels index arrays of the map's samples by sample_slot; with more
/// samples they would read past the end, and kernels cannot report errors.
/// \throws Error(internal) if the band has another number of samples per texel than `samples` a side
inline void check_samples(const TexelBand& band, std::uint32_t samples) {
  if (band.samples == samples) return;
  throw Error(ErrorCode::internal,
              "Internal error: a match that was prepared for " + std::to_string(samples) + " x " +
                  std::to_string(samples) + " samples a texel cannot read texels of " +
                  std::to_string(band.samples) + " x " + std::to_string(band.samples) + ".");
}

class Matcher {
 public:
  Matcher() = default;
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;
  virtual ~Matcher() = default;

  /// Computes the correspondences of a band's samples. The kernels may still be running when it returns.
  virtual void run(const TexelBand& band, DeviceCorrespondence& match) = 0;

  /// True if the matcher reads other data of a band than its points; the band must then hold all
  /// samples of its texels.
  virtual bool needs_whole_texels() const { return false; }

  /// True if the matcher reads samples' positions within texels (TexelBand::sample_slot); it then only
  /// supports bands with the number of samples per texel that it was made for.
  virtual bool reads_sample_positions() const { return false; }

  /// The method that found the point of each sample of the last band; empty without fallbacks.
  virtual std::span<const DecidingMethod> deciding_methods() const { return {}; }

  /// Runs the fallbacks on the given samples of a band, in the order of the list.
  /// \param found receives the results; enlarged if it is too small
  /// \throws Error(internal) without fallbacks
  virtual void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                            DeviceCorrespondence& found);

  /// True if samples keep their matched triangle and weights when the high poly's vertices move, so
  /// that only distances change.
  virtual bool keeps_surface_points() const { return false; }
  /// Updates positions of vertices [first, first + positions.size()), if keeps_surface_points(). Frame
  /// units.
  virtual void move(std::uint32_t /*first*/, std::span<const Vec3> /*positions*/) {}
  /// Recomputes the distances of a band's samples, if keeps_surface_points().
  virtual void measure(const TexelBand& /*band*/, DeviceCorrespondence& /*match*/) {}

  /// Adds the parts of the report that are complete only after the last band. \throws Error(input) if the match does
  /// not suit the meshes
  virtual void finish(MatchNotes& /*notes*/) {}
};

}  // namespace kiln
