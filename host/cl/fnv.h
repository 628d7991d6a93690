// A hash of texts that tells files and states apart; nobody is kept out by it.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln::ocl {

/// FNV-1a, 64 bits (Fowler, Noll, Vo). \param start  a hash to go on with, or another one: another hash
inline std::uint64_t fnv1a(std::string_view text, std::uint64_t start = 0xCBF29CE484222325U) {
  for (const char c : text) start = (start ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return start;
}

}  // namespace kiln::ocl
