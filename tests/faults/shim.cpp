// A library to load before a program (LD_PRELOAD) that lets one call of the C library fail.
//
//   KILN_FAULT=malloc:17   the 17th call of malloc, calloc, realloc or posix_memalign after main began
//   KILN_FAULT=malloc:17+  the 17th and all that follow, and those of programs that it becomes
//   KILN_FAULT_COUNT=FILE  writes there how often each was called
//   KILN_FAULT_READ=WAY    the first clEnqueueReadBuffer: "deadlock" never returns; "sleep" takes 3 s, and so
//                          does "wait", for a thread that sleeps. "wrong": each gives a wrong bit
//
// Names: malloc, write (also fwrite and fflush), fsync, rename, close, open, mmap, read (also fread), link, mkdir.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace {

constexpr std::array kNames = {"malloc", "write", "fsync", "rename", "close",
                               "open",   "mmap",  "read",  "link",   "mkdir"};
enum Call : std::size_t {
  kMalloc,
  kWrite,
  kFsync,
  kRename,
  kClose,
  kOpen,
  kMmap,
  kRead,
  kLink,
  kMkdir
};

std::array<std::atomic<long>, kNames.size()> calls;
std::atomic<bool> started{false};
std::size_t failing = kNames.size();
long first = 0;
bool all_that_follow = false;
int (*real_main)(int, char**, char**) = nullptr;

/// True if this call is to fail.
bool fails(Call call, int reason) {
  if (!started) return false;
  const long number = ++calls[call];
  if (call != failing || (number != first && !(all_that_follow && number > first))) return false;
  errno = reason;
  return true;
}

template <typename Function>
Function* next(Function*& slot, const char* name) {
  if (slot == nullptr) slot = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  return slot;
}

void report() {
  const char* path = std::getenv("KILN_FAULT_COUNT");
  if (path == nullptr) return;
  started = false;
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) return;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    std::fprintf(file, "%s %ld\n", kNames[i], calls[i].load());
  }
  std::fclose(file);
}

pthread_mutex_t held = PTHREAD_MUTEX_INITIALIZER;

void* sleep_3_s(void*) {
  sleep(3);
  return nullptr;
}

/// \returns true if what is read is to be wrong
bool fail_to_read() {
  static std::atomic<bool> done{false};
  const char* way = std::getenv("KILN_FAULT_READ");
  if (way == nullptr) return false;
  if (std::strcmp(way, "wrong") == 0) return true;
  if (done.exchange(true)) return false;
  if (std::strcmp(way, "sleep") == 0) sleep_3_s(nullptr);
  pthread_t other{};
  if (std::strcmp(way, "wait") == 0 && pthread_create(&other, nullptr, sleep_3_s, nullptr) == 0) {
    pthread_join(other, nullptr);
  }
  if (std::strcmp(way, "deadlock") == 0) {
    pthread_mutex_lock(&held);
    pthread_mutex_lock(&held);
  }
  return false;
}

int begin(int argc, char** argv, char** environment) {
  if (const char* fault = std::getenv("KILN_FAULT")) {
    const char* colon = std::strchr(fault, ':');
    for (std::size_t i = 0; colon != nullptr && i < kNames.size(); ++i) {
      const auto size = static_cast<std::size_t>(colon - fault);
      if (std::strlen(kNames[i]) == size && std::strncmp(fault, kNames[i], size) == 0) failing = i;
    }
    char* end = nullptr;
    first = colon != nullptr ? std::strtol(colon + 1, &end, 10) : 0;
    all_that_follow = end != nullptr && *end == '+';
    if (!all_that_follow) unsetenv("KILN_FAULT");  // a run that is begun anew has no such fault
  }
  std::atexit(report);
  started = true;
  return real_main(argc, argv, environment);
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);

void* malloc(size_t size) { return fails(kMalloc, ENOMEM) ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return fails(kMalloc, ENOMEM) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  return fails(kMalloc, ENOMEM) ? nullptr : __libc_realloc(old, size);
}
int posix_memalign(void** result, size_t alignment, size_t size) {
  if (fails(kMalloc, ENOMEM)) return ENOMEM;
  *result = __libc_memalign(alignment, size);
  return *result == nullptr ? ENOMEM : 0;
}
void* aligned_alloc(size_t alignment, size_t size) {
  return fails(kMalloc, ENOMEM) ? nullptr : __libc_memalign(alignment, size);
}

ssize_t write(int file, const void* data, size_t bytes) {
  static decltype(write)* real = nullptr;
  if (fails(kWrite, ENOSPC)) return -1;
  return next(real, "write")(file, data, bytes);
}
size_t fwrite(const void* data, size_t size, size_t count, FILE* file) {
  static decltype(fwrite)* real = nullptr;
  if (fails(kWrite, ENOSPC)) return 0;
  return next(real, "fwrite")(data, size, count, file);
}
int fflush(FILE* file) {
  static decltype(fflush)* real = nullptr;
  if (fails(kWrite, ENOSPC)) return EOF;
  return next(real, "fflush")(file);
}
int fsync(int file) {
  static decltype(fsync)* real = nullptr;
  return fails(kFsync, EIO) ? -1 : next(real, "fsync")(file);
}
int rename(const char* from, const char* to) {
  static decltype(rename)* real = nullptr;
  return fails(kRename, EIO) ? -1 : next(real, "rename")(from, to);
}
int close(int file) {
  static decltype(close)* real = nullptr;
  if (!fails(kClose, EIO)) return next(real, "close")(file);
  // As Linux does: it says so, and it is closed.
  next(real, "close")(file);
  errno = EIO;
  return -1;
}
int open(const char* path, int flags, ...) {
  static decltype(open)* real = nullptr;
  va_list list;
  va_start(list, flags);
  const mode_t mode = va_arg(list, mode_t);
  va_end(list);
  return fails(kOpen, EMFILE) ? -1 : next(real, "open")(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  static decltype(open64)* real = nullptr;
  va_list list;
  va_start(list, flags);
  const mode_t mode = va_arg(list, mode_t);
  va_end(list);
  return fails(kOpen, EMFILE) ? -1 : next(real, "open64")(path, flags, mode);
}
void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) {
  static decltype(mmap)* real = nullptr;
  return fails(kMmap, ENOMEM) ? MAP_FAILED
                              : next(real, "mmap")(at, size, protection, flags, file, offset);
}

ssize_t read(int file, void* data, size_t bytes) {
  static decltype(read)* real = nullptr;
  return fails(kRead, EIO) ? -1 : next(real, "read")(file, data, bytes);
}
size_t fread(void* data, size_t size, size_t count, FILE* file) {
  static decltype(fread)* real = nullptr;
  return fails(kRead, EIO) ? 0 : next(real, "fread")(data, size, count, file);
}
int link(const char* from, const char* to) {
  static decltype(link)* real = nullptr;
  return fails(kLink, EMLINK) ? -1 : next(real, "link")(from, to);
}
int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  static decltype(linkat)* real = nullptr;
  return fails(kLink, EMLINK) ? -1 : next(real, "linkat")(from_folder, from, to_folder, to, flags);
}
int mkdir(const char* path, mode_t mode) {
  static decltype(mkdir)* real = nullptr;
  return fails(kMkdir, EACCES) ? -1 : next(real, "mkdir")(path, mode);
}

int clEnqueueReadBuffer(void* queue, void* buffer, unsigned blocking, size_t offset, size_t size,
                        void* to, unsigned events, const void* list, void* event) {
  static decltype(clEnqueueReadBuffer)* real = nullptr;
  const bool wrong = fail_to_read();
  const int status = next(real, "clEnqueueReadBuffer")(queue, buffer, blocking, offset, size, to,
                                                       events, list, event);
  if (wrong) *static_cast<unsigned char*>(to) ^= 1;
  return status;
}

int __libc_start_main(int (*program)(int, char**, char**), int argc, char** argv, void (*init)(),
                      void (*fini)(), void (*loader_fini)(), void* stack_end) {
  real_main = program;
  using Start =
      int(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*);
  static Start* real = nullptr;
  return next(real, "__libc_start_main")(begin, argc, argv, init, fini, loader_fini, stack_end);
}

}  // extern "C"
