// Objects of the C interface that several files know, and how what they throw becomes a status.
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

/// Files that something was made of: nothing made of them is saved over one.
using Files = std::vector<std::filesystem::path>;

struct kiln_mesh {
  kiln::Mesh mesh;
  Files read = {};
  std::optional<kiln::SimplifyReport> made = {};  ///< If kiln_simplify() did
};
namespace kiln {

// Of the calling thread. Functions, since MinGW's linker takes inline thread_local variables of two files for two.
std::string& last_message() noexcept;  ///< kiln_error_message()
std::string& last_code() noexcept;     ///< kiln_error_code()

inline kiln_status failed(kiln_status status, const char* message, const char* code) noexcept {
  try {
    last_message() = message;
    last_code() = code;
  } catch (...) {
    last_message().clear();  // no memory: the status says so
    last_code().clear();
  }
  return status;
}

/// Runs a function; what it throws becomes a status.
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

/// Fills a caller's struct as far as it knows it.
template <typename Out>
void give(Out* out, Out values) {
  if (out->size < sizeof(std::size_t)) {
    throw Error(ErrorCode::usage, "A struct's size is not set: call its kiln_..._init().",
                "struct-size");
  }
  values.size = out->size;
  std::memcpy(out, &values, std::min(out->size, sizeof values));
}

/// Sets a struct to zeros and its size. Null: whatever takes the struct says so.
template <typename Struct>
void begin(Struct* values) {
  if (values == nullptr) return;
  std::memset(values, 0, sizeof *values);
  values->size = sizeof *values;
}

}  // namespace kiln
