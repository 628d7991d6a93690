#include "batch/content_hash.h"

#include <xxhash.h>

#include <cerrno>
#include <cstdint>
#include <new>
#include <vector>

#include "base/file.h"

namespace kiln {

struct ContentHash::State {
  // xxHash allocates the state itself, because it needs 64-byte alignment, which a replaced operator new may not
  // provide.
  State() : state(XXH3_createState()) {
    if (state == nullptr) throw std::bad_alloc();
  }
  ~State() { XXH3_freeState(state); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  XXH3_state_t* state;
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) {
  XXH3_128bits_reset(state_->state);
}
ContentHash::~ContentHash() = default;
ContentHash::ContentHash(ContentHash&&) noexcept = default;
ContentHash& ContentHash::operator=(ContentHash&&) noexcept = default;

void ContentHash::add(std::span<const std::byte> bytes) {
  XXH3_128bits_update(state_->state, bytes.data(), bytes.size());
}

void ContentHash::add(std::string_view text) {
  const std::uint64_t size = text.size();
  add(std::as_bytes(std::span(&size, 1)));
  add(std::as_bytes(std::span(text)));
}

std::string ContentHash::text() const {
  constexpr const char* kDigits = "0123456789abcdef";
  const XXH128_hash_t hash = XXH3_128bits_digest(state_->state);
  std::string text;
  for (const std::uint64_t half : {std::uint64_t{hash.high64}, std::uint64_t{hash.low64}}) {
    for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(half >> shift) & 15U];
  }
  return text;
}

std::string content_hash(std::string_view text) {
  ContentHash hash;
  hash.add(std::as_bytes(std::span(text)));
  return hash.text();
}

std::optional<std::string> file_hash(const std::filesystem::path& path) {
  const int file = os::open_to_read(path);
  if (file < 0) return std::nullopt;
  const std::optional<os::FileStatus> facts = os::query_file(file);
  bool is_readable = facts && facts->is_regular;
  ContentHash hash;
  std::vector<std::byte> buffer(std::size_t{1} << 18);
  for (std::uint64_t offset = 0; is_readable;) {
    const std::ptrdiff_t got = os::read_at(file, offset, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    is_readable = got >= 0;
    if (got <= 0) break;
    hash.add(std::span(buffer).first(static_cast<std::size_t>(got)));
    offset += static_cast<std::uint64_t>(got);
  }
  os::close(file);
  return is_readable ? std::optional(hash.text()) : std::nullopt;
}

}  // namespace kiln
