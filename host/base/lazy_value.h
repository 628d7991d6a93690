// Values that are created at their first use.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <typeindex>

namespace kiln {

/// Holds at most one value of each type, created at its first use. Thread-safe.
class LazyValue {
 public:
  /// Returns the value of a type, created by `make()` at the first call. If `make()` throws, the next call
  /// tries again.
  template <typename Value, typename Make>
  std::shared_ptr<const Value> get(const Make& make) {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<const void>& value = values_[typeid(Value)];
    if (value == nullptr) value = std::make_shared<const Value>(make());
    return std::static_pointer_cast<const Value>(value);
  }

 private:
  std::mutex mutex_;
  std::map<std::type_index, std::shared_ptr<const void>> values_;
};

}  // namespace kiln
