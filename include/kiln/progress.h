#pragma once

#include <memory>

#include "kiln/export.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Signs of life of whatever Kiln does on this thread, and a way to stop it.
///
/// While a scope lives, long functions that take no callback of their own tell it, ten times a second: simplify(),
/// unwrap(), contour(), extract(), VolumeSession, measuring, sessions. Where it says stop, the function throws
/// Error(ErrorCode::cancelled) within 0.3 s and leaves nothing behind; calls that have a `cancelled` in their
/// result set that instead. A callback of their own goes before the scope's. Of scopes on one thread the innermost
/// counts. The share done is 0 where it is not known.
///
///     const kiln::ProgressScope scope([&](double, std::string_view) { return !window.closed(); });
///     const kiln::Mesh low = kiln::simplify(high, {.faces = 5000});
///
/// Threads: it counts on the thread that made it, and ends there. What the callback may do: see Progress.
class ProgressScope {
 public:
  /// \param progress  may be empty: then nothing changes
  explicit ProgressScope(Progress progress);
  ~ProgressScope();
  ProgressScope(const ProgressScope&) = delete;             ///< It belongs to its block
  ProgressScope& operator=(const ProgressScope&) = delete;  ///< It belongs to its block

  /// Tells the callback now. \param done  [0, 1]. \throws Error(cancelled) where it says stop
  void at(double done, std::string_view stage);

 private:
  struct Impl;
  Impl* const impl_;
};

}  // namespace kiln
