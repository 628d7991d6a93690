// Builds each program once; on a separate thread if the caller polls progress.
#include "cl/program.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "base/formatted.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "cl/binary_cache.h"
#include "cl/driver.h"
#include "cl/embedded.h"

namespace kiln::ocl {
namespace {

/// Prepended to the caller's sources: makes a missing return value an error, if the compiler detects it, and
/// rejects printing, since drivers write to standard output.
constexpr const char* kSourcePrefix =
    "\n#ifdef __clang__\n#pragma clang diagnostic error \"-Wreturn-type\"\n#endif\n"
    "#define printf this_must_not_print\n";

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// True if a build runs on a separate thread while waiting threads poll.
bool polls_while_building() {
  return ProgressGuard::is_active() || OwnMapRun::current() != nullptr;
}

std::atomic<std::uint64_t> whole_header_count{0};

/// Result of a compiler; a program only if it succeeded.
struct CompileResult {
  cl_program program = nullptr;
  cl_int status = CL_SUCCESS;
  std::string log;
};

CompileResult compile(const Context& context, std::string_view source,
                      const std::string& source_name, const std::string& options) {
  CompileResult result;
  const char* text = source.data();
  const std::size_t length = source.size();
  const cl_device_id device = context.device();
  check(driver([&] {
          result.program =
              clCreateProgramWithSource(context.get(), 1, &text, &length, &result.status);
          return result.status;
        }),
        "clCreateProgramWithSource for " + source_name);
  result.status = driver([&] {
    return clBuildProgram(result.program, 1, &device, options.c_str(), nullptr, nullptr);
  });
  if (result.status == CL_SUCCESS) return result;
  std::size_t size = 0;
  const auto build_log = [&](std::size_t room, void* to, std::size_t* needed) {
    driver([&] {
      return clGetProgramBuildInfo(result.program, device, CL_PROGRAM_BUILD_LOG, room, to, needed);
    });
  };
  build_log(0, nullptr, &size);
  result.log.assign(size, '\0');
  build_log(size, result.log.data(), nullptr);
  release([&] { clReleaseProgram(result.program); });
  result.program = nullptr;
  return result;
}

}  // namespace

std::uint64_t whole_header_builds() { return whole_header_count; }

double Context::build_seconds() const {
  const std::lock_guard lock(programs_mutex_);
  return build_seconds_;
}

/// Loads the binary of an earlier run; null if there is none, or the driver rejects it.
std::shared_ptr<Context::Program> Context::load(std::string_view source,
                                                const std::string& options) {
  if (!binaries_->keeps_programs()) return nullptr;
  const auto binary = binaries_->find(source, options);
  if (!binary) return nullptr;
  auto loaded = std::make_shared<Program>();
  const unsigned char* bytes = binary->data();
  const std::size_t length = binary->size();
  cl_int binary_status = CL_SUCCESS, status = CL_SUCCESS;
  driver([&] {
    loaded->program =
        clCreateProgramWithBinary(context_, 1, &device_, &length, &bytes, &binary_status, &status);
    return status;
  });
  if (status == CL_SUCCESS && binary_status == CL_SUCCESS) {
    status = driver([&] {
      return clBuildProgram(loaded->program, 1, &device_, options.c_str(), nullptr, nullptr);
    });
    if (status == CL_SUCCESS) return loaded;
  }
  binaries_->remove(source, options);
  return nullptr;
}

/// Stores the binary for later runs. Errors are ignored, since the program itself is built.
void Context::store_binary(std::string_view source, const std::string& options,
                           const Program& built_program) {
  if (!binaries_->keeps_programs()) return;
  std::size_t size = 0;
  const auto query = [&](cl_program_info what, std::size_t room, void* to) {
    return driver([&] { return clGetProgramInfo(built_program.program, what, room, to, nullptr); });
  };
  if (query(CL_PROGRAM_BINARY_SIZES, sizeof size, &size) != CL_SUCCESS || size == 0) return;
  std::vector<unsigned char> binary(size);
  unsigned char* bytes = binary.data();
  if (query(CL_PROGRAM_BINARIES, sizeof bytes, &bytes) == CL_SUCCESS) {
    binaries_->store(source, options, binary);
  }
}

std::shared_ptr<Context::Program> Context::build(std::string_view source,
                                                 const std::string& source_name,
                                                 const std::string& defines, ErrorCode code) {
  std::string options = "-cl-std=CL1.2";
  if (info_.has_correct_division) options += " -cl-fp32-correctly-rounded-divide-sqrt";
  if (info_.is_gpu) options += " -DKILN_GPU=1";
  if (!defines.empty()) options += " " + defines;
  // Users' sources are not cached, since they may include files that change; nor is the self-test, which runs
  // once.
  const bool is_kept = code != ErrorCode::input && source != embedded_source("selftest");
  if (is_kept) {
    if (std::shared_ptr<Program> loaded = load(source, options)) return loaded;
  }
  // Memory that a CPU driver's compiler (PoCL's LLVM) allocates at its first use and does not free. If an earlier run
  // has compiled the program, the driver loads it from its cache and the compiler needs no memory. Kiln records such
  // programs by a file of one byte.
  constexpr std::uint64_t kCompilerBytes = std::uint64_t{150} << 20;
  const std::string mark = "compiled " + options;
  const bool is_known = is_kept && !info_.is_gpu && binaries_->find(source, mark);
  if (!info_.is_gpu && !is_known && !has_compiled_.exchange(true)) {
    require_memory("Compiling kernels (later runs reuse them)", kCompilerBytes);
  }
  auto built_program = std::make_shared<Program>();
  CompileResult compile_result;
  // Users' sources may call any function, so they are compiled with the whole header. If one of Kiln's programs fails
  // without the whole header, later ones are compiled with it at once, since PoCL would print the errors of each
  // further failure.
  const bool tries = code != ErrorCode::input && !info_.is_gpu && is_pocl(info_);
  if (tries && whole_header_count == 0) {
    compile_result = compile(*this, std::string(embedded_source("builtins")) + std::string(source),
                             source_name, options + " -D_OPENCL_H_=1");
    if (compile_result.status != CL_SUCCESS) ++whole_header_count;
  }
  if (compile_result.program == nullptr)
    compile_result = compile(*this, source, source_name, options);
  built_program->program = compile_result.program;
  if (compile_result.status == CL_SUCCESS) {
    if (is_kept) store_binary(source, options, *built_program);
    if (is_kept && !info_.is_gpu && !is_known) binaries_->store(source, mark, {1});
    return built_program;
  }
  const std::string& log = compile_result.log;
  if (code == ErrorCode::input) {  // an error in the user's source, not in the driver
    throw Error(code,
                source_name + " does not compile on " + info_.name + " (" + options + "):\n" + log);
  }
  const std::string hint = cache_hint(info_);
  throw Error(code,
              "Building " + source_name + " (" + options + ") on " + info_.name + " failed with " +
                  status_name(compile_result.status) + ". " + hint + "The build log:\n" + log,
              hint.empty() ? nullptr : "kernel-cache");
}

Kernel Context::kernel_of_program(Program& program, const std::string& name) {
  auto made = program.kernels.find(name);
  if (made == program.kernels.end()) made = program.kernels.emplace(name, nullptr).first;
  cl_kernel& kernel = made->second;
  if (kernel == nullptr) {
    cl_int status = CL_SUCCESS;
    check(driver([&] {
            kernel = clCreateKernel(program.program, name.c_str(), &status);
            return status;
          }),
          "clCreateKernel for " + name);
  }
  return {kernel, name};
}

std::shared_ptr<Context::Build> Context::build_by(
    const std::string& key, std::function<std::shared_ptr<Program>()>&& build) {
  std::unique_lock lock(programs_mutex_);
  const auto known_build = programs_.find(key);
  if (known_build != programs_.end()) return known_build->second;
  const auto task = std::make_shared<std::packaged_task<std::shared_ptr<Program>()>>(
      [this, build = std::move(build)] {
        const auto start = std::chrono::steady_clock::now();
        std::shared_ptr<Program> program = build();
        const std::lock_guard guard(programs_mutex_);
        build_seconds_ += seconds_since(start);
        return program;
      });
  auto new_build = std::make_shared<Build>();
  new_build->program = task->get_future().share();
  programs_.emplace(key, new_build);
  if (polls_while_building()) {
    try {
      new_build->thread = std::jthread([task] { (*task)(); });
      return new_build;
    } catch (const std::system_error&) {
      // no thread is available: the program is built without polling
    }
  }
  lock.unlock();
  (*task)();
  return new_build;
}

Kernel Context::find_or_build_kernel(const std::string& key, const std::string& name,
                                     std::function<std::shared_ptr<Program>()> build) {
  const auto start = std::chrono::steady_clock::now();
  const std::shared_ptr<Build> new_build = build_by(key, std::move(build));
  if (!polls_while_building()) new_build->program.wait();
  while (new_build->program.wait_for(std::chrono::milliseconds(4)) != std::future_status::ready) {
    if (ProgressGuard::is_active()) ProgressGuard::poll();
    const OwnMapRun* const own = OwnMapRun::current();
    if (own != nullptr && seconds_since(start) > own->seconds()) own->abandon_compilation();
  }
  const std::lock_guard lock(programs_mutex_);
  if (new_build->thread.joinable()) new_build->thread.join();
  const auto program = [&] {
    try {
      return new_build->program.get();
    } catch (...) {  // the next caller builds the program again
      const auto known_build = programs_.find(key);
      if (known_build != programs_.end() && known_build->second == new_build)
        programs_.erase(known_build);
      throw;
    }
  }();
  return kernel_of_program(*program, name);
}

Kernel Context::kernel(const std::string& family, const std::string& name,
                       const std::string& defines) {
  return find_or_build_kernel(family + " " + defines, name, [this, family, defines] {
    const std::string_view source = embedded_source(family);
    if (source.empty()) {
      throw Error(ErrorCode::internal, "There is no kernel family '" + family + "'.");
    }
    return build(source, "kernels/" + family + ".cl", defines, ErrorCode::device);
  });
}

namespace {

/// NVIDIA's compiler ignores #line and counts the lines of the whole text: `<kernel>:1365:13`. Converts such numbers
/// to lines of the user's file.
std::string remap_lines(const std::string& file, const std::string& before, std::string log) {
  const auto lines = std::count(before.begin(), before.end(), '\n');
  const std::string mark = "<kernel>:";
  for (std::size_t at = log.find(mark); at != std::string::npos; at = log.find(mark, at)) {
    const std::size_t digits = at + mark.size();
    const std::size_t end = std::min(log.find_first_not_of("0123456789", digits), log.size());
    const long line = std::strtol(log.c_str() + digits, nullptr, 10);
    const std::string place =
        line > lines ? file + ":" + std::to_string(line - lines) : log.substr(at, end - at);
    log.replace(at, end - at, place);
    at += place.size();
  }
  return log;
}

}  // namespace

Kernel Context::kernel_with(const std::string& family, const std::string& name,
                            const std::string& more, const std::string& more_name) {
  const OwnMapRun* const own = OwnMapRun::current();
  const std::string label = own != nullptr ? own->label() : more_name;
  return find_or_build_kernel(family + "\n" + more_name + "\n" + more, name, [=, this] {
    const OwnMapRun here(
        // a copy of the name for the building thread, which may outlive the waiting thread
        label, 0);
    std::string file = more_name;
    for (char& c : file) {
      if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32) c = '_';
    }
    const std::string before =
        std::string(embedded_source(family)) + kSourcePrefix + "#line 1 \"" + file + "\"\n";
    try {
      return build(before + more + "\n", "'" + more_name + "'", {}, ErrorCode::input);
    } catch (const Error& error) {
      throw Error(error.code(), remap_lines(file, before, error.what()));
    }
  });
}

}  // namespace kiln::ocl
