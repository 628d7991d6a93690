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

// State of a name that a signal handler may have to remove. Names are stored in fixed memory with
// lock-free states, since a handler may interrupt the process between any two instructions.
enum SlotState : int { kSlotFree, kSlotTaken, kSlotLive };

struct Slot {
  std::atomic<int> state{kSlotFree};
  std::array<std::filesystem::path::value_type, 1024> path{};
};
static_assert(std::atomic<int>::is_always_lock_free);

std::array<Slot, 64> name_slots;
std::array<Slot, 64> folder_slots;
std::atomic<unsigned> name_counter{0};

int register_name(std::span<Slot> all, const std::filesystem::path::string_type& name) {
  if (name.size() >= all[0].path.size()) return -1;
  for (std::size_t i = 0; i < all.size(); ++i) {
    int expected_state = kSlotFree;
    if (!all[i].state.compare_exchange_strong(expected_state, kSlotTaken)) continue;
    std::copy_n(name.c_str(), name.size() + 1, all[i].path.data());
    all[i].state = kSlotLive;
    return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

TemporaryName::TemporaryName(const std::filesystem::path& folder, const char* ending)
    : path_(folder /
            (".kiln-" + os::process_namespace_id() + "-" + std::to_string(os::process_id()) + "-" +
             std::to_string(name_counter++) + "." + ending)),
      slot_(register_name(name_slots, path_.native())) {}

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
  if (slot_ >= 0) name_slots[static_cast<std::size_t>(slot_)].state = kSlotFree;
  slot_ = -1;
  path_.clear();
}

NameState state_of_name(std::string_view name, std::string_view ending) {
  const auto take = [&](std::string_view text) {
    const bool has = name.starts_with(text);
    if (has) name.remove_prefix(text.size());
    return has;
  };
  const auto take_run = [&](std::string_view of) {
    const std::string_view run = name.substr(0, name.find_first_not_of(of));
    name.remove_prefix(run.size());
    return run;
  };
  constexpr std::string_view kDigits = "0123456789";
  if (!take(".kiln-")) return NameState::foreign;
  const std::string_view mark = take_run("0123456789abcdef");
  // Earlier versions created names without this mark of the machine
  const bool has_mark = mark.size() == 16 && name.starts_with('-');
  if (has_mark) take("-");
  const std::string process_text(has_mark ? take_run(kDigits) : mark);
  if (process_text.empty() || process_text.size() > 9 ||
      process_text.find_first_not_of(kDigits) != process_text.npos || !take("-") ||
      take_run(kDigits).empty() || !take(".") || name != ending) {
    return NameState::foreign;
  }
  if (!has_mark || mark != os::process_namespace_id()) return NameState::unknown;
  return os::has_process_ended(std::stol(process_text)) ? NameState::ended : NameState::running;
}

void register_created_folder(const std::filesystem::path& folder) noexcept {
  if (register_name(folder_slots, folder.native()) < 0) errno = 0;
}

void unregister_created_folders() noexcept {
  for (Slot& slot : folder_slots) slot.state = kSlotFree;
}

void remove_temporary_files() noexcept {
  const int saved_errno = errno;
  for (Slot& slot : name_slots) {
    if (slot.state == kSlotLive) os::remove_file(slot.path.data());
  }
  // Removes folders in the reverse order of their creation. This fails for folders that are not
  // empty, as it should.
  for (std::size_t i = folder_slots.size(); i-- > 0;) {
    if (folder_slots[i].state == kSlotLive) os::remove_folder(folder_slots[i].path.data());
  }
  errno = saved_errno;
}

}  // namespace kiln
