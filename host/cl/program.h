// Programs that a context has built and caches. Only cl/context.cpp, cl/program.cpp and tests include this header.
#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "cl/context.h"
#include "cl/driver.h"

namespace kiln::ocl {

/// Number of Kiln's programs that were compiled with the driver's whole header, since they failed with the
/// declarations of kernels/cl/builtins.cl; for tests.
std::uint64_t whole_header_builds();

/// Name of an OpenCL status.
std::string status_name(cl_int status);

struct Context::Program {
  cl_program program = nullptr;
  std::map<std::string, cl_kernel> kernels;
  ~Program() {
    for (auto& [name, kernel] : kernels) {
      if (kernel != nullptr) release([&, k = kernel] { clReleaseKernel(k); });
    }
    if (program != nullptr) release([&] { clReleaseProgram(program); });
  }
};

struct Context::Build {
  std::shared_future<std::shared_ptr<Program>> program;
  std::jthread thread;  ///< Builds the program; threads that wait for it poll the progress callback
};

}  // namespace kiln::ocl
