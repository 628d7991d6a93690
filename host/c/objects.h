// Objects of the C interface that several files use, and conversion of exceptions to a status.
#pragma once

#include <algorithm>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/kiln_c.h"
#include "kiln/mesh.h"
#include "kiln/simplify.h"

/// Input files of an object; no result may overwrite any of them.
using Files = std::vector<std::filesystem::path>;

struct kiln_mesh {
  kiln::Mesh mesh;
  Files read = {};
  /// Report of the simplification, if kiln_simplify() created the mesh
  std::optional<kiln::SimplifyReport> made = {};
};
namespace kiln {

// State of the calling thread. These are functions because MinGW's linker duplicates inline thread_local variables.
std::string& last_message() noexcept;  ///< kiln_error_message()
std::string& last_code() noexcept;     ///< kiln_error_code()

inline kiln_status failed(kiln_status status, const char* message, const char* code) noexcept {
  try {
    last_message() = message;
    last_code() = code;
  } catch (...) {
    last_message().clear();  // Out of memory: only the status reports it
    last_code().clear();
  }
  return status;
}

/// Runs a function, and converts its exceptions to a status.
template <typename Function>
kiln_status guarded(Function&& function) noexcept {
  try {
    function();
    return KILN_OK;
  } catch (const Error& error) {
    return failed(static_cast<kiln_status>(error.code()), error.what(), error.id());
  } catch (const std::bad_alloc&) {
    return failed(KILN_INTERNAL, "Memory ran out.", "memory");
  } catch (const std::exception& error) {
    return failed(KILN_INTERNAL, error.what(), "internal");
  } catch (...) {
    return failed(KILN_INTERNAL, "Something unknown was thrown.", "internal");
  }
}

inline void check_given(const void* pointer, const char* parameter) {
  if (pointer != nullptr) return;
  throw Error(ErrorCode::usage, std::string(parameter) + " is null.", "null");
}

inline void check_cancelled(bool cancelled) {
  if (cancelled) throw Error(ErrorCode::cancelled, "Cancelled by the callback.");
}

/// Fills as much of a caller's struct as its size states, since it may be from an older header.
template <typename Out>
void give(Out* out, Out values) {
  if (out->size < sizeof(std::size_t)) {
    throw Error(ErrorCode::usage, "A struct's size is not set: call its kiln_..._init().",
                "struct-size");
  }
  values.size = out->size;
  std::memcpy(out, &values, std::min(out->size, sizeof values));
}

/// Sets a struct to zeros, except its size. Null is ignored: the function that takes the struct
/// reports it.
template <typename Struct>
void begin(Struct* values) {
  if (values == nullptr) return;
  std::memset(values, 0, sizeof *values);
  values->size = sizeof *values;
}

}  // namespace kiln
