// The match (F), whichever method it is: from a band's samples to their correspondences.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "accel/depth_views.h"
#include "match/visibility.h"
#include "source/dense_mesh.h"
#include "texel/correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Of a bake's progress, what preparing takes for methods that prepare for long.
inline constexpr double kPreparingShare = 0.5;

/// Which of two methods decided a sample.
enum class Decider : std::uint8_t { nothing, method, fallback };

class Matcher {
 public:
  Matcher() = default;
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;
  virtual ~Matcher() = default;

  /// Writes the correspondences of a band's samples; enqueued, or finished.
  virtual void run(const TexelBand& band, Correspondence& match) = 0;

  /// Of each sample of the last band; empty where there is no fallback.
  virtual std::span<const Decider> deciders() const { return {}; }

  /// What the fallback says of some samples of a band, in their order.
  /// \param found  grown where it is too small
  /// \throws Error(internal) where there is none
  virtual void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                            Correspondence& found);

  /// Adds what is known after the last band to the report. \throws Error(input) where the match is unfit
  virtual void finish(BakeReport& /*report*/) {}
};

/// Checks everything in the options that needs no mesh. \throws Error(usage)
void check_options(const BakeOptions& options);

/// A view's direction with length 1. \throws Error(usage) where it has none
Vec3d unit_direction(const Vec3& toward);

/// What the options ask of matching by views.
ViewQuery view_query(const BakeOptions& options, const LowSurface& surface, const Frame& frame);

/// The matcher that the options ask for, with what it needs of the source built. Adds to the report what
/// is known before the first band.
/// \throws Error(usage) for an option out of its range, Cancelled where the progress callback says stop
/// \param cluster  with several clusters of directions, which one
/// \param field    their field: made where it is null, for the clusters after this one
std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      std::uint32_t cluster,
                                      std::shared_ptr<const VisibilityField>& field);

}  // namespace kiln
