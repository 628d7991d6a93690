#include "call.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <unistd.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>

#include "kiln/device.h"
#include "kiln/option_error.h"

namespace kiln::python {
namespace {

/// Id of the process that opened the first device. A forked child has no threads of the driver, so it must not use the
/// device.
std::atomic<pid_t> id_of_opening_process{0};
thread_local bool in_callback = false;

nb::object errors() { return nb::module_::import_("kiln._errors"); }

/// Raises kiln.Error with the option's name, value, allowed values and remedies.
void raise(const Error& error) {
  try {
    const Message message = error.message();
    nb::dict error_facts;
    error_facts["parameter"] = error.option().empty()
                                   ? nb::object(nb::none())
                                   : text_of(option_as_keyword(error.option(), {}));
    if (const auto* const option_error = dynamic_cast<const OptionError*>(&error)) {
      error_facts["value"] = text_of(option_error->value());
      error_facts["allowed"] = text_of(option_error->allowed());
    }
    nb::list remedies;
    for (const MessagePiece& piece : remedies_of(message)) {
      remedies.append(
          nb::make_tuple(text_of(option_as_keyword(piece.option, {})), text_of(piece.value)));
    }
    error_facts["remedies"] = remedies;
    // an error without an id gets the id of its code
    const char* const kind = Error(error.code(), "").id();
    const nb::object exception = errors().attr("from_core")(
        text_of(message.text(option_as_keyword)), error.id(), kind, error_facts);
    PyErr_SetObject(exception.type().ptr(), exception.ptr());
  } catch (nb::python_error& other) {
    other.restore();
  }
}

void translate(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Error& error) {
    raise(error);
  }
}

/// True for Python's False, and for false boolean scalars of NumPy and other array libraries, as from `done < limit`.
/// 0 or an empty list do not count, since a callback may return these by accident.
bool is_false(const nb::object& result) {
  if (!nb::hasattr(result, "dtype")) return result.ptr() == Py_False;
  const nb::object type = result.attr("dtype");
  return std::string_view(nb::str(type).c_str()).ends_with("bool") &&
         !static_cast<bool>(nb::bool_(result));
}

}  // namespace

Call::Call(nb::object progress) : progress_(std::move(progress)) {
  if (in_callback) {
    throw Error(ErrorCode::usage,
                "Kiln was called from within one of its callbacks, for which the device waits: "
                "return from the callback first.",
                "callback");
  }
  const pid_t process = id_of_opening_process;
  if (process != 0 && process != getpid()) {
    throw Error(
        ErrorCode::device,
        "This process was forked after Kiln had opened a device, whose threads do not exist in the "
        "child: start it by multiprocessing.get_context('spawn'), or use Kiln only in the child.",
        "forked");
  }
}

Call::~Call() = default;

Progress Call::progress() const {
  return [this](double done, std::string_view stage) {
    const nb::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (progress_.is_none()) return true;
    struct CallbackScope {
      CallbackScope() { in_callback = true; }
      ~CallbackScope() { in_callback = false; }
    } const inside;
    return !is_false(progress_(done, stage));
  };
}

void check_cancelled(bool cancelled) {
  if (cancelled) throw Error(ErrorCode::cancelled, "Cancelled by the callback.");
}

const Device& device_of(const std::string& name) {
  static std::mutex mutex;
  // The map of open devices is never destroyed, since the driver may be unloaded before the interpreter frees the last
  // objects that use a device.
  static auto* const devices = new std::map<std::string, Device>;
  const std::lock_guard lock(mutex);
  const auto cached_device = devices->find(name);
  if (cached_device != devices->end()) return cached_device->second;
  id_of_opening_process = getpid();
  return devices->emplace(name, Device::open(name)).first->second;
}

void warn(const std::vector<Warning>& warnings) {
  if (warnings.empty()) return;
  const nb::object warn = errors().attr("warn");
  for (const Warning& warning : warnings)
    warn(warning.code, text_of(warning.message.text(option_as_keyword)), warning.count);
}

nb::str text_of(std::string_view bytes) {
  return nb::steal<nb::str>(PyUnicode_DecodeUTF8(
      bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "backslashreplace"));
}

nb::list texts_of(const std::vector<std::string>& bytes) {
  nb::list texts;
  for (const std::string& text : bytes) texts.append(text_of(text));
  return texts;
}

std::filesystem::path path_of(nb::handle given) {
  return nb::cast<std::filesystem::path>(errors().attr("path_of")(given));
}

void register_errors(nb::module_&) { nb::register_exception_translator(translate); }

}  // namespace kiln::python
