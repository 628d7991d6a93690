// What the programs have in place of the C and C++ libraries' own. Not in a library: its callers' blocks and threads are
// none of its business.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "base/memory.h"
#include "cl/driver_state.h"

// Blocks of the programs' own threads beyond --memory-limit are refused, as if the system had none.
// NOLINTBEGIN(cppcoreguidelines-no-malloc): what they are made of
void* operator new(std::size_t bytes) {
  if (kiln::in_driver() || kiln::may_take(bytes)) {
    if (void* const block = std::malloc(bytes == 0 ? 1 : bytes)) return block;
  }
  throw std::bad_alloc();
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
// NOLINTEND(cppcoreguidelines-no-malloc)

#ifdef __GLIBC__
namespace {

struct Begun {
  void* (*begin)(void*);
  void* with;
};

/// A thread with a stack for handlers: where kernels overflow a driver's, on_crash() has no other.
void* begin_thread(void* given) {
  const std::unique_ptr<Begun> begun(static_cast<Begun*>(given));
  thread_local std::array<char, std::size_t{1} << 16> room;
  stack_t stack{};
  stack.ss_sp = room.data();
  stack.ss_size = room.size();
  sigaltstack(&stack, nullptr);
  return begun->begin(begun->with);
}

}  // namespace

/// Stands before the C library's, for drivers' threads.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*begin)(void*), void* with) {
  static const auto next =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  auto* const begun = new (std::nothrow) Begun{begin, with};
  if (begun == nullptr) return EAGAIN;
  const int status = next(thread, attributes, begin_thread, begun);
  if (status != 0) delete begun;
  return status;
}
#endif
