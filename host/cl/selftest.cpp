// The host's part of the self-test of a device; the device's part is kernels/cl/selftest.cl.
#include "cl/selftest.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <mutex>

#include "base/fused.h"
#include "cl/binary_cache.h"
#include "cl/embedded.h"
#include "shared/bvh.h"
#include "shared/ray.h"
#include "shared/selftest.h"

namespace kiln::ocl {
namespace {

using ResultWords = std::vector<std::uint32_t>;
constexpr std::uint32_t kWorkItems = KILN_SELFTEST_ITEMS, kAtomicCells = KILN_SELFTEST_CELLS;
// Numbers of samples per work-item of kiln_ray_closest_beam, and of rays in the first launch, whose last work-item has
// too few rays for a beam or a stream.
constexpr std::uint32_t kRaysPerBeam = 64, kRaysInFirstLaunch = kWorkItems / 2 + 40;
// The local size that bakes use for streams, so that they need not compile the kernel again.
constexpr std::size_t kStreamLocal = 16;

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

/// Makes inputs of all magnitudes, and of edge cases: halves, zero, extreme values.
kiln_selftest_input make_input() {
  kiln_selftest_input in{};
  std::uint32_t random_state = 1;
  const auto next = [&] {  // the high bits of a linear congruential generator (Knuth)
    random_state = random_state * 1664525U + 1013904223U;
    return static_cast<std::int32_t>(std::rotl(random_state, 16));
  };
  for (std::uint32_t i = 0; i < kWorkItems; ++i) {
    in.p[i] = i % 16 == 3 ? 0 : i % 16 == 5 ? INT32_MIN : i % 16 == 7 ? INT32_MAX : next();
    in.q[i] = next() >> i % 24;
    in.a[i] = static_cast<float>(next()) * 0x1p-28F;
    in.b[i] =
        i % 4 == 0 ? static_cast<float>(i % 29) - 13.5F : static_cast<float>(next() | 1) * 0x1p-28F;
    in.c[i] = static_cast<float>(next()) * 0x1p-29F;
  }
  return in;
}

/// Computes the results of the operations on an input, as the kernel does.
std::array<std::uint32_t, KILN_SELFTEST_OPERATIONS> compute_operations(
    const kiln_selftest_input& in, std::uint32_t i) {
  const std::int32_t p = in.p[i], q = in.q[i];
  const float a = in.a[i], b = in.b[i], c = in.c[i];
  const auto u = static_cast<std::uint32_t>(p), v = static_cast<std::uint32_t>(q);
  const std::uint32_t shift_bits = v & 31U;
  std::array<std::uint32_t, KILN_SELFTEST_OPERATIONS> result_words{};
  result_words[KILN_SELFTEST_SUMS] = bits_of((a * b + c) - b * c);
  result_words[KILN_SELFTEST_FMA] = bits_of(fused_multiply_add(a, b, c));
  result_words[KILN_SELFTEST_DIVISION] = bits_of(a / b - std::sqrt(std::fabs(c)));
  const float clamped = std::clamp(std::max(std::min(a, b), c), -1.5F, 3.25F);
  result_words[KILN_SELFTEST_ROUNDING] =
      bits_of(std::copysign(std::floor(a) + std::fabs(std::rint(b)) + clamped, c));
  result_words[KILN_SELFTEST_SELECT] = bits_of(a < c && p != q ? c : p < q ? b : a);
  const float large = static_cast<float>(p) + static_cast<float>(u);
  result_words[KILN_SELFTEST_CONVERT] =
      (static_cast<std::uint32_t>(static_cast<std::int32_t>(a * 1000.0F)) +
       static_cast<std::uint32_t>(p >> 16) + (u >> 24U)) ^
      bits_of(large);
  const int counts = std::countl_zero(u >> shift_bits) + (std::popcount(u) << 8);
  result_words[KILN_SELFTEST_INTEGER] = ((u * v + (u << shift_bits)) ^ (v >> shift_bits)) +
                                        static_cast<std::uint32_t>(std::min(p, q) >> shift_bits) +
                                        static_cast<std::uint32_t>(counts);
  const std::int64_t wide = std::int64_t{p} * q - std::int64_t{q} * (1 << 20);
  const auto high = static_cast<std::uint32_t>(wide >> 32);
  result_words[KILN_SELFTEST_LONG] =
      ((static_cast<std::uint32_t>(wide) & 0x7FFFFFFFU) ^ high) + (wide >= 0 ? v : u);
  return result_words;
}

/// Test scene: squares over [k/8, (k+1)/8] x [0, 1] at eight heights, and as many below them. Each square is two
/// triangles; squares above each other form a leaf. The last four leaves have an inner node of their own. All
/// coordinates and intermediate results of a ray have few bits, so results are exact in any order of operations.
struct Scene {
  static float square_height(int k, int level) {
    return static_cast<float>(k * 5 % 8) / 16 - static_cast<float>(level) / 32;
  }
  std::array<kiln_bvh_node, 2> nodes{};
  std::array<kiln_bvh_block, 8> blocks{};
  std::vector<float> points = std::vector<float>(std::size_t{6} * kWorkItems);

  Scene() {
    for (kiln_bvh_node& node : nodes) {
      for (auto& axis : node.planes) {
        std::fill(std::begin(axis[0]), std::end(axis[0]), INFINITY);
        std::fill(std::begin(axis[1]), std::end(axis[1]), -INFINITY);
      }
      std::fill(std::begin(node.child), std::end(node.child), KILN_BVH_LEAF);
    }
    const auto bound = [&](int node, int child, float lo_x, float hi_x, float lo_z, float hi_z) {
      const float lo[3] = {lo_x, 0, lo_z}, hi[3] = {hi_x, 1, hi_z};
      for (int axis = 0; axis < 3; ++axis) {
        nodes[node].planes[axis][0][child] = lo[axis] - KILN_BVH_EPSILON;
        nodes[node].planes[axis][1][child] = hi[axis] + KILN_BVH_EPSILON;
      }
    };
    for (int k = 0; k < 8; ++k) {
      const float left = static_cast<float>(k) / 8, right = left + 0.125F;
      for (int lane = 0; lane < 4; ++lane) {
        const float z = square_height(k, lane / 2);
        const float corners[4][3] = {{left, 0, z}, {right, 0, z}, {right, 1, z}, {left, 1, z}};
        for (int corner = 0; corner < 3; ++corner) {
          const int from = corner == 0 ? 0 : corner + lane % 2;
          for (int axis = 0; axis < 3; ++axis)
            blocks[k].corner[corner][axis][lane] = corners[from][axis];
        }
        blocks[k].triangle[lane] = static_cast<std::uint32_t>(k * 4 + lane);
      }
      bound(k / 4, k % 4, left, right, square_height(k, 1), square_height(k, 0));
      nodes[k / 4].child[k % 4] = KILN_BVH_LEAF | static_cast<std::uint32_t>(k);
    }
    bound(0, 4, 0.5F, 1, -0.5F, 0.5F);
    nodes[0].child[4] = 1;
    for (std::uint32_t i = 0; i < kWorkItems; ++i) {
      const auto ray = ray_of(i);
      for (std::uint32_t k = 0; k < 6; ++k) points[k * kWorkItems + i] = ray[k];
    }
  }

  /// Oblique rays downwards from height 1 that hit neither edges nor diagonals.
  static std::array<float, 6> ray_of(std::uint32_t i) {
    return {static_cast<float>(i % 32) / 32 + 0x1p-7F,
            static_cast<float>(i / 32) / 32 + 0x1p-9F,
            1,
            i % 2 == 0 ? 0.25F : -0.25F,
            i % 3 == 0 ? 0.125F : -0.125F,
            -1};
  }

  /// Expected hit: triangle, t, and weights of its second and third corner.
  static std::array<std::uint32_t, 4> hit_of(std::uint32_t i) {
    const auto ray = ray_of(i);
    float nearest = 4;
    std::array<std::uint32_t, 4> hit{KILN_NO_TRIANGLE, 0, 0, 0};
    for (std::uint32_t square = 0; square < 16; ++square) {
      const auto k = static_cast<int>(square / 2);
      const float t = 1 - square_height(k, static_cast<int>(square % 2));
      const float s = (ray[0] + t * ray[3]) * 8 - static_cast<float>(k);
      const float r = ray[1] + t * ray[4];
      if (t >= nearest || s < 0 || s > 1 || r < 0 || r > 1) continue;
      nearest = t;
      hit = r > s ? std::array{square * 2 + 1, bits_of(t), bits_of(s), bits_of(r - s)}
                  : std::array{square * 2, bits_of(t), bits_of(s - r), bits_of(r)};
    }
    return hit;
  }
};

ResultWords expected_results(bool atomics_64) {
  const kiln_selftest_input in = make_input();
  ResultWords all(std::size_t{KILN_SELFTEST_RESULTS} * kWorkItems);
  const auto at = [&](std::uint32_t result, std::uint32_t item) -> std::uint32_t& {
    return all[result * kWorkItems + item];
  };
  const auto is_less = [&](std::uint32_t first, std::uint32_t count) {
    std::uint32_t bits = 0;
    for (std::uint32_t k = 0; k < count; ++k)
      bits |= in.a[first + k] < in.b[first + k] ? 1U << k : 0U;
    return bits;
  };
  std::array<std::uint64_t, kAtomicCells> smallest_values;
  smallest_values.fill(~std::uint64_t{0});
  for (std::uint32_t i = 0; i < kWorkItems; ++i) {
    const auto words = compute_operations(in, i);
    for (std::uint32_t r = 0; r < KILN_SELFTEST_MASKS; ++r) at(r, i) = words[r % words.size()];
    const std::uint32_t half = is_less(i / 8 * 8, 8);
    at(KILN_SELFTEST_MASKS, i) =
        is_less(i / 16 * 16, 16) | half << 16U | (half & 15U) << 24U | (half != 0 ? 1U << 31U : 0U);
    const auto hit = Scene::hit_of(i);
    for (std::uint32_t k = 0; k < hit.size(); ++k) at(KILN_SELFTEST_RAY + k, i) = hit[k];
    const auto value = static_cast<std::uint32_t>(in.p[i]);
    std::uint64_t& cell = smallest_values[i % kAtomicCells];
    cell = std::min(cell, std::uint64_t{value} << 32U | i);
    std::uint32_t& most = at(KILN_SELFTEST_ATOMICS, kAtomicCells + i % kAtomicCells);
    most = std::max(most, value);
    ++at(KILN_SELFTEST_ATOMICS, 2 * kAtomicCells + i % kAtomicCells);
  }
  for (std::uint32_t c = 0; c < kAtomicCells; ++c) {
    at(KILN_SELFTEST_ATOMICS, c) = static_cast<std::uint32_t>(smallest_values[c] >> 32U);
    const std::uint64_t kept = atomics_64 ? smallest_values[c] : ~std::uint64_t{0};
    at(KILN_SELFTEST_ATOMICS, 3 * kAtomicCells + c) = static_cast<std::uint32_t>(kept >> 32U);
    at(KILN_SELFTEST_ATOMICS, 4 * kAtomicCells + c) = static_cast<std::uint32_t>(kept);
  }
  return all;
}

std::string name_of(std::uint32_t result) {
  constexpr std::array kOperationNames = {
      "float products and sums",  "fused multiply-add",
      "division and square root", "float minimum, maximum and rounding",
      "comparisons and selects",  "conversions",
      "32-bit integers",          "64-bit integers"};
  constexpr std::array kVectorWidths = {"scalars", "vectors of 4", "vectors of 8", "vectors of 16"};
  if (result < KILN_SELFTEST_MASKS) {
    return std::string(kOperationNames.at(result % KILN_SELFTEST_OPERATIONS)) + " of " +
           kVectorWidths.at(result / KILN_SELFTEST_OPERATIONS);
  }
  return result == KILN_SELFTEST_MASKS     ? "masks of vectors"
         : result == KILN_SELFTEST_ATOMICS ? "atomic operations"
                                           : "rays";
}

/// True if a result depends on division or square root, whose bits may differ on devices without correct rounding.
bool needs_division(std::uint32_t result) {
  if (result < KILN_SELFTEST_MASKS) {
    return result % KILN_SELFTEST_OPERATIONS == KILN_SELFTEST_DIVISION;
  }
  return result > KILN_SELFTEST_RAY;
}

/// Names of the results in [first, end) that differ from the expected ones.
std::string describe_differences(const DeviceInfo& info, const ResultWords& expected,
                                 const ResultWords& results, std::uint32_t first,
                                 std::uint32_t end) {
  std::string text, last;
  for (std::uint32_t result = first; result < end; ++result) {
    const auto words = expected.begin() + result * kWorkItems;
    if (needs_division(result) && !info.has_correct_division) continue;
    if (std::equal(words, words + kWorkItems, results.begin() + result * kWorkItems)) continue;
    const std::string name = name_of(result);
    if (name != last) text += (text.empty() ? "" : ", ") + name;
    last = name;
  }
  return text;
}

}  // namespace

std::string selftest_fault(Context& context, const std::string& extra_options) {
  const DeviceInfo& info = context.info();
  const std::string extra = extra_options.empty() ? "" : " " + extra_options;
  const ResultWords expected = expected_results(info.has_atomics_64);
  const kiln_selftest_input in = make_input();
  const Array<kiln_selftest_input> input(context, std::span(&in, 1));
  const Array<std::uint32_t> results(context, std::size_t{KILN_SELFTEST_ATOMICS} * kWorkItems);
  ResultWords start(std::size_t{3} * kAtomicCells, 0);
  std::fill_n(start.begin(), kAtomicCells, ~0U);
  const Array<std::uint32_t> cell_values(context, start);
  const Array<std::uint64_t> least_indices(context, std::vector(kAtomicCells, ~std::uint64_t{0}));
  context.launch(context.kernel("selftest", "kiln_selftest_operate",
                                (info.has_atomics_64 ? "-DKILN_SELFTEST_ATOMIC64=1" : "") + extra),
                 kWorkItems, kLocal, input, cell_values, least_indices, results);
  ResultWords all = results.download(context);
  for (const std::uint32_t word : cell_values.download(context)) all.push_back(word);
  const std::vector<std::uint64_t> kept = least_indices.download(context);
  for (const std::uint64_t word : kept) all.push_back(static_cast<std::uint32_t>(word >> 32U));
  for (const std::uint64_t word : kept) all.push_back(static_cast<std::uint32_t>(word));
  all.resize(std::size_t{KILN_SELFTEST_RAY} * kWorkItems);
  // These results are checked before the next program is compiled, since a faulty device may crash in it.
  if (std::string text = describe_differences(info, expected, all, 0, KILN_SELFTEST_RAY);
      !text.empty()) {
    return text;
  }

  const Scene scene;
  kiln_ray_params params{};
  params.t_max = 4;
  params.flags = KILN_RAY_TWO_SIDED;
  params.capacity = params.result_capacity = kWorkItems;
  const Array<kiln_bvh_node> nodes(context, scene.nodes);
  const Array<kiln_bvh_block> blocks(context, scene.blocks);
  const Array<float> points(context, scene.points);
  const Array<std::uint32_t> triangle(context, kWorkItems);
  const Array<float> barycentric(context, std::size_t{2} * kWorkItems);
  const Array<float> distance(context, kWorkItems);
  const Array<std::uint8_t> status(context, kWorkItems);
  // The program and kernel that most bakes use on this kind of device, CPU or GPU (host/accel/ray.cpp). The kernels for
  // the other kind of device are not tested.
  const bool traces_streams = !info.is_gpu && is_pocl(info);
  const Kernel trace = context.kernel(traces_streams ? "ray_stream" : "ray",
                                      info.is_gpu      ? "kiln_ray_closest_scalar"
                                      : traces_streams ? "kiln_ray_closest_stream"
                                                       : "kiln_ray_closest_beam",
                                      std::string("-DKILN_BVH_PLAIN=1") +
                                          (info.is_gpu      ? " -DKILN_RAY_SCALAR=1"
                                           : traces_streams ? ""
                                                            : " -DKILN_RAY_SINGLE=1") +
                                          extra);
  const std::uint32_t rays_per_item = info.is_gpu      ? 1
                                      : traces_streams ? KILN_RAY_STREAM_BLOCK
                                                       : kRaysPerBeam;
  // In neither launch is the number of rays a multiple of rays_per_item, so that some rays are traced without a beam or
  // stream.
  for (const auto& [first, end] :
       {std::pair{0U, kRaysInFirstLaunch}, std::pair{kRaysInFirstLaunch, kWorkItems}}) {
    params.first = first;
    params.end = end;
    context.launch(trace, (end - first + rays_per_item - 1) / rays_per_item,
                   traces_streams ? kStreamLocal : kLocal, params, nodes, blocks, points, triangle,
                   barycentric, distance, status);
  }
  const auto append = [&](const std::vector<float>& values) {
    for (const float value : values) all.push_back(bits_of(value));
  };
  const ResultWords triangles = triangle.download(context);
  all.insert(all.end(), triangles.begin(), triangles.end());
  append(distance.download(context));
  append(barycentric.download(context));
  return describe_differences(info, expected, all, KILN_SELFTEST_RAY, KILN_SELFTEST_RESULTS);
}

void Context::require_correct_results() {
  static std::mutex mutex;
  static std::map<std::string, std::string>
      // stored per process, since the results of a faulty driver may change between calls
      fault_of_version;
  constexpr std::string_view kPassed = "self-test passed";
  const std::string source =
      std::string(embedded_source("selftest")) + std::string(embedded_source("ray"));
  const std::string version =
      info_.name + '\n' + info_.platform + '\n' + info_.driver + '\n' + info_.opencl_version;
  const std::lock_guard lock(mutex);
  auto known_fault = fault_of_version.find(version);
  if (known_fault == fault_of_version.end()) {
    std::string fault_text;
    if (!binaries_->find(source, kPassed)) {
      fault_text = selftest_fault(*this);
      if (fault_text.empty()) binaries_->store(source, kPassed, {1});
    }
    known_fault = fault_of_version.emplace(version, fault_text).first;
  }
  if (known_fault->second.empty()) return;
  throw Error(ErrorCode::device,
              info_.name + " (" + info_.platform + ", driver " + info_.driver +
                  ") gives wrong results, so maps would be wrong. It fails Kiln's self-test in: " +
                  known_fault->second + ". Use another device, or another version of its driver.",
              "self-test");
}

}  // namespace kiln::ocl
