// A library to load before a program (LD_PRELOAD) that hides features of the processor from LLVM within PoCL, so that
// kernels are compiled for an older one. (POCL_LLVM_CPU_NAME does not: PoCL adds the host's features.)
//
//   KILN_CPU=haswell       nothing of AVX-512
//   KILN_CPU=sandybridge   nor AVX2, FMA
//   KILN_CPU=x86-64        nor what came after SSE2
#include <dlfcn.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string_view>

namespace {

/// As LLVM 14 and 15 lay out a StringMap<bool>.
struct Entry {
  std::size_t length;
  bool value;
};
struct Map {
  Entry** table;
  unsigned buckets, items, tombstones, item_size;
};
struct Text {
  const char* data;
  std::size_t size;
};

const char* wanted() {
  const char* name = std::getenv("KILN_CPU");
  return name == nullptr ? "" : name;
}

/// LLVM's own function, found from the library that called this one: nobody else sees it.
template <typename Function>
Function* real_one(const void* caller, const char* name) {
  Dl_info info{};
  if (dladdr(caller, &info) == 0) return nullptr;
  void* const library = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  return library == nullptr ? nullptr : reinterpret_cast<Function*>(dlsym(library, name));
}

bool hides(std::string_view feature) {
  const std::string_view cpu = wanted();
  const auto is_any = [&](std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names) {
      if (feature.starts_with(name)) return true;
    }
    return false;
  };
  if (cpu.empty()) return false;
  if (is_any({"avx512", "amx", "vaes", "vpclmulqdq", "gfni"})) return true;
  if (cpu == "haswell") return false;
  if (is_any({"avx2", "fma", "f16c", "bmi", "avxvnni"})) return true;
  if (cpu == "sandybridge") return false;
  return is_any({"avx", "xop", "sse3", "ssse3", "sse4"});
}

}  // namespace

extern "C" bool _ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE(Map* map) {
  static auto* const real = real_one<bool(Map*)>(
      __builtin_return_address(0),
      "_ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE");
  if (real == nullptr || !real(map)) return false;
  for (unsigned i = 0; i < map->buckets; ++i) {
    Entry* const entry = map->table[i];
    // Empty, or the mark of one that was taken out: no address.
    if (reinterpret_cast<std::size_t>(entry) + 64 < 128) continue;
    if (hides({reinterpret_cast<const char*>(entry) + map->item_size, entry->length}))
      entry->value = false;
  }
  return true;
}

extern "C" Text _ZN4llvm3sys14getHostCPUNameEv() {
  static auto* const real =
      real_one<Text()>(__builtin_return_address(0), "_ZN4llvm3sys14getHostCPUNameEv");
  const char* name = wanted();
  return *name == '\0' ? real() : Text{name, std::strlen(name)};
}
