// Light meshes with maps from volumes: time by stage.
//
// volume_bench [FACES [MAP]]   default: 3000, 1024. Volumes of 356 x 161 x 251 (the dragon's of Barry and
// Wood), 256^3 and 512^3 voxels of 8 bits: a ball with bumps, hollow within, scaled to the volume's sides.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "kiln/contour.h"
#include "kiln/error.h"
#include "support.h"

namespace kiln::bench {
namespace {

constexpr int kRounds = 5;

Volume bumpy_volume(const std::array<std::uint32_t, 3>& size) {
  Volume volume;
  volume.name =
      std::to_string(size[0]) + "x" + std::to_string(size[1]) + "x" + std::to_string(size[2]);
  volume.size = size;
  volume.type = VoxelType::u8;
  volume.voxels.resize(std::size_t{size[0]} * size[1] * size[2]);
  const double least = *std::min_element(size.begin(), size.end());
  parallel_for(size[2], 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      for (std::size_t y = 0; y < size[1]; ++y) {
        for (std::size_t x = 0; x < size[0]; ++x) {
          const double p = 2.0 * x / (size[0] - 1) - 1, q = 2.0 * y / (size[1] - 1) - 1,
                       r = 2.0 * z / (size[2] - 1) - 1;
          const double radius = std::sqrt(p * p + q * q + r * r);
          const double bumps = 0.03 * std::sin(23 * p) * std::sin(19 * q) * std::sin(21 * r);
          const double shell = std::min(0.85 + bumps - radius, radius - 0.5);
          // Over four voxels each way.
          const double value = 128 + shell * least / 2 * 32;
          volume.voxels[(z * size[1] + y) * size[0] + x] =
              static_cast<std::byte>(std::clamp(std::lround(value), 0L, 255L));
        }
      }
    }
  });
  return volume;
}

struct Stage {
  const char* name;
  double (*seconds)(const ExtractReport&);
};

constexpr std::array<Stage, 9> kStages = {
    {{"scan", [](const ExtractReport& r) { return r.contour.seconds_scan; }},
     {"outer", [](const ExtractReport& r) { return r.contour.seconds_outer; }},
     {"hermite", [](const ExtractReport& r) { return r.contour.seconds_hermite; }},
     {"vertices", [](const ExtractReport& r) { return r.contour.seconds_vertices; }},
     {"quads", [](const ExtractReport& r) { return r.contour.seconds_quads; }},
     {"simplify", [](const ExtractReport& r) { return r.seconds_simplify; }},
     {"atlas", [](const ExtractReport& r) { return r.seconds_atlas; }},
     {"map", [](const ExtractReport& r) { return r.seconds_map; }},
     {"total", [](const ExtractReport& r) { return r.seconds_total; }}}};

void measure(const Device& device, const Volume& volume, const ExtractOptions& options) {
  std::vector<ExtractReport> reports;
  for (int round = -1; round < kRounds; ++round) {  // the first warms up
    ExtractReport report = extract(device, volume, options).report;
    if (report.faces > options.faces || report.non_manifold_edges != 0) {
      throw Error(ErrorCode::internal, "The light mesh is not what was asked for.");
    }
    if (round >= 0) reports.push_back(std::move(report));
  }
  JsonLine line;
  line.add("bench", std::string("volume"))
      .add("volume", volume.name)
      .add("outer", options.contour.outer_only ? 1 : 0)
      .add("map", options.size)
      .add("full_quads", static_cast<double>(reports[0].contour.quads))
      .add("faces", static_cast<double>(reports[0].faces))
      .add("rounds", kRounds);
  for (const Stage& stage : kStages) {
    std::vector<double> seconds;
    for (const ExtractReport& report : reports) seconds.push_back(stage.seconds(report));
    line.add(std::string(stage.name) + "_seconds", Mode::median_of(seconds));
  }
  describe(line, device.info());
  line.print();
}

int run(int argc, char** argv) {
  ExtractOptions options;
  options.contour.iso = 128;
  options.faces = argc > 1 ? static_cast<std::uint32_t>(std::atoi(argv[1])) : 3000;
  options.size = argc > 2 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : 1024;
  const Device device = Device::open();
  for (const std::array<std::uint32_t, 3>& size :
       {std::array{356U, 161U, 251U}, {256U, 256U, 256U}, {512U, 512U, 512U}}) {
    const Volume volume = bumpy_volume(size);
    for (const bool outer : {false, true}) {
      options.contour.outer_only = outer;
      options.contour.outer_gap = outer ? 2 : 0;
      measure(device, volume, options);
    }
  }
  return 0;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  try {
    return kiln::bench::run(argc, argv);
  } catch (const kiln::Error& error) {
    std::fprintf(stderr, "volume_bench: %s\n", error.what());
    return 1;
  }
}
