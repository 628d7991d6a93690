// Times the build of the bounding volume hierarchy against Embree's, on the same triangles and threads. bvh_bench
// [MESH] (default: procedural spheres of 69 thousand and 1.1 million triangles)
#include <cstdio>
#include <ctime>

#include "accel/bvh.h"
#include "embree_peer.h"
#include "kiln/error.h"
#include "mesh/frame.h"
#include "support.h"

namespace kiln::bench {
namespace {

void bench_build(const Mesh& mesh, const DeviceInfo& info) {
  const std::vector<Vec3> positions = Frame::of(mesh).to_frame(mesh);
  const Bvh bvh = build_bvh(positions, mesh.triangles);
  std::vector<double> kiln_seconds;
  std::vector<double> embree_seconds;
  std::vector<double> cpu_ratios;
  for (int round = 0; round < 7; ++round) {
    const std::clock_t start = std::clock();
    kiln_seconds.push_back(seconds_of([&] { build_bvh(positions, mesh.triangles); }));
    const std::clock_t middle = std::clock();
    const EmbreeScene embree(positions, mesh.triangles, false);
    embree_seconds.push_back(embree.build_seconds());
    cpu_ratios.push_back(embree.build_cpu_seconds() * CLOCKS_PER_SEC /
                         static_cast<double>(middle - start));
  }
  std::sort(kiln_seconds.begin(), kiln_seconds.end());
  std::sort(embree_seconds.begin(), embree_seconds.end());
  const auto faces = static_cast<double>(mesh.triangles.size());
  const auto bytes = static_cast<double>(bvh.nodes().size_bytes() + bvh.blocks().size_bytes());
  JsonLine line;
  line.add("bench", "build").add("scene", mesh.name).add("triangles", faces);
  line.add("seconds", kiln_seconds[3]).add("embree_seconds", embree_seconds[3]);
  line.add("ratio_to_peer", embree_seconds[3] / kiln_seconds[3]);
  line.add("cpu_ratio_to_peer", Mode::median_of(cpu_ratios));
  line.add("bytes_per_triangle", bytes / faces);
  line.add("triangles_per_leaf", faces / static_cast<double>(bvh.block_count));
  line.add("depth", bvh.depth);
  describe(line, info);
  line.print();
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  try {
    const Device device = Device::open();
    if (argc >= 2) {
      bench::bench_build(load_mesh(argv[1]), device.info());
    } else {
      bench::bench_build(bench::procedural_sphere(69000, 0.01F, false), device.info());
      bench::bench_build(bench::procedural_sphere(1100000, 0.01F, false), device.info());
    }
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
