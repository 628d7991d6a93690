#include "support.h"

#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

#include "base/parallel.h"

namespace kiln::bench {

namespace {

/// Returns the median over all rounds of the ratio of the best peer's time to this mode's time in the same round.
double ratio_to_best_peer(const Mode& mode, const std::vector<Mode>& modes,
                          std::vector<double> Mode::*times) {
  std::vector<double> ratios;
  for (std::size_t round = 0; round < (mode.*times).size(); ++round) {
    double best = std::numeric_limits<double>::infinity();
    for (const Mode& other : modes) {
      if (other.peer) best = std::min(best, (other.*times)[round]);
    }
    ratios.push_back(best / (mode.*times)[round]);
  }
  return Mode::median_of(ratios);
}

}  // namespace

Mesh procedural_sphere(std::size_t faces, float bumps, bool uvs) {
  const int rows = std::max(3, static_cast<int>(std::sqrt(static_cast<double>(faces) / 4)));
  const int columns = 2 * rows;
  const double pi = 3.14159265358979323846;
  Mesh mesh;
  mesh.name = "sphere";
  // Each row has columns + 1 vertices, so that each vertex needs only one UV.
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double theta = pi * row / rows;
      const double phi = 2 * pi * (column % columns) / columns;
      const double bump = std::sin(9 * phi) * std::sin(11 * theta) + 0.3 * std::sin(61 * theta);
      const double r = 1 + bumps * bump * std::sin(theta);
      mesh.positions.push_back({static_cast<float>(r * std::sin(theta) * std::cos(phi)),
                                static_cast<float>(r * std::sin(theta) * std::sin(phi)),
                                static_cast<float>(r * std::cos(theta))});
      if (uvs) {
        mesh.uvs.push_back({static_cast<float>(column) / static_cast<float>(columns),
                            1.0F - static_cast<float>(row) / static_cast<float>(rows)});
      }
    }
  }
  const auto at = [&](int row, int column) {
    return static_cast<std::uint32_t>(row * (columns + 1) + column);
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (row + 1 < rows) {
        mesh.triangles.push_back({at(row, column), at(row + 1, column), at(row + 1, column + 1)});
      }
      if (row > 0) {
        mesh.triangles.push_back({at(row, column), at(row + 1, column + 1), at(row, column + 1)});
      }
    }
  }
  if (uvs) mesh.uv_triangles = mesh.triangles;
  return mesh;
}

void run_rounds(std::vector<Mode>& modes, int rounds) {
  for (Mode& mode : modes) mode.run();
  for (int round = 0;; ++round) {
    bool enough = round >= rounds;
    for (Mode& mode : modes) {
      double total = 0;
      for (double seconds : mode.seconds) total += seconds;
      enough = enough && total >= 0.5;
    }
    if (enough) return;
    for (Mode& mode : modes) {
      const std::clock_t before = std::clock();
      mode.seconds.push_back(seconds_of(mode.run));
      mode.cpu_seconds.push_back(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC);
    }
  }
}

JsonLine& JsonLine::add(const std::string& key, const std::string& value) {
  if (!text_.empty()) text_ += ", ";
  text_ += '"' + key + "\": \"";
  for (char c : value) {
    if (c == '"' || c == '\\') text_ += '\\';
    text_ += c;
  }
  text_ += '"';
  return *this;
}

JsonLine& JsonLine::add(const std::string& key, double value) {
  char number[64];
  std::snprintf(number, sizeof(number), "%.6g", value);
  if (!text_.empty()) text_ += ", ";
  text_ += '"' + key + "\": " + number;
  return *this;
}

void JsonLine::print() const {
  std::printf("{%s}\n", text_.c_str());
  std::fflush(stdout);
}

void describe(JsonLine& line, const DeviceInfo& info) {
  line.add("device", info.name).add("driver", info.platform + " " + info.driver);
  line.add("threads", thread_count());
}

void print_modes(const std::string& bench, const std::string& scene, const DeviceInfo& info,
                 double items, const std::vector<Mode>& modes,
                 const std::vector<std::pair<std::string, double>>& extra) {
  for (const Mode& mode : modes) {
    const double ratio = ratio_to_best_peer(mode, modes, &Mode::seconds);
    const double cpu_ratio = ratio_to_best_peer(mode, modes, &Mode::cpu_seconds);
    JsonLine line;
    line.add("bench", bench).add("scene", scene).add("mode", mode.name);
    line.add("million_per_second", items / mode.median() * 1e-6);
    line.add("best_million_per_second", items / mode.least() * 1e-6);
    line.add("ratio_to_best_peer", ratio);
    line.add("million_per_cpu_second", items / Mode::median_of(mode.cpu_seconds) * 1e-6);
    line.add("cpu_ratio_to_best_peer", cpu_ratio);
    line.add("rounds", static_cast<double>(mode.seconds.size()));
    for (const auto& [key, value] : extra) line.add(key, value);
    describe(line, info);
    line.print();
  }
}

}  // namespace kiln::bench
