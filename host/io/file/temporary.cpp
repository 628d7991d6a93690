#include "io/file/temporary.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "kiln/files.h"

namespace kiln {
namespace {

// Names that a signal handler may have to remove. Fixed memory and lock-free states only, since a
// handler may run between any two instructions.
enum SlotState : int { kSlotFree, kSlotTaken, kSlotLive };

struct Slot {
  std::atomic<int> state{kSlotFree};
  std::array<char, 1024> path{};
};
static_assert(std::atomic<int>::is_always_lock_free);

std::array<Slot, 64> slots;
std::atomic<unsigned> name_counter{0};

int register_name(const std::string& name) {
  if (name.size() >= slots[0].path.size()) return -1;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    int expected = kSlotFree;
    if (!slots[i].state.compare_exchange_strong(expected, kSlotTaken)) continue;
    std::memcpy(slots[i].path.data(), name.c_str(), name.size() + 1);
    slots[i].state = kSlotLive;
    return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

TemporaryName::TemporaryName(const std::filesystem::path& folder, const char* ending)
    : path_(folder / (".kiln-" + std::to_string(static_cast<long>(getpid())) + "-" +
                      std::to_string(name_counter++) + "." + ending)),
      slot_(register_name(path_.native())) {}

TemporaryName::TemporaryName(TemporaryName&& other) noexcept
    : path_(std::exchange(other.path_, {})), slot_(std::exchange(other.slot_, -1)) {}

TemporaryName& TemporaryName::operator=(TemporaryName&& other) noexcept {
  if (this != &other) {
    release();
    path_ = std::exchange(other.path_, {});
    slot_ = std::exchange(other.slot_, -1);
  }
  return *this;
}

void TemporaryName::release() noexcept {
  if (slot_ >= 0) slots[static_cast<std::size_t>(slot_)].state = kSlotFree;
  slot_ = -1;
  path_.clear();
}

void remove_temporary_files() noexcept {
  const int saved = errno;
  for (Slot& slot : slots) {
    if (slot.state == kSlotLive) unlink(slot.path.data());
  }
  errno = saved;
}

}  // namespace kiln
