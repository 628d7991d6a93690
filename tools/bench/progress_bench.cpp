// Measures the progress of long bakes: callbacks per second, the longest interval between them, and the latency of
// cancelling.
//
// progress_bench [FACES [CANCELS [MATCH]]]   default: 10000000 faces, 8 cancels, ray
//
// A source of a high poly is built and a map of 2048² baked from it, once to the end and then again and again,
// cancelled later each time. Give POCL_CACHE_DIR an empty folder, and the first run also compiles all kernels.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "kiln/bake.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Processor seconds of all threads, which depend less on other load than wall-clock time.
double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

/// Makes a grid over the unit square with a wave in z.
Mesh wave(std::uint32_t cells, double height) {
  Mesh mesh;
  mesh.name = "wave";
  const std::uint32_t side = cells + 1;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / cells, v = static_cast<double>(y) / cells;
      mesh.positions.push_back({static_cast<float>(u), static_cast<float>(v),
                                static_cast<float>(height * std::sin(40 * u) * std::cos(31 * v))});
      mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  }
  for (std::uint32_t y = 0; y < cells; ++y) {
    for (std::uint32_t x = 0; x < cells; ++x) {
      const std::uint32_t a = y * side + x;
      mesh.triangles.push_back({a, a + 1, a + side + 1});
      mesh.triangles.push_back({a, a + side + 1, a + side});
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

/// Records the progress callbacks of a run with their times.
struct Watch {
  double cancel_after = 1e9;  ///< seconds after which the callback cancels
  Clock::time_point begin = Clock::now(), last = begin;
  std::optional<Clock::time_point> cancelled;
  int calls = 0;
  double longest_pause = 0, silent_at = 0;
  double cpu_begin = cpu_seconds(), cpu_last = cpu_begin, cpu_silence = 0;
  std::string stage, stage_before_pause;

  Progress progress() {
    return [this](double, std::string_view now) {
      ++calls;
      const double pause = seconds_since(last);
      if (pause > longest_pause) {
        longest_pause = pause;
        silent_at = seconds_since(begin);
        stage_before_pause = stage;
      }
      last = Clock::now();
      cpu_silence = std::max(cpu_silence, cpu_seconds() - cpu_last);
      cpu_last = cpu_seconds();
      stage = now;
      if (seconds_since(begin) < cancel_after) return true;
      if (!cancelled) cancelled = Clock::now();
      return false;
    };
  }
};

/// Builds the source and bakes. \returns false if it was cancelled
bool run(const Device& device, const Mesh& high, const Mesh& low, const MatchMethod& method,
         Watch& watch) {
  const auto source = Source::build(device, high, watch.progress());
  if (!source) return false;
  BakeOptions options{.width = 2048, .height = 2048};
  options.match.method = method;
  options.progress = watch.progress();
  return !bake(*source, low, options).cancelled;
}

void print(const char* what, double seconds, const Watch& watch, double handle_progress) {
  std::string load;
  std::getline(std::ifstream("/proc/loadavg"), load);
  std::printf(
      "{\"bench\": \"progress\", \"run\": \"%s\", \"seconds\": %.2f, \"cpu_seconds\": %.2f, "
      "\"calls_a_second\": %.1f, \"longest_silence\": %.3f, \"at\": %.2f, \"after_stage\": \"%s\", "
      "\"longest_silence_cpu\": %.3f, \"cancel_heard\": %.3f, \"load\": \"%s\"}\n",
      what, seconds, cpu_seconds() - watch.cpu_begin, watch.calls / seconds, watch.longest_pause,
      watch.silent_at, watch.stage_before_pause.c_str(), watch.cpu_silence, handle_progress,
      load.substr(0, load.find(' ')).c_str());
  std::fflush(stdout);
}

int bench(double faces, int cancels, const char* match) {
  const Mesh high = wave(static_cast<std::uint32_t>(std::sqrt(faces / 2)), 0.004);
  const Mesh low = wave(16, 0);
  const MatchMethod method = find_match(match).method;
  const Device device = Device::open();
  double total = 0;
  for (const char* what : {"first", "second"}) {
    Watch watch;
    run(device, high, low, method, watch);
    total = seconds_since(watch.begin);
    print(what, total, watch, 0);
  }
  for (int i = 0; i < cancels; ++i) {
    Watch watch;
    watch.cancel_after = total * (i + 0.5) / cancels;
    if (run(device, high, low, method, watch)) continue;
    // Latency counts from the intended time of cancelling, not from the callback that cancelled.
    print("cancelled", seconds_since(watch.begin), watch,
          seconds_since(watch.begin) - watch.cancel_after);
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** arguments) {
  try {
    return kiln::bench(count > 1 ? std::atof(arguments[1]) : 1e7,
                       count > 2 ? std::atoi(arguments[2]) : 8, count > 3 ? arguments[3] : "ray");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "progress_bench: %s\n", error.what());
    return 1;
  }
}
