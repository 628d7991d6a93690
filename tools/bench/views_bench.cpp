// Times drawing depth views, compared with Mesa's OpenGL on the same cores, and matching the texels of a map by them.
//
// views_bench [HIGH LOW [SIZE [DEPTH_SIZE]]]   default: a procedural pair, 1024, 1024
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "accel/depth_views.h"
#include "gl_peer.h"
#include "kiln/error.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "support.h"
#include "texel/texels.h"

namespace kiln::bench {
namespace {

/// Checks that both pictures agree, except in pixels that depend on vertex snapping or depth precision.
void compare(cl::Context& context, GlPeer& peer, const DepthViews& views) {
  peer.draw({views.views().back()});
  const std::vector<std::uint32_t> opengl_triangle = peer.ids();
  const std::vector<std::uint64_t> kiln_triangle =
      views.keys().picture(context, views.views().back());
  std::size_t other = 0;
  std::size_t covered = 0;
  for (std::size_t i = 0; i < opengl_triangle.size(); ++i) {
    const std::uint64_t key = kiln_triangle[i];
    const std::uint32_t id = key == KILN_RASTER_EMPTY ? 0 : static_cast<std::uint32_t>(key) + 1;
    covered += id != 0 ? 1 : 0;
    other += id != opengl_triangle[i] ? 1 : 0;
  }
  std::fprintf(stderr, "%zu of %zu covered pixels show another triangle than OpenGL's\n", other,
               covered);
}

void bench_views(const Device& device, const Mesh& high, const Mesh& low, std::uint32_t size,
                 std::uint32_t depth_size) {
  cl::Context& context = context_of(device);
  const Frame frame = Frame::of(high);
  const std::vector<Vec3> positions = frame.to_frame(high);
  const LowSurface surface = LowSurface::of(low, frame);
  TexelOptions options;
  options.width = options.height = size;
  TexelSampler sampler(context, surface, options);
  std::vector<TexelBand> bands;
  double samples = 0;
  std::uint32_t capacity = 0;
  for (std::uint32_t i = 0; i < sampler.band_count(); ++i) {
    bands.push_back(sampler.sample(i));
    samples += bands.back().sample_count;
    capacity = std::max(capacity, bands.back().capacity);
  }
  Rasterizer rasterizer(context, positions, high.triangles);
  const std::vector<Vec3d> directions = spread_directions(12);
  DeviceCorrespondence result(context, capacity);
  const cl::Array<float> score(context, capacity);
  ViewQuery query;
  query.max_distance = static_cast<float>(0.02 * frame.diagonal * frame.scale);
  const DepthViews views(context, rasterizer, directions, depth_size, false,
                         {{}, rasterizer.radius()});

  std::vector<Mode> modes;
  modes.push_back({"draw", false, [&] {
                     rasterizer.draw(views.views(), views.keys());
                     context.finish();
                   }});
  std::optional<GlPeer> peer;
  try {
    peer.emplace(positions, high.triangles, depth_size);
    compare(context, *peer, views);
    modes.push_back({"draw, " + peer->renderer(), true, [&] { peer->draw(views.views()); }});
  } catch (const std::runtime_error& error) {
    std::fprintf(stderr, "OpenGL is not available for comparison: %s\n", error.what());
  }
  for (const auto& [name, criterion] : {std::pair{"match depth", ViewCriterion::depth},
                                        std::pair{"match distance", ViewCriterion::distance},
                                        std::pair{"match angle", ViewCriterion::angle}}) {
    modes.push_back({name, false, [&, criterion = criterion] {
                       query.criterion = criterion;
                       for (const TexelBand& band : bands) {
                         DepthViews::reset(context, band.sample_count, score, result);
                         views.match(band.points, band.sample_count, band.capacity, query, score,
                                     result);
                       }
                       context.finish();
                     }});
  }
  run_rounds(modes, 5);
  for (const Mode& mode : modes) {
    JsonLine line;
    line.add("bench", "views").add("scene", high.name).add("mode", mode.name);
    line.add("seconds", mode.median()).add("best_seconds", mode.least());
    line.add("cpu_seconds", Mode::median_of(mode.cpu_seconds));
    line.add("triangles", static_cast<double>(high.triangles.size())).add("samples", samples);
    if (mode.name == "draw" && peer) line.add("ratio_to_peer", modes[1].median() / mode.median());
    line.add("views", 12).add("depth_size", depth_size);
    describe(line, device.info());
    line.print();
  }
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  try {
    const Device device = Device::open();
    const bool files = argc >= 3;
    const Mesh high = files ? load_mesh(argv[1]) : bench::procedural_sphere(70000, 0.01F, false);
    const Mesh low = files ? load_mesh(argv[2]) : bench::procedural_sphere(2000, 0, true);
    const auto size = static_cast<std::uint32_t>(argc >= 4 ? std::atoi(argv[3]) : 1024);
    const auto depth_size = static_cast<std::uint32_t>(argc >= 5 ? std::atoi(argv[4]) : 1024);
    bench::bench_views(device, high, low, size, depth_size);
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
