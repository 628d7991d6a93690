// Values that are made once, for whoever asks first.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <typeindex>

namespace kiln {

/// One value of each type. Any number of threads may ask.
class MadeOnce {
 public:
  /// The value of a type; `make()` gives it where it is missing. What it throws leaves it missing.
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
