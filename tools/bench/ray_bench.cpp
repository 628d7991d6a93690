// Times texel rays and occlusion rays, compared with Embree on the same rays and threads in the same run.
//
// ray_bench [HIGH LOW [SIZE [MODES]]]   default: a procedural pair, 2048. MODES: runs these alone, such as
// "kiln,embree 16". SIZE 0: occlusion rays only.
//
// The texel rays are those of a bake with `--cage 1.2444% --max-distance 2.4887%`: from outside inward,
// first hit. Embree cannot skip back faces by an option of the ray, so the compared query accepts faces of both
// sides; Kiln also runs with back faces skipped, as bakes do. Embree's scene has default flags (its fastest); its
// robust flag, whose guarantee is closer to Kiln's, is measured, too.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "accel/ray.h"
#include "embree_peer.h"
#include "kiln/error.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "shared/match.h"
#include "support.h"
#include "texel/texels.h"

namespace kiln::bench {
namespace {

/// A band of texel rays, on the device and in host memory.
struct Band {
  TexelBand device;
  std::vector<float> host;
  DeviceCorrespondence match;
  RayResults peer;
};

struct Agreement {
  double rays = 0, kiln_hits = 0, embree_hits = 0, only_kiln_hits = 0, only_embree_hits = 0;
  double other_depth = 0;
  double other_triangle = 0;
};

class RayBench {
 public:
  RayBench(const Mesh& high, const Mesh& low, std::uint32_t size, std::string only)
      : device_(Device::open()),
        frame_(Frame::of(high)),
        positions_(frame_.to_frame(high)),
        high_(high),
        only_(std::move(only)),
        size_(size),
        caster_(context_of(device_), positions_, high.triangles),
        scalar_(context_of(device_), positions_, high.triangles, Traversal::gpu),
        embree_(positions_, high.triangles, false),
        robust_(positions_, high.triangles, true) {
    if (size == 0) return;
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
      rays_ += band.device.sample_count;
      bands_.push_back(std::move(band));
    }
  }

  void texel_rays() {
    // Rays start 1.2444% of the diagonal outside and are 2.4887% long.
    const double diagonal = frame_.diagonal * frame_.scale;
    RayQuery query;
    query.offset = static_cast<float>(diagonal * 0.012444);
    query.t_max = static_cast<float>(diagonal * 0.024887);
    query.inward = true;
    query.two_sided = true;
    query.triangles_per_ray = static_cast<double>(high_.triangles.size()) / rays_;
    const Agreement agreement = compare(query);
    RayQuery one_sided = query;
    one_sided.two_sided = false;

    std::vector<Mode> modes;
    modes.push_back({"kiln", false, [&] { cast(caster_, query); }});
    modes.push_back({"kiln one-sided", false, [&] { cast(caster_, one_sided); }});
    modes.push_back({"kiln scalar", false, [&] { cast(scalar_, query); }});
    for (EmbreeMode mode : kEmbreeModes) {
      modes.push_back({embree_mode_name(mode), true, [this, &query, mode] {
                         for (Band& band : bands_) {
                           embree_.intersect(planes(band, query), mode, band.peer);
                         }
                       }});
    }
    // The robust mode does not count as a peer in the ratio, since it is slower by design.
    modes.push_back({"embree robust 8", false, [this, &query] {
                       for (Band& band : bands_) {
                         robust_.intersect(planes(band, query), EmbreeMode::packet8, band.peer);
                       }
                     }});
    keep_chosen(modes);
    run_rounds(modes, 5);
    print_modes("texel rays", high_.name, device_.info(), rays_, modes,
                {{"rays", rays_},
                 {"size", size_},
                 {"triangles", static_cast<double>(high_.triangles.size())},
                 {"only_ours", agreement.only_kiln_hits},
                 {"only_theirs", agreement.only_embree_hits},
                 {"other_depth", agreement.other_depth},
                 {"other_triangle", agreement.other_triangle}});
  }

  void occlusion_rays(std::size_t count) {
    // Occlusion rays start at points of the high poly, triangle by triangle, with cosine-distributed directions.
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<float> host(7 * count);
    for (std::size_t i = 0; i < count; ++i) {
      const Triangle& triangle = high_.triangles[i * high_.triangles.size() / count];
      const Vec3& a = positions_[triangle[0]];
      const Vec3& b = positions_[triangle[1]];
      const Vec3& c = positions_[triangle[2]];
      float normal[3] = {(b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y),
                         (b.z - a.z) * (c.x - a.x) - (b.x - a.x) * (c.z - a.z),
                         (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)};
      const float length =
          std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
      float u = uniform(random);
      float v = uniform(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const float p[3] = {a.x + u * (b.x - a.x) + v * (c.x - a.x),
                          a.y + u * (b.y - a.y) + v * (c.y - a.y),
                          a.z + u * (b.z - a.z) + v * (c.z - a.z)};
      // A random point of the unit sphere, added to the normal, gives the cosine distribution.
      const float z = 2 * uniform(random) - 1;
      const float phi = 6.2831853F * uniform(random);
      const float r = std::sqrt(std::max(0.0F, 1 - z * z));
      float d[3] = {r * std::cos(phi), r * std::sin(phi), z};
      float size = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        d[axis] += length > 0 ? normal[axis] / length : 0.0F;
        size += d[axis] * d[axis];
      }
      size = std::max(1e-3F, std::sqrt(size));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        host[axis * count + i] = p[axis];
        host[(3 + axis) * count + i] = d[axis] / size;
      }
    }
    cl::Context& context = context_of(device_);
    const cl::Array<float> points(context, std::span<const float>(host));
    const cl::Array<std::uint8_t> kiln_hit(context, count);
    const auto rays = static_cast<std::uint32_t>(count);
    RayQuery query;
    query.t_min = 1e-4F;
    query.t_max = 2;
    query.two_sided = true;
    const RayPlanes planes{host, count, count, 0, 1, query.t_min, query.t_max, false};
    std::vector<std::uint8_t> embree_hit;
    caster_.occluded(points, rays, rays, query, kiln_hit);
    embree_.occluded(planes, EmbreeMode::single_ray, embree_hit);
    const std::vector<std::uint8_t> hit = kiln_hit.download(context);
    double different = 0;
    double hits = 0;
    for (std::size_t i = 0; i < count; ++i) {
      different += hit[i] != embree_hit[i] ? 1 : 0;
      hits += hit[i];
    }
    std::vector<Mode> modes;
    modes.push_back({"kiln", false, [&] {
                       caster_.occluded(points, rays, rays, query, kiln_hit);
                       context.finish();
                     }});
    for (EmbreeMode mode : kEmbreeModes) {
      modes.push_back({embree_mode_name(mode), true, [this, &planes, &embree_hit, mode] {
                         embree_.occluded(planes, mode, embree_hit);
                       }});
    }
    keep_chosen(modes);
    run_rounds(modes, 5);
    print_modes("occlusion rays", high_.name, device_.info(), static_cast<double>(count), modes,
                {{"rays", static_cast<double>(count)},
                 {"triangles", static_cast<double>(high_.triangles.size())},
                 {"hits", hits},
                 {"different", different}});
  }

 private:
  void keep_chosen(std::vector<Mode>& modes) const {
    if (only_.empty()) return;
    const std::string list = "," + only_ + ",";
    std::erase_if(modes, [&](const Mode& mode) {
      return list.find("," + mode.name + ",") == std::string::npos;
    });
  }

  static RayPlanes planes(const Band& band, const RayQuery& query) {
    return {band.host,
            band.device.sample_count,
            band.device.capacity,
            query.offset,
            query.inward ? -1.0F : 1.0F,
            query.t_min,
            query.t_max,
            true};
  }

  void cast(const RayCaster& caster, const RayQuery& query) {
    for (Band& band : bands_) {
      caster.intersect(band.device.points, band.device.sample_count, band.device.capacity, query,
                       band.match);
    }
    context_of(device_).finish();
  }

  /// Compares Kiln's hits with those of rtcIntersect1, ray by ray.
  Agreement compare(const RayQuery& query) {
    cast(caster_, query);
    Agreement sum;
    for (Band& band : bands_) {
      embree_.intersect(planes(band, query), EmbreeMode::single_ray, band.peer);
      const std::vector<std::uint32_t> triangle = band.match.triangle.download(context_of(device_));
      const std::vector<float> distance = band.match.distance.download(context_of(device_));
      for (std::size_t i = 0; i < band.device.sample_count; ++i) {
        const bool kiln_hit = triangle[i] != KILN_NO_TRIANGLE;
        const bool embree_hit = band.peer.triangle[i] != KILN_NO_TRIANGLE;
        const float t = query.offset - distance[i];
        sum.kiln_hits += kiln_hit ? 1 : 0;
        sum.embree_hits += embree_hit ? 1 : 0;
        sum.only_kiln_hits += kiln_hit && !embree_hit ? 1 : 0;
        sum.only_embree_hits += embree_hit && !kiln_hit ? 1 : 0;
        if (kiln_hit && embree_hit) {
          sum.other_depth += std::abs(t - band.peer.t[i]) > 1e-5F ? 1 : 0;
          sum.other_triangle += triangle[i] != band.peer.triangle[i] ? 1 : 0;
        }
      }
    }
    return sum;
  }

  Device device_;
  Frame frame_;
  std::vector<Vec3> positions_;
  const Mesh& high_;
  std::string only_;
  std::uint32_t size_;
  RayCaster caster_;
  RayCaster scalar_;
  EmbreeScene embree_;
  EmbreeScene robust_;
  std::vector<Band> bands_;
  double rays_ = 0;
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
    bench::RayBench bench(high, low, static_cast<std::uint32_t>(size), argc >= 5 ? argv[4] : "");
    if (size != 0) bench.texel_rays();
    bench.occlusion_rays(1 << 21);
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
