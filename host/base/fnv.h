// A hash to identify texts, files and states; not cryptographic.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln {

/// 64-bit FNV-1a (Fowler, Noll, Vo) over words of any type; for bytes, the published hash.
struct Fnv1a {
  std::uint64_t value = 0xCBF29CE484222325U;

  void add(std::uint64_t word) { value = (value ^ word) * 0x100000001B3U; }
};

/// Hash of a text's bytes. \param start  a previous hash to continue, or a seed
inline std::uint64_t fnv1a(std::string_view text, std::uint64_t start = Fnv1a().value) {
  Fnv1a hash{start};
  for (const char c : text) hash.add(static_cast<unsigned char>(c));
  return hash.value;
}

}  // namespace kiln
