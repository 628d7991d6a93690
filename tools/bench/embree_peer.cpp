#include "embree_peer.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <ctime>
#include <memory>

#include "base/parallel.h"
#include "embree_threads.h"
#include "shared/common.h"

namespace kiln::bench {
namespace {

constexpr std::size_t kStreamRays = 512;

struct Source {
  const RayPlanes& rays;
  float origin(std::size_t i, std::size_t axis) const {
    return rays.planes[axis * rays.capacity + i] +
           rays.offset * rays.planes[(3 + axis) * rays.capacity + i];
  }
  float direction(std::size_t i, std::size_t axis) const {
    return rays.sign * rays.planes[(3 + axis) * rays.capacity + i];
  }
};

template <typename Ray>
void fill_packet(const Source& source, std::size_t lane, std::size_t i, Ray& ray) {
  ray.org_x[lane] = source.origin(i, 0);
  ray.org_y[lane] = source.origin(i, 1);
  ray.org_z[lane] = source.origin(i, 2);
  ray.dir_x[lane] = source.direction(i, 0);
  ray.dir_y[lane] = source.direction(i, 1);
  ray.dir_z[lane] = source.direction(i, 2);
  ray.tnear[lane] = source.rays.t_min;
  ray.tfar[lane] = source.rays.t_max;
  ray.time[lane] = 0;
  ray.mask[lane] = ~0U;
  ray.id[lane] = 0;
  ray.flags[lane] = 0;
}

void fill_one(const Source& source, std::size_t i, RTCRay& ray) {
  ray.org_x = source.origin(i, 0);
  ray.org_y = source.origin(i, 1);
  ray.org_z = source.origin(i, 2);
  ray.dir_x = source.direction(i, 0);
  ray.dir_y = source.direction(i, 1);
  ray.dir_z = source.direction(i, 2);
  ray.tnear = source.rays.t_min;
  ray.tfar = source.rays.t_max;
  ray.time = 0;
  ray.mask = ~0U;
  ray.id = 0;
  ray.flags = 0;
}

void store(RayResults& results, std::size_t i, unsigned geometry, unsigned triangle, float t,
           float u, float v) {
  const bool hit = geometry != RTC_INVALID_GEOMETRY_ID;
  results.triangle[i] = hit ? triangle : KILN_NO_TRIANGLE;
  results.t[i] = t;
  results.u[i] = u;
  results.v[i] = v;
}

template <int N, typename RayHit, typename Call>
void packets(const Source& source, std::size_t begin, std::size_t end, const Call& call,
             RayResults& results) {
  for (std::size_t first = begin; first < end; first += N) {
    alignas(64) RayHit packet;
    alignas(64) int valid[N];
    for (std::size_t lane = 0; lane < N; ++lane) {
      const bool used = first + lane < end;
      valid[lane] = used ? -1 : 0;
      fill_packet(source, lane, used ? first + lane : first, packet.ray);
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    call(valid, &packet);
    for (std::size_t lane = 0; lane < N && first + lane < end; ++lane) {
      store(results, first + lane, packet.hit.geomID[lane], packet.hit.primID[lane],
            packet.ray.tfar[lane], packet.hit.u[lane], packet.hit.v[lane]);
    }
  }
}

template <int N, typename Ray, typename Call>
void occlusion_packets(const Source& source, std::size_t begin, std::size_t end, const Call& call,
                       std::vector<std::uint8_t>& hit) {
  for (std::size_t first = begin; first < end; first += N) {
    alignas(64) Ray packet;
    alignas(64) int valid[N];
    for (std::size_t lane = 0; lane < N; ++lane) {
      const bool used = first + lane < end;
      valid[lane] = used ? -1 : 0;
      fill_packet(source, lane, used ? first + lane : first, packet);
    }
    call(valid, &packet);
    for (std::size_t lane = 0; lane < N && first + lane < end; ++lane) {
      hit[first + lane] = packet.tfar[lane] < 0 ? 1 : 0;
    }
  }
}

/// Memory of a stream of rays in structure-of-arrays layout.
struct Arrays {
  float values[13][kStreamRays];
  unsigned ids[6][kStreamRays];

  RTCRayNp rays() {
    RTCRayNp np;
    std::memset(&np, 0, sizeof(np));
    np.org_x = values[0], np.org_y = values[1], np.org_z = values[2], np.tnear = values[3];
    np.dir_x = values[4], np.dir_y = values[5], np.dir_z = values[6], np.time = values[7];
    np.tfar = values[8], np.mask = ids[0], np.id = ids[1], np.flags = ids[2];
    return np;
  }
  void fill(const Source& source, std::size_t first, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        values[axis][k] = source.origin(first + k, axis);
        values[4 + axis][k] = source.direction(first + k, axis);
      }
      values[3][k] = source.rays.t_min;
      values[7][k] = 0;
      values[8][k] = source.rays.t_max;
      ids[0][k] = ~0U;
      ids[1][k] = ids[2][k] = 0;
      ids[3][k] = ids[5][k] = RTC_INVALID_GEOMETRY_ID;
    }
  }
};

RTCIntersectContext context_of(const RayPlanes& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      rays.coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

}  // namespace

const char* embree_mode_name(EmbreeMode mode) {
  switch (mode) {
    case EmbreeMode::single_ray:
      return "embree 1";
    case EmbreeMode::packet8:
      return "embree 8";
    case EmbreeMode::packet16:
      return "embree 16";
    case EmbreeMode::stream_1m:
      return "embree stream 1M";
    case EmbreeMode::stream_np:
      return "embree stream Np";
  }
  return "";
}

EmbreeScene::EmbreeScene(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                         bool robust) {
  device_ = rtcNewDevice(("threads=" + std::to_string(thread_count())).c_str());
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Vec3), positions.size());
  std::memcpy(vertices, positions.data(), positions.size_bytes());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          sizeof(Triangle), triangles.size());
  std::memcpy(indices, triangles.data(), triangles.size_bytes());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  corners_.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    corners_.push_back({positions[t[0]], positions[t[1]], positions[t[2]]});
  }
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  rtcCommitScene(scene_);
  build_cpu_seconds_ = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  build_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void EmbreeScene::intersect(const RayPlanes& rays, EmbreeMode mode, RayResults& results) const {
  results.triangle.resize(rays.count);
  results.t.resize(rays.count);
  results.u.resize(rays.count);
  results.v.resize(rays.count);
  const Source source{rays};
  on_threads(rays.count, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context = context_of(rays);
    switch (mode) {
      case EmbreeMode::single_ray:
        for (std::size_t i = begin; i < end; ++i) {
          alignas(16) RTCRayHit ray;
          fill_one(source, i, ray.ray);
          ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
          ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
          rtcIntersect1(scene_, &context, &ray);
          store(results, i, ray.hit.geomID, ray.hit.primID, ray.ray.tfar, ray.hit.u, ray.hit.v);
        }
        break;
      case EmbreeMode::packet8:
        packets<8, RTCRayHit8>(
            source, begin, end,
            [&](int* valid, RTCRayHit8* p) { rtcIntersect8(valid, scene_, &context, p); }, results);
        break;
      case EmbreeMode::packet16:
        packets<16, RTCRayHit16>(
            source, begin, end,
            [&](int* valid, RTCRayHit16* p) { rtcIntersect16(valid, scene_, &context, p); },
            results);
        break;
      case EmbreeMode::stream_1m: {
        std::vector<RTCRayHit> stream(kStreamRays);
        for (std::size_t first = begin; first < end; first += kStreamRays) {
          const std::size_t count = std::min(kStreamRays, end - first);
          for (std::size_t k = 0; k < count; ++k) {
            fill_one(source, first + k, stream[k].ray);
            stream[k].hit.geomID = RTC_INVALID_GEOMETRY_ID;
            stream[k].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
          }
          rtcIntersect1M(scene_, &context, stream.data(), static_cast<unsigned>(count),
                         sizeof(RTCRayHit));
          for (std::size_t k = 0; k < count; ++k) {
            const RTCRayHit& ray = stream[k];
            store(results, first + k, ray.hit.geomID, ray.hit.primID, ray.ray.tfar, ray.hit.u,
                  ray.hit.v);
          }
        }
        break;
      }
      case EmbreeMode::stream_np: {
        const auto memory = std::make_unique<Arrays>();
        Arrays& a = *memory;
        for (std::size_t first = begin; first < end; first += kStreamRays) {
          const std::size_t count = std::min(kStreamRays, end - first);
          a.fill(source, first, count);
          RTCRayHitNp np;
          std::memset(&np, 0, sizeof(np));
          np.ray = a.rays();
          // Embree writes a normal for each hit. These normals are not used, so all go to the same buffer.
          np.hit.Ng_x = np.hit.Ng_y = np.hit.Ng_z = a.values[9];
          np.hit.u = a.values[10], np.hit.v = a.values[11];
          np.hit.geomID = a.ids[3], np.hit.primID = a.ids[4], np.hit.instID[0] = a.ids[5];
          rtcIntersectNp(scene_, &context, &np, static_cast<unsigned>(count));
          for (std::size_t k = 0; k < count; ++k) {
            store(results, first + k, a.ids[3][k], a.ids[4][k], a.values[8][k], a.values[10][k],
                  a.values[11][k]);
          }
        }
        break;
      }
    }
  });
}

void EmbreeScene::occluded(const RayPlanes& rays, EmbreeMode mode,
                           std::vector<std::uint8_t>& hit) const {
  hit.resize(rays.count);
  const Source source{rays};
  on_threads(rays.count, [&](std::size_t begin, std::size_t end) {
    RTCIntersectContext context = context_of(rays);
    switch (mode) {
      case EmbreeMode::single_ray:
        for (std::size_t i = begin; i < end; ++i) {
          alignas(16) RTCRay ray;
          fill_one(source, i, ray);
          rtcOccluded1(scene_, &context, &ray);
          hit[i] = ray.tfar < 0 ? 1 : 0;
        }
        break;
      case EmbreeMode::packet8:
        occlusion_packets<8, RTCRay8>(
            source, begin, end,
            [&](int* valid, RTCRay8* p) { rtcOccluded8(valid, scene_, &context, p); }, hit);
        break;
      case EmbreeMode::packet16:
        occlusion_packets<16, RTCRay16>(
            source, begin, end,
            [&](int* valid, RTCRay16* p) { rtcOccluded16(valid, scene_, &context, p); }, hit);
        break;
      case EmbreeMode::stream_1m: {
        std::vector<RTCRay> stream(kStreamRays);
        for (std::size_t first = begin; first < end; first += kStreamRays) {
          const std::size_t count = std::min(kStreamRays, end - first);
          for (std::size_t k = 0; k < count; ++k) fill_one(source, first + k, stream[k]);
          rtcOccluded1M(scene_, &context, stream.data(), static_cast<unsigned>(count),
                        sizeof(RTCRay));
          for (std::size_t k = 0; k < count; ++k) hit[first + k] = stream[k].tfar < 0 ? 1 : 0;
        }
        break;
      }
      case EmbreeMode::stream_np: {
        const auto memory = std::make_unique<Arrays>();
        for (std::size_t first = begin; first < end; first += kStreamRays) {
          const std::size_t count = std::min(kStreamRays, end - first);
          memory->fill(source, first, count);
          const RTCRayNp np = memory->rays();
          rtcOccludedNp(scene_, &context, &np, static_cast<unsigned>(count));
          for (std::size_t k = 0; k < count; ++k) {
            hit[first + k] = memory->values[8][k] < 0 ? 1 : 0;
          }
        }
        break;
      }
    }
  });
}

}  // namespace kiln::bench
