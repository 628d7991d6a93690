#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// Kinds of failure that an Error reports. The values are the command line's exit codes.
enum class ErrorCode {
  internal = 1,     ///< A defect of Kiln, or out of memory.
  usage = 2,        ///< A parameter is out of its range, or two contradict each other.
  input = 3,        ///< A file or a mesh cannot be used.
  device = 4,       ///< No OpenCL device, or a device call failed.
  output = 5,       ///< A result could not be written. Nothing partial is left behind.
  cancelled = 130,  ///< The callback of a ProgressScope cancelled the call, which is no failure.
};

/// The one exception type that leaves the library (beside std::bad_alloc).
///
/// id() is for programs: it stays the same from version to version, while messages may change. The
/// message is one or two sentences, ready to show to a person. They name the file or option, the
/// problem and the remedy. what() spells options as members of BakeOptions, or of the struct that
/// holds them, in backticks: `match.cage`, `keep_uvs`; message() stores them as data, for programs
/// whose users know them by other names.
class Error : public std::runtime_error {
 public:
  /// \param message  text for users: the file or parameter, the problem, the remedy
  /// \param id       what id() returns: a string that lives as long as the program; null: the name of
  ///                 the kind
  Error(ErrorCode code, const Message& message, const char* id = nullptr);
  Error(const Error&) = default;             ///< Does not throw
  Error& operator=(const Error&) = default;  ///< Does not throw
  /// Defined in the library, so that the type information by which exceptions are caught exists
  /// only once
  ~Error() override;
  /// The kind of failure.
  ErrorCode code() const noexcept { return code_; }
  /// Identifier of the problem, of letters a-z and dashes: `mesh-index`, `match-weight`, as documented by the function
  /// that throws; else the kind's name: `internal`, `usage`, `input`, `device`, `output`, `cancelled`. Never null.
  const char* id() const noexcept { return id_; }
  /// The message of the error.
  Message message() const;
  /// The option that the message names first, such as "match.cage"; empty: none. Valid as long as
  /// the error.
  std::string_view option() const noexcept;

 protected:
  /// \param what  text that what() returns
  Error(ErrorCode code, const Message& message, const std::string& what, const char* id);

 private:
  ErrorCode code_;
  const char* id_;
  /// Null if the message names no options; what() is then the whole message
  std::shared_ptr<const Message> message_;
};

/// An imperfection of the data, which was handled by a documented rule.
struct Warning {
  std::string code = {};  ///< Stable identifier for scripts, such as "degenerate-triangles".
  Message message = {};  ///< One sentence for a person: what, how many, one example, what was done.
  std::uint64_t count = 0;  ///< Number of elements with the problem.
};

}  // namespace kiln
