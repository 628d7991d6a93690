// Times repeated extractions from a volume session, with other face counts and after changes of voxels, and
// compares them with extractions from a new session.
//
// volume_session_bench [VOLUME ISO GAP]   default: a hollow ball with bumps of 256^3 voxels, --outer-gap 2.
// Prints milliseconds: medians of the wall-clock time, and of the CPU time of all threads. Before an extraction is
// timed, its result is compared byte by byte with that of a new session.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "kiln/contour.h"
#include "kiln/error.h"
#include "kiln/volume.h"
#include "support.h"
#include "volume_scene.h"

namespace kiln::bench {
namespace {

constexpr int kRounds = 5;

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <typename T>
bool is_equal(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void check(const ExtractResult& a, const ExtractResult& b) {
  if (!is_equal(a.mesh.positions, b.mesh.positions) ||
      !is_equal(a.mesh.triangles, b.mesh.triangles) || !is_equal(a.mesh.uvs, b.mesh.uvs) ||
      !is_equal(a.normal_map.pixels, b.normal_map.pixels)) {
    throw Error(ErrorCode::internal, "The session's result differs from a new extraction.");
  }
}

/// The bytes of a box of voxels, optionally with a ball of another value inside.
std::vector<std::byte> box_of(const Volume& volume, const VolumeRegion& region, bool crater) {
  const std::size_t bytes = size_of(volume.type);
  std::vector<std::byte> box;
  for (std::uint32_t z = 0; z < region.size[2]; ++z) {
    for (std::uint32_t y = 0; y < region.size[1]; ++y) {
      for (std::uint32_t x = 0; x < region.size[0]; ++x) {
        const std::uint32_t at[3] = {x, y, z};
        double r = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double half = (region.size[k] - 1) / 2.0;
          r += (at[k] - half) * (at[k] - half) / (half * half);
        }
        const std::size_t line =
            std::size_t{region.first[2] + z} * volume.size[1] + region.first[1] + y;
        const std::byte* from =
            &volume.voxels[(line * volume.size[0] + region.first[0] + x) * bytes];
        const bool empty = crater && r < 1;
        for (std::size_t b = 0; b < bytes; ++b) box.push_back(empty ? std::byte{0} : from[b]);
      }
    }
  }
  return box;
}

void time_it(const char* what, const Volume& volume, const Device& device,
             const std::function<void(int)>& run) {
  std::vector<double> wall, cpu;
  for (int round = -1; round < kRounds; ++round) {  // round -1 is a warm-up
    const double before = cpu_seconds();
    const double seconds = seconds_of([&] { run(round); });
    if (round < 0) continue;
    wall.push_back(1000 * seconds);
    cpu.push_back(1000 * (cpu_seconds() - before));
  }
  JsonLine line;
  line.add("bench", std::string("volume_session"))
      .add("volume", volume.name)
      .add("what", std::string(what))
      .add("rounds", kRounds)
      .add("milliseconds", Mode::median_of(wall))
      .add("cpu_milliseconds", Mode::median_of(cpu));
  describe(line, device.info());
  line.print();
}

int run(int argc, char** argv) {
  const Device device = Device::open();
  const Volume volume = argc > 1 ? load_volume(argv[1]) : bumpy_volume({256, 256, 256});
  ContourOptions contour;
  contour.iso = argc > 2 ? std::atof(argv[2]) : 128;
  contour.outer_only = true;
  contour.outer_gap = argc > 3 ? static_cast<std::uint32_t>(std::atoi(argv[3])) : 2;
  // Finds a region that contains a part of the surface, searching inwards from the centre of a side of the volume.
  VolumeRegion region{{volume.size[0] / 2, volume.size[1] / 2, volume.size[2] - 45}, {24, 24, 24}};
  const std::vector<std::byte> whole = box_of(volume, region, false);
  const std::vector<std::byte> crater = box_of(volume, region, true);
  if (whole == crater)
    throw Error(ErrorCode::internal, "The box of voxels contains no surface to change.");

  VolumeSession session(device, volume, contour);
  for (const std::uint32_t faces : {3000U, 10000U, 30000U}) {
    ExtractOptions options;
    options.contour = contour;
    options.faces = faces;
    options.choose.size = true;
    const std::string name = std::to_string(faces) + " faces";
    check(session.extract(options), extract(device, volume, options));
    time_it(("afresh to " + name).c_str(), volume, device,
            [&](int) { extract(device, volume, options); });
    time_it(("session to " + name).c_str(), volume, device, [&](int) { session.extract(options); });
  }
  // The two updates alternate, so that each of them changes voxels.
  time_it("update of 24 x 24 x 24 voxels", volume, device,
          [&](int round) { session.update(region, round % 2 == 0 ? whole : crater); });
  session.update(region, crater);
  ExtractOptions options;
  options.contour = contour;
  options.faces = 3000;
  options.choose.size = true;
  check(session.extract(options), extract(device, session.volume(), options));
  return 0;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  try {
    return kiln::bench::run(argc, argv);
  } catch (const kiln::Error& error) {
    std::fprintf(stderr, "volume_session_bench: %s\n", error.what());
    return 1;
  }
}
