// A hash that tells texts, files and states apart; nobody is kept out by it.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln {

/// FNV-1a, 64 bits (Fowler, Noll, Vo), of words of any kind: the published one where each is a byte.
struct Fnv1a {
  std::uint64_t value = 0xCBF29CE484222325U;

  void add(std::uint64_t word) { value = (value ^ word) * 0x100000001B3U; }
};

/// Hash of a text's bytes. \param start  a hash to go on with, or another one: another hash
inline std::uint64_t fnv1a(std::string_view text, std::uint64_t start = Fnv1a().value) {
  Fnv1a hash{start};
  for (const char c : text) hash.add(static_cast<unsigned char>(c));
  return hash.value;
}

}  // namespace kiln
