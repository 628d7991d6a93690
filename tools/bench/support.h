// Common code of the benchmarks: scenes, timing, and one JSON line per result.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "kiln/device.h"
#include "kiln/mesh.h"

namespace kiln::bench {

/// Makes a bumpy sphere of about `faces` triangles with its poles on the Z axis. `uvs` adds the latitude-longitude
/// layout.
Mesh procedural_sphere(std::size_t faces, float bumps, bool uvs);

inline double seconds_of(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One of the implementations that a benchmark compares.
struct Mode {
  std::string name;
  bool peer = false;  ///< True for an implementation by Embree or another library
  std::function<void()> run;
  std::vector<double> seconds{};
  /// Processor seconds of all threads, which depend less on other load than wall-clock time
  std::vector<double> cpu_seconds{};

  static double median_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }
  double median() const { return median_of(seconds); }
  double least() const { return *std::min_element(seconds.begin(), seconds.end()); }
};

/// Warms up each mode, then alternates between all modes, since the speed of a machine drifts: at least `rounds` rounds
/// and half a second per mode.
void run_rounds(std::vector<Mode>& modes, int rounds);

/// Builds a JSON object field by field.
class JsonLine {
 public:
  JsonLine& add(const std::string& key, const std::string& value);
  JsonLine& add(const std::string& key, double value);
  void print() const;

 private:
  std::string text_;
};

/// Adds device, driver and number of threads to a line.
void describe(JsonLine& line, const DeviceInfo& info);

/// Prints one line per mode: millions of items per second (median and best), and the ratio to the best peer, compared
/// round by round.
void print_modes(const std::string& bench, const std::string& scene, const DeviceInfo& info,
                 double items, const std::vector<Mode>& modes,
                 const std::vector<std::pair<std::string, double>>& extra);

}  // namespace kiln::bench
