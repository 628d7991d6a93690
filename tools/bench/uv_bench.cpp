// Times matching by UVs: the kernels, and milliseconds per re-bake of a moving mesh.
//
// uv_bench [CELLS [SIZE...]]   default: 176 (61,952 triangles; the paper's high poly has 61,644), 512 1024
//
// "cover", "match", "distance" and "detail" are the times of single kernels of a bake, including their launches.
// Re-bakes are complete: from new positions to the encoded map with padding, on the host.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "detail/normal.h"
#include "kiln/session.h"
#include "match/uv.h"
#include "mesh/kernels_shared.h"
#include "source/high_poly.h"
#include "support.h"
#include "texel/texels.h"

namespace kiln::bench {
namespace {

/// Makes a grid over the unit square with a wave in z.
Mesh wave(std::uint32_t cells, double phase) {
  Mesh mesh;
  mesh.name = "wave";
  const std::uint32_t side = cells + 1;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / cells;
      const double v = static_cast<double>(y) / cells;
      mesh.positions.push_back(
          {static_cast<float>(u), static_cast<float>(v),
           static_cast<float>(0.008 * std::sin(40 * u + phase) * std::cos(31 * v + phase))});
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

Mesh light() {
  Mesh mesh;
  mesh.name = "light";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

BakeOptions options_of(std::uint32_t size, MatchMethod method) {
  BakeOptions options;
  options.width = options.height = size;
  options.match.method = method;
  return options;
}

/// Times the kernels of a bake, without work on the host.
void bench_kernels(const Device& device, const Mesh& dense, std::uint32_t size) {
  cl::Context& context = context_of(device);
  const Source source(device, dense);
  const Source::Impl& high = impl_of(source);
  const BakeOptions options = options_of(size, MatchMethod::uv);
  const LowSurface surface = LowSurface::of(light(), high.frame);
  TexelSampler sampler(context, surface, {size, size, 1, 1U << 20});
  std::vector<TexelBand> bands;
  std::vector<DeviceCorrespondence> matches;
  std::uint64_t samples = 0;
  for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
    bands.push_back(sampler.sample(b));
    matches.emplace_back(context, bands.back().capacity);
    matches.back().count = bands.back().sample_count;
    samples += bands.back().sample_count;
  }
  UvRaster raster(high, size, size, 1);
  NormalDetail detail(context, surface, high.attributes, options);
  const cl::Array<float> image(context, std::size_t{3} * size * size);
  const cl::Array<std::uint8_t> coverage(context, std::size_t{size} * size);
  const auto for_bands = [&](const auto& body) {
    for (std::size_t b = 0; b < bands.size(); ++b) body(bands[b], matches[b]);
    context.finish();
  };
  const auto match = [&](const TexelBand& band, DeviceCorrespondence& found) {
    raster.match(band, found, false);
  };
  const auto distance = [&](const TexelBand& band, DeviceCorrespondence& found) {
    raster.distance(band, found);
  };
  const auto read = [&](const TexelBand& band, DeviceCorrespondence& found) {
    detail.run(band, found, image, coverage);
  };
  // Matches all samples before the timing.
  for_bands(match);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const std::vector<std::uint8_t> status = matches[b].status.download(context);
    for (std::uint32_t i = 0; i < matches[b].count; ++i) {
      if (status[i] == KILN_STATUS_UV) continue;
      std::fprintf(stderr, "uv_bench: a sample was not matched\n");
      std::exit(1);
    }
  }
  std::vector<Mode> modes;
  modes.push_back({"cover and match", false, [&] { for_bands(match); }});
  modes.push_back({"distance", false, [&] { for_bands(distance); }});
  modes.push_back({"detail", false, [&] { for_bands(read); }});
  modes.push_back({"cover, match and detail", false, [&] {
                     for (std::size_t b = 0; b < bands.size(); ++b) {
                       match(bands[b], matches[b]);
                       read(bands[b], matches[b]);
                     }
                     context.finish();
                   }});
  run_rounds(modes, 5);
  for (const Mode& mode : modes) {
    JsonLine line;
    line.add("bench", "uv kernels").add("mode", mode.name).add("size", size);
    line.add("triangles", static_cast<double>(dense.triangles.size()));
    line.add("samples", static_cast<double>(samples));
    line.add("milliseconds", 1e3 * mode.median()).add("best_milliseconds", 1e3 * mode.least());
    line.add("cpu_milliseconds", 1e3 * Mode::median_of(mode.cpu_seconds));
    describe(line, device.info());
    line.print();
  }
}

/// Times re-bakes of a mesh whose vertices move: all of them, or a twentieth.
void bench_session(const Device& device, std::uint32_t cells, std::uint32_t size,
                   MatchMethod method, const char* name) {
  const BakeOptions options = options_of(size, method);
  SessionOptions session_options;
  session_options.bounds = Bounds{{0, 0, -0.01}, {1, 1, 0.01}};
  std::vector<Mesh> frames;
  for (int i = 0; i < 4; ++i) frames.push_back(wave(cells, 0.3 * i));
  BakeSession session(device, frames[0], light(), options, session_options);
  session.bake();
  const auto vertices = static_cast<std::uint32_t>(frames[0].positions.size());
  std::size_t frame = 0;
  const auto move = [&](std::uint32_t count) {
    frame = (frame + 1) % frames.size();
    const std::uint32_t first = (vertices - count) / 2;
    session.set_positions(first, std::span(frames[frame].positions).subspan(first, count));
    session.bake();
  };
  move(vertices);
  const BakeResult fresh = bake(
      Source(device, session.high(), RayTraversal::automatic, session.bounds()), light(), options);
  const std::vector<float>& ours = session.bake().maps[0].image.pixels;
  if (std::memcmp(ours.data(), fresh.maps[0].image.pixels.data(), ours.size() * sizeof(float)) !=
      0) {
    std::fprintf(stderr, "uv_bench: a re-bake differs from a new bake\n");
    std::exit(1);
  }
  std::vector<Mode> modes;
  modes.push_back({"all", false, [&] { move(vertices); }});
  modes.push_back({"5%", false, [&] { move(vertices / 20); }});
  modes.push_back({"fresh bake", false, [&] {
                     frame = (frame + 1) % frames.size();
                     bake(Source(device, frames[frame], RayTraversal::automatic, session.bounds()),
                          light(), options);
                   }});
  run_rounds(modes, 5);
  for (const Mode& mode : modes) {
    JsonLine line;
    line.add("bench", "uv session").add("match", name).add("mode", mode.name).add("size", size);
    line.add("triangles", static_cast<double>(frames[0].triangles.size()));
    line.add("milliseconds", 1e3 * mode.median()).add("best_milliseconds", 1e3 * mode.least());
    line.add("cpu_milliseconds", 1e3 * Mode::median_of(mode.cpu_seconds));
    describe(line, device.info());
    line.print();
  }
  const auto stages = [&](const char* what, std::uint32_t count) {
    move(count);
    const BakeSession::Update& update = session.last_update();
    JsonLine line;
    line.add("bench", "uv session stages").add("match", name).add("mode", what).add("size", size);
    line.add("texels", static_cast<double>(update.texels));
    line.add("source_ms", 1e3 * update.seconds_source).add("match_ms", 1e3 * update.seconds_match);
    line.add("detail_ms", 1e3 * update.seconds_detail).add("image_ms", 1e3 * update.seconds_image);
    line.print();
  };
  stages("all", vertices);
  stages("5%", vertices / 20);
}

int run(int count, char** arguments) {
  const auto cells = static_cast<std::uint32_t>(count > 1 ? std::atoi(arguments[1]) : 176);
  std::vector<std::uint32_t> sizes;
  for (int i = 2; i < count; ++i)
    sizes.push_back(static_cast<std::uint32_t>(std::atoi(arguments[i])));
  if (sizes.empty()) sizes = {512, 1024};
  const Device device = Device::open();
  for (const std::uint32_t size : sizes) {
    bench_kernels(device, wave(cells, 0), size);
    bench_session(device, cells, size, MatchMethod::uv, "uv");
    bench_session(device, cells, size, MatchMethod::ray, "ray");
  }
  return 0;
}

}  // namespace
}  // namespace kiln::bench

int main(int count, char** arguments) {
  try {
    return kiln::bench::run(count, arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "uv_bench: %s\n", error.what());
    return 1;
  }
}
