// Calls from Python into the library: they release the GIL, and support progress and Ctrl-C.
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

/// State of a library call on this thread. Construct it with the GIL held.
class Call {
 public:
  /// \param progress  None, or a callback (completed share, stage); the call stops if it returns False
  /// \throws Error(usage) if called from one of the library's callbacks; Error(device) in a forked child
  explicit Call(nb::object progress = nb::none());
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// A Progress for library functions. It checks for signals such as Ctrl-C, then calls the caller's callback.
  Progress progress() const;

  /// Runs a function without the GIL. \throws exceptions of the function; Error(cancelled) if the callback stopped it
  template <typename Function>
  auto run(Function&& function) const {
    const nb::gil_scoped_release unlocked;
    const ProgressScope scope(progress());
    return function();
  }

  /// Runs a function that reports shares of the whole work to a Progress. Nested calls, which know only their own
  /// share, just poll. Reported shares never fall.
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

/// \throws Error(cancelled) if a result is cancelled
void check_cancelled(bool cancelled);

/// The device of a name, opened once per process. Call without the GIL. \throws Error(device)
const Device& device_of(const std::string& name);

/// Issues each warning as a kiln.KilnWarning.
void warn(const std::vector<Warning>& warnings);

/// Converts names and messages to str. Bytes that are not UTF-8 become \xNN.
nb::str text_of(std::string_view bytes);
/// A list of converted texts.
nb::list texts_of(const std::vector<std::string>& bytes);

/// Converts a caller's path. \throws kiln.Error
std::filesystem::path path_of(nb::handle given);

/// Registers the conversion of the library's exceptions to kiln.Error.
void register_errors(nb::module_& module);

}  // namespace kiln::python
