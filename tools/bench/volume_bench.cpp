// Times low polys with maps from volumes, by stage.
//
// volume_bench [FACES [MAP]]   default: 3000, 1024. Volumes of 356 x 161 x 251 (the dragon's of Barry and
// Wood), 256^3 and 512^3 voxels of 8 bits: a ball with bumps, hollow within, scaled to the volume's sides.
#include <array>
#include <cstdio>
#include <cstdlib>
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
  for (int round = -1; round < kRounds; ++round) {  // round -1 is a warm-up
    ExtractReport report = extract(device, volume, options).report;
    if (report.faces > options.faces || report.non_manifold_edges != 0) {
      throw Error(ErrorCode::internal, "The low poly differs from the requested one.");
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
