// Times re-bakes of a moving mesh, from new positions to pixels: milliseconds per frame, median and maximum.
//
// session_bench [FRAMES [CELLS]]   default: 120 frames, 174 cells a side (60,552 triangles)
//
// "all": every vertex moves, matched by UVs at 1024² and by rays at 512². "part": the first updates of 5% of the
// vertices or normals in a new session, each as a separate frame, which checks the worst latency. Kernels are compiled
// before timing. Reports wall and CPU time, and the machine's load.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "kiln/render.h"
#include "kiln/session.h"

namespace kiln {
namespace {

/// Makes a grid over the unit square with waves of two lengths in z.
Mesh wave(std::uint32_t cells, double phase, double fine) {
  Mesh mesh;
  mesh.name = "wave";
  const std::uint32_t side = cells + 1;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / cells, v = static_cast<double>(y) / cells;
      const double z = 0.02 * std::sin(5 * u) * std::cos(4 * v) +
                       fine * std::sin(40 * u + phase) * std::cos(31 * v + phase);
      mesh.positions.push_back(
          {static_cast<float>(u), static_cast<float>(v), static_cast<float>(z)});
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

double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

struct Times {
  std::vector<double> wall, cpu;
  template <typename Work>
  void add(const Work& work) {
    const double cpu_before = cpu_seconds();
    const auto before = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> took =
        std::chrono::steady_clock::now() - before;
    wall.push_back(took.count());
    cpu.push_back(1e3 * (cpu_seconds() - cpu_before));
  }
  void print(const std::string& what) {
    std::string load;
    std::getline(std::ifstream("/proc/loadavg"), load);
    std::sort(wall.begin(), wall.end());
    std::sort(cpu.begin(), cpu.end());
    std::printf(
        "{\"bench\": \"session\", \"what\": \"%s\", \"frames\": %zu, \"median_ms\": %.1f, "
        "\"worst_ms\": %.1f, \"cpu_median_ms\": %.1f, \"cpu_worst_ms\": %.1f, \"per_second\": "
        "%.0f, \"load\": \"%s\"}\n",
        what.c_str(), wall.size(), wall[wall.size() / 2], wall.back(), cpu[cpu.size() / 2],
        cpu.back(), 1e3 / wall[wall.size() / 2], load.substr(0, load.find(' ')).c_str());
    std::fflush(stdout);
  }
};

class Scene {
 public:
  Scene(const Device& opened, std::uint32_t cells, std::uint32_t size, const MatchMethod& match)
      : device(opened) {
    for (int i = 0; i < 8; ++i) phases.push_back(wave(cells, 0.3 * i, 0.004));
    options.width = options.height = size;
    options.match.method = match;
    bounds.bounds = Bounds{{0, 0, -0.03}, {1, 1, 0.03}};
  }
  BakeSession begin() const {
    BakeSession session(device, phases[0], wave(16, 0, 0), options, bounds);
    session.bake();
    return session;
  }
  void move(BakeSession& session, std::size_t frame, std::uint32_t share) const {
    const std::vector<Vec3>& to = phases[frame % phases.size()].positions;
    const std::size_t count = to.size() / share, first = (to.size() - count) / 2;
    session.set_positions(static_cast<std::uint32_t>(first), std::span(to).subspan(first, count));
  }
  /// Checks that a re-bake equals a new bake.
  void check(BakeSession& session) const {
    const Source source(device, session.high(), RayTraversal::automatic, session.bounds());
    const BakeResult fresh = bake(source, wave(16, 0, 0), options);
    const std::vector<float>& rebaked = session.bake().maps[0].image.pixels;
    const std::vector<float>& fresh_bake = fresh.maps[0].image.pixels;
    if (std::memcmp(rebaked.data(), fresh_bake.data(), rebaked.size() * sizeof(float)) == 0) return;
    std::fprintf(stderr, "session_bench: a re-bake differs from a new bake\n");
    std::exit(1);
  }

  Device device;
  std::vector<Mesh> phases;
  BakeOptions options;
  SessionOptions bounds;
};

void bench(const Device& device, std::uint32_t cells, std::uint32_t size, const char* match,
           int frames) {
  const Scene scene(device, cells, size, find_match(match).method);
  const std::string name = std::string(match) + " " + std::to_string(size);
  BakeSession session = scene.begin();
  Times all, part, first;
  for (int i = 1; i <= frames; ++i) {
    all.add([&] {
      scene.move(session, static_cast<std::size_t>(i), 1);
      session.bake();
    });
  }
  scene.check(session);
  all.print(name + ", all vertices move");
  // Times the first update of several new sessions, and the next three updates of each.
  for (int i = 0; i < std::max(3, frames / 10); ++i) {
    BakeSession fresh = scene.begin();
    first.add([&] {
      scene.move(fresh, 1, 20);
      fresh.bake();
    });
    for (std::size_t frame = 2; frame < 5; ++frame) {
      part.add([&] {
        scene.move(fresh, frame, 20);
        fresh.bake();
      });
    }
    if (i == 0) scene.check(fresh);
  }
  first.print(name + ", a twentieth of the vertices moves, first update");
  part.print(name + ", a twentieth of the vertices moves, later updates");
}

}  // namespace
}  // namespace kiln

int main(int count, char** arguments) {
  try {
    const int frames = count > 1 ? std::max(1, std::atoi(arguments[1])) : 120;
    const int cells = count > 2 ? std::max(2, std::atoi(arguments[2])) : 174;
    const kiln::Device device = kiln::Device::open();
    for (const std::uint32_t size : {512U, 1024U}) {
      kiln::bench(device, static_cast<std::uint32_t>(cells), size, "uv", frames);
      kiln::bench(device, static_cast<std::uint32_t>(cells), size, "ray", frames);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "session_bench: %s\n", error.what());
    return 1;
  }
}
