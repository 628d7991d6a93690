#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Kinds of failure that an Error reports. The values are the command line's exit codes.
enum class ErrorCode {
  internal = 1,     ///< A defect of Kiln, or out of memory.
  usage = 2,        ///< A parameter is out of range, or two contradict each other.
  input = 3,        ///< A file or a mesh cannot be used.
  device = 4,       ///< No OpenCL device, or a device call failed.
  output = 5,       ///< A result could not be written. No partial file remains.
  cancelled = 130,  ///< A ProgressScope's callback cancelled. Not a fault.
};

/// The one exception type that leaves the library (beside std::bad_alloc).
///
/// id() is for programs: it is stable across versions, while messages may improve. The message is
/// one or two sentences for users, which name the file or option, the problem and the remedy.
/// Options are written between backticks, as the member's path below BakeOptions or its own struct:
/// `match.cage`, `keep_uvs`; likewise in warnings.
class Error : public std::runtime_error {
 public:
  /// \param message  for users: the file or parameter, the problem, the remedy
  /// \param id       see id(): a string with static lifetime; null: the kind's name
  Error(ErrorCode code, const std::string& message, const char* id = nullptr)
      : std::runtime_error(message), code_(code), id_(id != nullptr ? id : name_of(code)) {}
  Error(const Error&) = default;             ///< Does not throw
  Error& operator=(const Error&) = default;  ///< Does not throw
  ~Error() override;                         ///< Defined in the library, and with it the type
                                             ///< information that catching needs
  /// The kind of failure.
  ErrorCode code() const noexcept { return code_; }
  /// Identifier of the problem, words of a-z and dashes, such as `mesh-index` or `match-weight`; functions
  /// document theirs. Else the kind's name: `internal`, `usage`, `input`, `device`, `output`, `cancelled`.
  /// Never null.
  const char* id() const noexcept { return id_; }
  /// The first option in the message, such as "match.cage"; empty if it names none. Lives as long as
  /// the error.
  std::string_view option() const noexcept;

 private:
  static constexpr const char* name_of(ErrorCode code) noexcept {
    switch (code) {
      case ErrorCode::usage:
        return "usage";
      case ErrorCode::input:
        return "input";
      case ErrorCode::device:
        return "device";
      case ErrorCode::output:
        return "output";
      case ErrorCode::cancelled:
        return "cancelled";
      case ErrorCode::internal:
        break;
    }
    return "internal";
  }

  ErrorCode code_;
  const char* id_;
};

/// Imperfect data that was handled by a documented rule.
struct Warning {
  std::string code;     ///< Stable identifier for scripts, such as "degenerate-triangles".
  std::string message;  ///< One sentence for users: the fault, the count, an example, the handling.
  std::uint64_t count = 0;  ///< Number of affected elements.
};

}  // namespace kiln
