#include "cl/embedded.h"

#include <map>
#include <mutex>
#include <string>

namespace kiln::ocl {

std::string_view embedded_source(std::string_view family) {
  static std::mutex mutex;
  // Never destroyed, since threads that build kernels may outlive static objects.
  static auto& sources = *new std::map<std::string, std::string, std::less<>>();
  const std::lock_guard lock(mutex);
  const auto known = sources.find(family);
  if (known != sources.end()) return known->second;
  const char* const* pieces = embedded_pieces(family);
  if (pieces == nullptr) return {};
  std::string source;
  for (; *pieces != nullptr; ++pieces) source += *pieces;
  return sources.emplace(family, std::move(source)).first->second;
}

}  // namespace kiln::ocl
