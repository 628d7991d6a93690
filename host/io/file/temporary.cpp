#include "io/file/temporary.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <span>
#include <string>
#include <utility>

#include "base/file.h"
#include "kiln/files.h"

namespace kiln {
namespace {

// Names that a signal handler may have to remove. Fixed memory and lock-free states only, since a
// handler may run between any two instructions.
enum SlotState : int { kSlotFree, kSlotTaken, kSlotLive };

struct Slot {
  std::atomic<int> state{kSlotFree};
  std::array<std::filesystem::path::value_type, 1024> path{};
};
static_assert(std::atomic<int>::is_always_lock_free);

std::array<Slot, 64> slots;
std::array<Slot, 64> folder_slots;
std::atomic<unsigned> name_counter{0};

int register_name(std::span<Slot> all, const std::filesystem::path::string_type& name) {
  if (name.size() >= all[0].path.size()) return -1;
  for (std::size_t i = 0; i < all.size(); ++i) {
    int expected = kSlotFree;
    if (!all[i].state.compare_exchange_strong(expected, kSlotTaken)) continue;
    std::copy_n(name.c_str(), name.size() + 1, all[i].path.data());
    all[i].state = kSlotLive;
    return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

TemporaryName::TemporaryName(const std::filesystem::path& folder, const char* ending)
    : path_(folder / (".kiln-" + std::to_string(os::process_id()) + "-" +
                      std::to_string(name_counter++) + "." + ending)),
      slot_(register_name(slots, path_.native())) {}

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

void note_created_folder(const std::filesystem::path& folder) noexcept {
  if (register_name(folder_slots, folder.native()) < 0) errno = 0;
}

void forget_created_folders() noexcept {
  for (Slot& slot : folder_slots) slot.state = kSlotFree;
}

void remove_temporary_files() noexcept {
  const int saved = errno;
  for (Slot& slot : slots) {
    if (slot.state == kSlotLive) os::remove_file(slot.path.data());
  }
  // Last made, first gone. Fails where something is in it, as it should.
  for (std::size_t i = folder_slots.size(); i-- > 0;) {
    if (folder_slots[i].state == kSlotLive) os::remove_folder(folder_slots[i].path.data());
  }
  errno = saved;
}

}  // namespace kiln
