// The match (F), whichever method it is: from a band's samples to their correspondences.
#pragma once

#include <memory>

#include "match.h"
#include "source.h"
#include "texels.h"
#include "views.h"

namespace kiln {

class Matcher {
 public:
  Matcher() = default;
  Matcher(const Matcher&) = delete;
  Matcher& operator=(const Matcher&) = delete;
  virtual ~Matcher() = default;

  /// Writes the correspondences of a band's samples; enqueued, or finished.
  virtual void run(const TexelBand& band, Correspondence& match) = 0;

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
/// \throws Error(usage) for an option out of its range
std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report);

}  // namespace kiln
