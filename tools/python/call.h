// Calls from Python into the library: without the interpreter's lock, with progress and Ctrl-C.
#pragma once

#include <nanobind/nanobind.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kiln/kiln.h"

namespace kiln::python {

namespace nb = nanobind;

/// State of a call of the library that runs on this thread. Made with the lock held.
class Call {
 public:
  /// \param progress  None, or called with (share done, stage); False stops the call
  /// \throws Error(usage) from within a callback of the library's, Error(device) in a forked child
  explicit Call(nb::object progress = nb::none());
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// For functions that take one: looks for signals such as Ctrl-C, then asks the caller's callback.
  Progress progress() const;

  /// Runs a function without the lock. \throws what it throws; Error(cancelled) where the callback said stop
  template <typename Function>
  auto run(Function&& function) const {
    const nb::gil_scoped_release unlocked;
    const ProgressScope scope(progress());
    return function();
  }

  /// Runs a function that takes a Progress and tells shares of the whole: calls within it, which know their own part
  /// alone, give signs of life. Shares never fall.
  template <typename Function>
  auto run_whole(Function&& function) const {
    const nb::gil_scoped_release unlocked;
    const Progress tell = progress();
    double last = 0;
    const ProgressScope scope([&](double, std::string_view stage) { return tell(last, stage); });
    return function([&](double done, std::string_view stage) {
      last = std::max(last, done);
      return tell(last, stage);
    });
  }

 private:
  nb::object progress_;
};

/// \throws Error(cancelled) where a result says that the callback said stop
void check_cancelled(bool cancelled);

/// The device of a name, opened once a process. The lock is not held. \throws Error(device)
const Device& device_of(const std::string& name);

/// Each one a Python warning of kiln.KilnWarning.
void warn(const std::vector<Warning>& warnings);

/// Names and messages may hold bytes of files, which are no text always: \xNN then.
nb::str text_of(std::string_view bytes);
/// A list of them.
nb::list texts_of(const std::vector<std::string>& bytes);

/// The path that a caller gave. \throws kiln.Error
std::filesystem::path path_of(nb::handle given);

/// Turns the library's exceptions into kiln.Error.
void register_errors(nb::module_& module);

}  // namespace kiln::python
