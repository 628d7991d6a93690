#pragma once

#include <memory>

#include "kiln/export.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Progress and cancellation of Kiln's functions on this thread.
///
/// While a scope exists, long functions without a callback parameter report to its callback ten times a second:
/// simplify(), unwrap(), contour(), extract(), VolumeSession, measuring, sessions. If it cancels, the function
/// throws Error(ErrorCode::cancelled) within 0.3 s and leaves no partial result; functions whose result has
/// `cancelled` set that instead. A callback parameter takes precedence over the scope. The innermost scope of a
/// thread counts. The reported share is 0 if it is unknown.
///
///     const kiln::ProgressScope scope([&](double, std::string_view) { return !window.closed(); });
///     const kiln::Mesh low = kiln::simplify(high, {.faces = 5000});
///
/// Threads: a scope applies to the thread that constructs it, and must be destroyed there. See Progress for what
/// the callback may do.
class ProgressScope {
 public:
  /// \param progress  callback; may be empty, and the scope then has no effect
  explicit ProgressScope(Progress progress);
  ~ProgressScope();
  ProgressScope(const ProgressScope&) = delete;  ///< Not copyable, since it is bound to its block
  /// Not copyable, since it is bound to its block
  ProgressScope& operator=(const ProgressScope&) = delete;

  /// Reports to the callback now.
  /// \param done  completed share, [0, 1].
  /// \throws Error(cancelled) if it cancels
  void at(double done, std::string_view stage);

 private:
  struct Impl;
  Impl* const impl_;
};

}  // namespace kiln
