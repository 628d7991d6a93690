// Watches calls of drivers: where all threads wait for each other, none returns.
#include "kiln/watch.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <thread>

#include "base/fnv.h"
#include "cl/driver.h"

namespace kiln {
namespace {

constexpr auto kPause = std::chrono::milliseconds(100);
constexpr int kSamePictures = 13;

/// A small file of the system's. Nothing is allocated: that may be just what fails. \returns its size, or 0
template <std::size_t room>
std::size_t read_small(const char* path, std::array<char, room>& text) {
  const int file = open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const ssize_t size = read(file, text.data(), room - 1);
  close(file);
  const std::size_t end = size > 0 ? static_cast<std::size_t>(size) : 0;
  text[end] = '\0';
  return end;
}

/// What a thread waits for and how often it was woken, as one number; nothing where it is in no futex.
std::optional<std::uint64_t> wait_of(const char* thread) {
  std::array<char, 64> path{};
  std::array<char, 4096> text{};
  std::snprintf(path.data(), path.size(), "/proc/self/task/%s/syscall", thread);
  if (read_small(path.data(), text) == 0) return {};
  if (std::strtol(text.data(), nullptr, 10) != SYS_futex) return {};  // also "running"
  const std::uint64_t call = fnv1a(text.data());
  std::snprintf(path.data(), path.size(), "/proc/self/task/%s/status", thread);
  if (read_small(path.data(), text) == 0) return {};
  const char* const switches = std::strstr(text.data(), "voluntary_ctxt_switches");
  if (switches == nullptr) return {};
  return fnv1a(switches, call);
}

/// Of all other threads; nothing where one is not asleep, or the system does not say.
std::optional<std::uint64_t> waits() {
  struct Entry {  // linux_dirent64
    std::uint64_t node;
    std::int64_t offset;
    unsigned short size;
    unsigned char type;
    char name[1];
  };
  const int folder = open("/proc/self/task", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return {};
  const long own = syscall(SYS_gettid);
  std::uint64_t sum = 0;
  bool known = true;
  alignas(Entry) std::array<char, 4096> room{};
  for (;;) {
    const long size = syscall(SYS_getdents64, folder, room.data(), room.size());
    if (size <= 0) {
      known = known && size == 0;
      break;
    }
    for (long at = 0; known && at < size;) {
      const auto* const entry = reinterpret_cast<const Entry*>(room.data() + at);
      at += entry->size;
      const char* const name = static_cast<const char*>(entry->name);
      if (name[0] == '.' || std::strtol(name, nullptr, 10) == own) continue;
      const std::optional<std::uint64_t> wait = wait_of(name);
      known = wait.has_value();
      sum += wait.value_or(0);
    }
  }
  close(folder);
  if (!known) return {};
  return sum;
}

[[noreturn]] void watch(void (*stuck)()) {
  std::uint64_t call = 0;
  std::optional<std::uint64_t> picture;
  for (int same = 0;;) {
    std::this_thread::sleep_for(kPause);
    const std::uint64_t now = ocl::call_under_way();
    if (now == 0 || now != call) {
      call = now;
      same = 0;
      continue;
    }
    const std::optional<std::uint64_t> next = waits();
    same = next.has_value() && next == picture ? same + 1 : 0;
    picture = next;
    if (same < kSamePictures || ocl::call_under_way() != call) continue;
    stuck();
    for (;;) pause();
  }
}

}  // namespace

bool watch_driver(void (*stuck)()) noexcept {
  static std::atomic<bool> watched{false};
  std::array<char, 256> text{};
  if (read_small("/proc/thread-self/syscall", text) == 0 || watched.exchange(true)) return watched;
  // Signals are for the others.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    std::thread([stuck] { watch(stuck); }).detach();
  } catch (...) {
    watched = false;
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return watched;
}

}  // namespace kiln
