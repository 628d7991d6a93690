#pragma once

#include <optional>
#include <type_traits>
#include <utility>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A part of a result that is there or not, read as a std::optional: `if (report.uv) report.uv->covered`. A dozen
/// of std::optional's own made up a third of what kiln.h costs a compiler.
template <class T>
class Maybe {
 public:
  Maybe() = default;                                          ///< Nothing there
  Maybe(std::nullopt_t) {}                                    ///< Nothing there
  Maybe(T value) : value_(std::move(value)), there_(true) {}  ///< The value is there

  /// The value is there, also by `= {...}`.
  template <class U = T>
  Maybe& operator=(U value) requires std::is_same_v<U, T> {
    value_ = std::move(value);
    there_ = true;
    return *this;
  }

  bool has_value() const noexcept { return there_; }          ///< It is there
  explicit operator bool() const noexcept { return there_; }  ///< It is there

  T& operator*() & noexcept { return value_; }               ///< The value, which must be there
  const T& operator*() const& noexcept { return value_; }    ///< The value, which must be there
  T&& operator*() && noexcept { return std::move(value_); }  ///< The value, which must be there
  T* operator->() noexcept { return &value_; }               ///< The value, which must be there
  const T* operator->() const noexcept { return &value_; }   ///< The value, which must be there

  /// The value. \throws std::bad_optional_access where it is not there
  T& value() & { return there_ ? value_ : throw std::bad_optional_access(); }
  /// The value. \throws std::bad_optional_access where it is not there
  const T& value() const& { return there_ ? value_ : throw std::bad_optional_access(); }
  /// The value. \throws std::bad_optional_access where it is not there
  T&& value() && { return there_ ? std::move(value_) : throw std::bad_optional_access(); }
  /// The value, or `other` where it is not there.
  T value_or(T other) const { return there_ ? value_ : std::move(other); }

  /// Makes a new value in place of what was there. \returns it
  T& emplace() { return *(*this = T{}); }
  /// Forgets the value.
  void reset() { *this = Maybe(); }

  /// The same as the standard library says it.
  operator std::optional<T>() const { return there_ ? std::optional<T>(value_) : std::nullopt; }

 private:
  T value_{};
  bool there_ = false;
};

}  // namespace kiln
