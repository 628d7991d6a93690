// Calls the library from Python: releases the GIL, reports progress, and handles Ctrl-C.
#pragma once

#include <nanobind/nanobind.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/progress.h"

namespace kiln {
class Device;
}

namespace kiln::python {

namespace nb = nanobind;

/// A library call on the current thread. It must be constructed with the GIL held.
class Call {
 public:
  /// Starts a call.
  /// \param progress  None, or a callback (completed share, stage); the call stops if it returns False
  /// \throws Error(usage) if called from one of the library's callbacks; Error(device) in a forked child
  explicit Call(nb::object progress = nb::none());
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Returns a Progress for library functions. It checks for signals such as Ctrl-C, then calls the caller's callback.
  Progress progress() const;

  /// Runs a function without the GIL. \throws the function's exceptions; Error(cancelled) if the callback stopped it
  template <typename Function>
  auto run(Function&& function) const {
    const nb::gil_scoped_release unlocked;
    const ProgressScope scope(progress());
    return function();
  }

  /// Runs a function that reports shares of the whole work to a Progress. Nested calls only know their own share, so
  /// they only poll. Reported shares never decrease.
  template <typename Function>
  auto run_whole(Function&& function) const {
    const nb::gil_scoped_release unlocked;
    const Progress report = progress();
    double last = 0;
    const ProgressScope scope([&](double, std::string_view stage) { return report(last, stage); });
    return function([&](double done, std::string_view stage) {
      last = std::max(last, done);
      return report(last, stage);
    });
  }

 private:
  nb::object progress_;
};

/// Throws if a result is cancelled. \throws Error(cancelled)
void check_cancelled(bool cancelled);

/// Returns the device with a name; each is opened once per process. Call it without the GIL. \throws Error(device)
const Device& device_of(const std::string& name);

/// Issues each warning as a kiln.KilnWarning.
void warn(const std::vector<Warning>& warnings);

/// Converts a name or a message to str. Bytes that are not UTF-8 become \xNN.
nb::str text_of(std::string_view bytes);
/// Converts texts to a list of str, as text_of() does.
nb::list texts_of(const std::vector<std::string>& bytes);

/// Converts the caller's path. \throws kiln.Error
std::filesystem::path path_of(nb::handle given);

/// Registers the conversion of the library's exceptions to kiln.Error.
void register_errors(nb::module_& module);

}  // namespace kiln::python
