// Times nearest-point searches, compared with Embree's point queries on the same samples and threads in the same run.
//
// closest_bench [HIGH LOW [SIZE [MODES [P]]]]   default: a procedural pair, 2048. MODES: runs these alone, such
// as "kiln,embree seeded". P: the search distance in percent of the diagonal, 2 by default.
//
// The samples are those of a bake. The compared query accepts front and back faces; both programs are also timed with
// back faces skipped, as in bakes. "embree seeded" starts each search with an upper bound of the distance, which
// follows from the previous sample's nearest point.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "accel/closest.h"
#include "embree_peer.h"
#include "kiln/error.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "support.h"
#include "texel/texels.h"

namespace kiln::bench {
namespace {

/// A band of samples, on the device and in host memory.
struct Band {
  TexelBand device;
  std::vector<float> host;
  DeviceCorrespondence match;
  RayResults peer;
};

class ClosestBench {
 public:
  ClosestBench(const Mesh& high, const Mesh& low, std::uint32_t size, double percent,
               std::string only)
      : device_(Device::open()),
        frame_(Frame::of(high)),
        positions_(frame_.to_frame(high)),
        high_(high),
        only_(std::move(only)),
        size_(size),
        percent_(percent),
        tree_(std::make_shared<const Tree>(context_of(device_), positions_, high.triangles)),
        finder_(context_of(device_), tree_),
        scalar_(context_of(device_), tree_, Traversal::gpu),
        embree_(positions_, high.triangles, false) {
    const LowSurface surface = LowSurface::of(low, frame_);
    TexelOptions options;
    options.width = options.height = size;
    TexelSampler sampler(context_of(device_), surface, options);
    for (std::uint32_t i = 0; i < sampler.band_count(); ++i) {
      Band band;
      band.device = sampler.sample(i);
      if (band.device.sample_count == 0) continue;
      band.host = band.device.points.download(context_of(device_));
      band.match = DeviceCorrespondence(context_of(device_), band.device.capacity);
      samples_ += band.device.sample_count;
      bands_.push_back(std::move(band));
    }
  }

  void run() {
    ClosestQuery query;
    query.max_distance = static_cast<float>(frame_.diagonal * frame_.scale * percent_ / 100);
    query.two_sided = true;
    ClosestQuery one_sided = query;
    one_sided.two_sided = false;
    compare(query);
    std::vector<Mode> modes;
    modes.push_back({"kiln", false, [&] { find(finder_, query); }});
    modes.push_back({"kiln one-sided", false, [&] { find(finder_, one_sided); }});
    modes.push_back({"kiln scalar", false, [&] { find(scalar_, query); }});
    modes.push_back({"embree", true, [&] { find_embree(query, false); }});
    modes.push_back({"embree seeded", true, [&] { find_embree(query, true); }});
    modes.push_back({"embree one-sided", true, [&] { find_embree(one_sided, false); }});
    if (!only_.empty()) {
      const std::string list = "," + only_ + ",";
      std::erase_if(modes, [&](const Mode& mode) {
        return list.find("," + mode.name + ",") == std::string::npos;
      });
    }
    run_rounds(modes, 5);
    print_modes("nearest points", high_.name, device_.info(), samples_, modes,
                {{"samples", samples_},
                 {"size", size_},
                 {"triangles", static_cast<double>(high_.triangles.size())},
                 {"found", found_},
                 {"only_ours", only_kiln_found_},
                 {"only_theirs", only_embree_found_},
                 {"farther", farther_},
                 {"nearer", nearer_}});
  }

 private:
  void find(const ClosestFinder& finder, const ClosestQuery& query) {
    for (Band& band : bands_) {
      finder.find(band.device.points, band.device.sample_count, band.device.capacity, query,
                  band.match);
    }
    context_of(device_).finish();
  }

  void find_embree(const ClosestQuery& query, bool seeded) {
    for (Band& band : bands_) {
      RayPlanes planes;
      planes.planes = band.host;
      planes.count = band.device.sample_count;
      planes.capacity = band.device.capacity;
      planes.t_max = query.max_distance;
      embree_.closest(planes, query.two_sided, seeded, band.peer);
    }
  }

  /// Compares the distances of both implementations, sample by sample.
  void compare(const ClosestQuery& query) {
    find(finder_, query);
    find_embree(query, true);
    for (Band& band : bands_) {
      const std::vector<std::uint32_t> triangle = band.match.triangle.download(context_of(device_));
      const std::vector<float> distance = band.match.distance.download(context_of(device_));
      for (std::size_t i = 0; i < band.device.sample_count; ++i) {
        const bool kiln_found = triangle[i] != KILN_NO_TRIANGLE;
        const bool embree_found = band.peer.triangle[i] != KILN_NO_TRIANGLE;
        found_ += kiln_found ? 1 : 0;
        only_kiln_found_ += kiln_found && !embree_found ? 1 : 0;
        only_embree_found_ += embree_found && !kiln_found ? 1 : 0;
        if (!kiln_found || !embree_found) continue;
        const float more = std::abs(distance[i]) - band.peer.t[i];
        farther_ += more > 1e-6F ? 1 : 0;
        nearer_ += more < -1e-6F ? 1 : 0;
      }
    }
  }

  Device device_;
  Frame frame_;
  std::vector<Vec3> positions_;
  const Mesh& high_;
  std::string only_;
  std::uint32_t size_;
  double percent_;
  std::shared_ptr<const Tree> tree_;
  ClosestFinder finder_;
  ClosestFinder scalar_;
  EmbreeScene embree_;
  std::vector<Band> bands_;
  double samples_ = 0, found_ = 0, only_kiln_found_ = 0, only_embree_found_ = 0, farther_ = 0,
         nearer_ = 0;
};

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  try {
    const bool files = argc >= 3;
    const Mesh high = files ? load_mesh(argv[1]) : bench::procedural_sphere(70000, 0.01F, false);
    const Mesh low = files ? load_mesh(argv[2]) : bench::procedural_sphere(2000, 0, true);
    const int size = argc >= 4 ? std::atoi(argv[3]) : 2048;
    bench::ClosestBench(high, low, static_cast<std::uint32_t>(size),
                        argc >= 6 ? std::atof(argv[5]) : 2, argc >= 5 ? argv[4] : "")
        .run();
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
