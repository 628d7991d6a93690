// Interned names, which live as long as the program.
#pragma once

#include <mutex>
#include <set>
#include <string>
#include <string_view>

namespace kiln {

/// Interns a name: returns the same copy for equal names, which is never freed.
inline std::string_view intern(std::string_view name) {
  static std::mutex mutex;
  static auto& names = *new std::set<std::string, std::less<>>;
  const std::lock_guard lock(mutex);
  const auto found = names.find(name);
  return found != names.end() ? *found : *names.emplace(name).first;
}

}  // namespace kiln
