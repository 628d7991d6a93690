// Replacements of functions of glibc, for the programs. Not in a library: its callers' threads and handlers are none of
// its business. Drivers call these functions, too.
#include <alloca.h>
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#include "base/signals.h"

#ifdef __GLIBC__
namespace {

constexpr std::size_t kGuardBytes = std::size_t{1} << 28;  // of addresses, not of memory
constexpr std::size_t kWallBytes = std::size_t{1} << 24;   // likewise

struct Begun {
  void* (*begin)(void*);
  void* with;
  bool has_wall;
};

/// Addresses within this thread's stack that nothing can write to, while this lives. Above a thread's stack lies what the
/// C library and the kernel know of the thread: where a map of the user's writes on beyond an array, it comes to the wall
/// first, and on_crash() runs.
class Wall {
 public:
  /// \param room  kWallBytes and two pages
  explicit Wall(char* room) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t beyond = reinterpret_cast<std::uintptr_t>(room) % page;
    begin_ = room + (beyond == 0 ? 0 : page - beyond);
    stands_ = mprotect(begin_, kWallBytes, PROT_NONE) == 0;
  }
  ~Wall() {
    if (stands_) mprotect(begin_, kWallBytes, PROT_READ | PROT_WRITE);
  }
  Wall(const Wall&) = delete;

 private:
  char* begin_;
  bool stands_;
};

/// Below the wall.
__attribute__((noinline)) void* run_below(const Begun& begun) {
  if (!begun.has_wall) return begun.begin(begun.with);
  const Wall wall(static_cast<char*>(alloca(kWallBytes + 2 * sysconf(_SC_PAGESIZE))));
  return begun.begin(begun.with);
}

/// A thread with a stack for handlers: where kernels overflow a driver's, on_crash() has no other.
void* begin_thread(void* given) {
  const std::unique_ptr<Begun> begun(static_cast<Begun*>(given));
  thread_local std::array<char, std::size_t{1} << 16> room;
  stack_t stack{};
  stack.ss_sp = room.data();
  stack.ss_size = room.size();
  sigaltstack(&stack, nullptr);
  return run_below(*begun);
}

}  // namespace

/// Stands before the C library's, for drivers' threads. Below their stacks lies far more than the one page that the C
/// library keeps free: a kernel with large arrays steps over a page, into another thread's stack, and what it overwrites
/// there would end the process without a word.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*begin)(void*), void* with) {
  static const auto next =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  auto* const begun = new (std::nothrow) Begun{begin, with, false};
  if (begun == nullptr) return EAGAIN;
  pthread_attr_t guarded;
  if (attributes != nullptr) {
    guarded = *attributes;
  } else {
    pthread_attr_init(&guarded);
  }
  std::size_t bytes = 0;
  void* stack = nullptr;
  int status = pthread_attr_getstack(&guarded, &stack, &bytes);
  // Who brings a stack has measured it: its end is known then, which is null else.
  begun->has_wall = reinterpret_cast<std::uintptr_t>(stack) + bytes == 0;
  if (status == 0 && begun->has_wall) {
    pthread_attr_getstacksize(&guarded, &bytes);
    status = pthread_attr_setstacksize(&guarded, bytes + 2 * kWallBytes);
  }
  if (status == 0) status = pthread_attr_setguardsize(&guarded, kGuardBytes);
  if (status == 0) status = next(thread, &guarded, begin_thread, begun);
  if (attributes == nullptr) pthread_attr_destroy(&guarded);
  if (status == 0) return status;
  // This is for short address space (ulimit -v).
  begun->has_wall = false;
  status = next(thread, attributes, begin_thread, begun);
  if (status != 0) delete begun;
  return status;
}

/// Stands before the C library's: LLVM within PoCL takes the handlers of crashes for its own, and for a moment sets none
/// while it gives them back, in which a second thread's crash would end the process without a word.
extern "C" int sigaction(int number, const struct sigaction* action,
                         struct sigaction* before) noexcept {
  static const auto next = reinterpret_cast<decltype(&sigaction)>(dlsym(RTLD_NEXT, "sigaction"));
  return next(number, kiln::os::handles_crash(number) ? nullptr : action, before);
}
#endif
