// Replaces functions of glibc in the programs, so that crashes in OpenCL drivers are caught; drivers call these
// functions as well. This is not in the library, whose users own their threads and signal handlers.
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

// Guards take address space, but no memory.
constexpr std::size_t kGuardBytes = std::size_t{1} << 28;
constexpr std::size_t kStackGuardBytes = std::size_t{1} << 24;

struct ThreadStart {
  void* (*begin)(void*);
  void* with;
  bool has_guard;
};

/// Write-protected pages within a thread's stack, for the lifetime of this object. The C library and the kernel store
/// data of a thread above its stack. If the code of a user's own map writes beyond an array, it hits these pages
/// first, and on_crash() runs.
class StackGuard {
 public:
  /// Protects kStackGuardBytes of the stack against access.
  /// \param room  start of a region on the stack of kStackGuardBytes and two pages
  explicit StackGuard(char* room) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t misalignment = reinterpret_cast<std::uintptr_t>(room) % page;
    begin_ = room + (misalignment == 0 ? 0 : page - misalignment);
    is_protected_ = mprotect(begin_, kStackGuardBytes, PROT_NONE) == 0;
  }
  ~StackGuard() {
    if (is_protected_) mprotect(begin_, kStackGuardBytes, PROT_READ | PROT_WRITE);
  }
  StackGuard(const StackGuard&) = delete;

 private:
  char* begin_;
  bool is_protected_;
};

/// Runs the thread's function below the protected pages.
__attribute__((noinline)) void* run_with_stack_guard(const ThreadStart& start) {
  if (!start.has_guard) return start.begin(start.with);
  const StackGuard guard(static_cast<char*>(alloca(kStackGuardBytes + 2 * sysconf(_SC_PAGESIZE))));
  return start.begin(start.with);
}

/// Starts a thread with an alternate signal stack, which on_crash() needs if a kernel has overflowed the driver's
/// stack.
void* begin_thread(void* given) {
  const std::unique_ptr<ThreadStart> start(static_cast<ThreadStart*>(given));
  thread_local std::array<char, std::size_t{1} << 16> room;
  stack_t stack{};
  stack.ss_sp = room.data();
  stack.ss_size = room.size();
  sigaltstack(&stack, nullptr);
  return run_with_stack_guard(*start);
}

}  // namespace

/// Overrides the C library's function for threads of drivers. Their stacks get a far larger guard than the single page
/// of the C library. A kernel with large arrays can step over one page into the stack of another thread, and what it
/// overwrites there would end the process without a message.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*begin)(void*), void* with) {
  static const auto next =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  auto* const start = new (std::nothrow) ThreadStart{begin, with, false};
  if (start == nullptr) return EAGAIN;
  pthread_attr_t guarded_attributes;
  if (attributes != nullptr) {
    guarded_attributes = *attributes;
  } else {
    pthread_attr_init(&guarded_attributes);
  }
  std::size_t bytes = 0;
  void* stack = nullptr;
  int status = pthread_attr_getstack(&guarded_attributes, &stack, &bytes);
  // The thread gets a guard unless its caller provides the stack, whose size must stay as given. The stack's address is
  // null unless the caller has provided it.
  start->has_guard = reinterpret_cast<std::uintptr_t>(stack) + bytes == 0;
  if (status == 0 && start->has_guard) {
    pthread_attr_getstacksize(&guarded_attributes, &bytes);
    status = pthread_attr_setstacksize(&guarded_attributes, bytes + 2 * kStackGuardBytes);
  }
  if (status == 0) status = pthread_attr_setguardsize(&guarded_attributes, kGuardBytes);
  if (status == 0) status = next(thread, &guarded_attributes, begin_thread, start);
  if (attributes == nullptr) pthread_attr_destroy(&guarded_attributes);
  if (status == 0) return status;
  // Without enough address space (ulimit -v), the thread is started without guards.
  start->has_guard = false;
  status = next(thread, attributes, begin_thread, start);
  if (status != 0) delete start;
  return status;
}

/// Overrides the C library's function. LLVM within PoCL replaces the handlers of crashes, and for a moment removes them
/// all while it restores them; a crash of another thread in that moment would end the process without a message.
extern "C" int sigaction(int number, const struct sigaction* action,
                         struct sigaction* before) noexcept {
  static const auto next = reinterpret_cast<decltype(&sigaction)>(dlsym(RTLD_NEXT, "sigaction"));
  return next(number, kiln::os::handles_crash(number) ? nullptr : action, before);
}
#endif
