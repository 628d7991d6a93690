// Computes visibility directions from depth views and from rays, at texels, vertices and faces. Prints the times, and
// the angles between the directions of both methods.
//
// visibility_bench [HIGH LOW [SIZE [DIRECTIONS [RAYS]]]]   default: a procedural pair, 2048, 512. RAYS 0: skips
// the rays at texels, which take longest; the angles at texels are then unknown.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "kiln/error.h"
#include "match/visibility.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "support.h"

namespace kiln::bench {
namespace {

class VisibilityBench {
 public:
  VisibilityBench(const Mesh& high, const Mesh& low, std::uint32_t size, std::uint32_t directions)
      : device_(Device::open()),
        name_(low.name),
        triangles_(low.triangles.size()),
        surface_(LowSurface::of(low, Frame::of(high))),
        size_(size),
        directions_(directions) {}

  void run(bool texel_rays) {
    for (const auto& [at, name] :
         {std::pair{VisibilityAt::vertex, "vertex"}, std::pair{VisibilityAt::face, "face"},
          std::pair{VisibilityAt::texel, "texel"}}) {
      VisibilityOptions options;
      options.at = at;
      options.directions = directions_;
      std::vector<float> exact;
      if (at != VisibilityAt::texel || texel_rays) {
        options.test = VisibilityTest::rays;
        exact = measure(options, name, at == VisibilityAt::texel ? 1 : 5, {});
      }
      options.test = VisibilityTest::views;
      for (const std::uint32_t pixels : {128U, 256U, 512U, 1024U}) {
        options.view_size = pixels;
        measure(options, name, pixels > 256 ? 2 : 3, exact);
      }
    }
  }

 private:
  /// Times a visibility field, compares it with the reference, and returns it.
  std::vector<float> measure(const VisibilityOptions& options, const char* name, int rounds,
                             const std::vector<float>& exact) {
    cl::Context& context = context_of(device_);
    VisibilityReport report;
    std::vector<float> values;
    std::vector<double> seconds;
    for (int round = rounds > 1 ? -1 : 0; round < rounds; ++round) {  // round -1 is a warm-up
      report = {};
      const double time = seconds_of([&] {
        const VisibilityField field(context, surface_, size_, size_, options, Traversal::automatic,
                                    report);
        values = field.field().download(context);
      });
      if (round >= 0) seconds.push_back(time);
    }
    std::sort(seconds.begin(), seconds.end());
    JsonLine line;
    line.add("bench", std::string("visibility"))
        .add("scene", name_)
        .add("at", std::string(name))
        .add("test", std::string(report.by_rays ? "rays" : "views"))
        .add("view_size", report.by_rays ? 0 : options.view_size)
        .add("directions", options.directions)
        .add("triangles", static_cast<double>(triangles_))
        .add("places", static_cast<double>(report.places))
        .add("seconds", seconds[seconds.size() / 2])
        .add("best_seconds", seconds[0])
        .add("mprobes_per_second",
             static_cast<double>(report.places) * options.directions / seconds[0] / 1e6)
        .add("unseen", static_cast<double>(report.unseen));
    if (!exact.empty()) {
      std::vector<double> errors;
      for (std::size_t i = 0; i < values.size(); i += 4) {
        if (!(values[i + 3] > 0) || !(exact[i + 3] > 0)) continue;
        const Vec3d a{values[i], values[i + 1], values[i + 2]};
        const Vec3d b{exact[i], exact[i + 1], exact[i + 2]};
        errors.push_back(std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi);
      }
      std::sort(errors.begin(), errors.end());
      double sum = 0;
      for (const double error : errors) sum += error;
      line.add("mean_degrees", sum / static_cast<double>(errors.size()))
          .add("p99_degrees", errors[errors.size() * 99 / 100])
          .add("max_degrees", errors.back());
    }
    describe(line, device_.info());
    line.print();
    return values;
  }

  Device device_;
  std::string name_;
  std::size_t triangles_;
  LowSurface surface_;
  std::uint32_t size_, directions_;
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
    const int directions = argc >= 5 ? std::atoi(argv[4]) : 512;
    bench::VisibilityBench(high, low, static_cast<std::uint32_t>(size),
                           static_cast<std::uint32_t>(directions))
        .run(argc < 6 || std::atoi(argv[5]) != 0);
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
