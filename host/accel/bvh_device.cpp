#include "accel/bvh_device.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "accel/bvh_range.h"
#include "base/memory.h"
#include "base/stopwatch.h"
#include "kiln/error.h"
#include "mesh/usable.h"
#include "shared/bvh_build.h"

namespace kiln::bvh {
namespace {

static_assert(sizeof(Vec3) == 12 && sizeof(Triangle) == 12);

// If an iteration of the clustering merges fewer clusters than this share, the next one merges all neighbours by twos.
// Scans lose 30 to 40% of the clusters in an iteration; nested boxes may lose a single one.
constexpr double kMinMergedShare = 1.0 / 32;

constexpr std::size_t runs_of(std::size_t count) {
  return (count + KILN_BVH_RUN - 1) / KILN_BVH_RUN;
}

/// Number of elements of all levels of a scan or a sum.
constexpr std::size_t elements_of_levels(std::size_t count) {
  std::size_t all = count;
  do {
    count = runs_of(count);
    all += count;
  } while (count > 1);
  return all;
}

class DeviceBuilder {
 public:
  DeviceBuilder(cl::Context& context, std::span<const Vec3> positions,
                std::span<const Triangle> triangles)
      : context_(context), host_positions_(positions), host_triangles_(triangles) {}

  std::optional<DeviceParts> build(const DeviceLimits& limits) {
    if (host_triangles_.empty() || host_positions_.empty() || !fits(limits.bytes))
      return std::nullopt;
    DeviceParts parts;
    const Stopwatch watch;
    count_ = static_cast<std::uint32_t>(host_triangles_.size());
    positions_ = cl::Array<Vec3>(context_, host_positions_);
    triangles_ = cl::Array<Triangle>(context_, host_triangles_);
    parts.upload_seconds = watch.total();

    const kiln_bvh_summary summary = classify();
    if (summary.usable == 0) return std::nullopt;
    sort_keys();
    make_leaves();
    parts.triangles = unique_;
    parts.skipped = count_ - summary.usable;
    parts.duplicates = summary.usable - unique_;
    merge_clusters();
    if (!collapse(limits, parts)) return std::nullopt;
    return parts;
  }

 private:
  template <typename... Args>
  void launch(const char* name, std::size_t items, const Args&... args) {
    context_.launch(context_.kernel("bvh", name), items, kLocal, args...);
  }
  template <typename T>
  T read(const cl::Array<T>& array, std::size_t at) {
    T value{};
    array.read(context_, std::span<T>(&value, 1), at);
    return value;
  }
  static std::uint32_t narrow(std::size_t value) { return static_cast<std::uint32_t>(value); }

  /// True if the build fits the device's memory. The largest buffers are the binary tree, and the leaves of trees with
  /// 2 triangles each.
  bool fits(std::uint64_t limit) const {
    constexpr std::uint64_t kBytesPerTriangle = 180, kLargestBufferBytesPerTriangle = 80;
    const std::uint64_t bytes =
        host_triangles_.size() * kBytesPerTriangle + host_positions_.size_bytes();
    const DeviceInfo& info = context_.info();
    if (host_triangles_.size() * kLargestBufferBytesPerTriangle > info.largest_buffer_bytes ||
        host_positions_.size_bytes() > info.largest_buffer_bytes || bytes > limit) {
      return false;
    }
    return info.is_gpu ? context_.device_bytes() + bytes <= info.memory_bytes / 10 * 9
                       : memory_fits(bytes);
  }

  kiln_bvh_summary summarize(bool is_resolved) {
    std::size_t count = runs_of(count_);
    cl::Array<kiln_bvh_summary> from(context_, count), to(context_, runs_of(count));
    launch("kiln_bvh_classify", count, count_, narrow(host_positions_.size()),
           std::uint32_t{is_resolved}, positions_, triangles_, classes_, from);
    while (count > 1) {
      launch("kiln_bvh_join_summaries", runs_of(count), narrow(count), from, to);
      std::swap(from, to);
      count = runs_of(count);
    }
    const kiln_bvh_summary summary = read(from, 0);
    summary_ = std::move(from);
    return summary;
  }

  /// Classifies all triangles. The host decides on those for which single precision does not suffice: few, such as
  /// slivers.
  kiln_bvh_summary classify() {
    classes_ = cl::Array<std::uint8_t>(context_, count_);
    const kiln_bvh_summary summary = summarize(/*is_resolved=*/false);
    if (summary.bad == 0 && summary.uncertain == 0) return summary;
    std::vector<std::uint8_t> classes = classes_.download(context_);
    if (summary.bad != 0) {
      const auto bad = std::find(classes.begin(), classes.end(), KILN_BVH_BAD_INDEX);
      throw_bad_index(static_cast<std::size_t>(bad - classes.begin()), host_positions_.size());
    }
    for (std::size_t i = 0; i < classes.size(); ++i) {
      if (classes[i] != KILN_BVH_UNCERTAIN) continue;
      classes[i] =
          has_area(host_positions_, host_triangles_[i]) ? KILN_BVH_USABLE : KILN_BVH_SKIPPED;
    }
    classes_.write(context_, classes);
    return summarize(/*is_resolved=*/true);
  }

  /// Replaces each of the first `count` numbers by the sum of those before it, and writes the total behind them.
  void scan(std::size_t count) {
    struct Level {
      std::size_t first = 0, count = 0;
    };
    std::vector<Level> levels{{0, count}};
    do {
      const Level from = levels.back();
      const Level to{from.first + from.count, runs_of(from.count)};
      launch("kiln_bvh_scan_up", to.count, narrow(from.count), narrow(from.first), narrow(to.first),
             numbers_);
      levels.push_back(to);
    } while (levels.back().count > 1);
    total_at_ = levels.back().first;
    for (std::size_t i = levels.size() - 1; i-- > 0;) {
      const bool is_top = i + 2 == levels.size();
      launch("kiln_bvh_scan_down", runs_of(levels[i].count), narrow(levels[i].count),
             narrow(levels[i].first), narrow(levels[i + 1].first), std::uint32_t{is_top}, numbers_);
    }
  }
  std::uint32_t read_total() { return read(numbers_, total_at_); }

  void sort_keys() {
    const std::size_t runs = runs_of(count_);
    numbers_ = cl::Array<std::uint32_t>(
        context_, elements_of_levels(std::max<std::size_t>(runs * KILN_BVH_DIGITS, count_)));
    keys_ = cl::Array<std::uint64_t>(context_, count_);
    indices_ = cl::Array<std::uint32_t>(context_, count_);
    cl::Array<std::uint64_t> other_keys(context_, count_);
    cl::Array<std::uint32_t> other_indices(context_, count_);
    launch("kiln_bvh_make_keys", count_, count_, summary_, positions_, triangles_, classes_, keys_,
           indices_);
    for (std::uint32_t shift = 0; shift < KILN_BVH_KEY_BITS; shift += KILN_BVH_DIGIT_BITS) {
      launch("kiln_bvh_count_digits", runs, count_, narrow(runs), shift, keys_, numbers_);
      scan(runs * KILN_BVH_DIGITS);
      launch("kiln_bvh_move_keys", runs, count_, narrow(runs), shift, numbers_, keys_, indices_,
             other_keys, other_indices);
      std::swap(keys_, other_keys);
      std::swap(indices_, other_indices);
    }
  }

  void make_leaves() {
    launch("kiln_bvh_mark_unique", count_, count_, positions_, triangles_, keys_, indices_,
           numbers_);
    scan(count_);
    unique_ = read_total();
    branches_ = cl::Array<kiln_bvh_branch>(context_, 2 * std::size_t{unique_} - 1);
    sizes_ = cl::Array<std::uint32_t>(context_, branches_.size());
    clusters_ = cl::Array<std::uint32_t>(context_, unique_);
    launch("kiln_bvh_make_leaves", count_, count_, unique_, positions_, triangles_, indices_,
           numbers_, branches_, sizes_, clusters_);
    keys_ = {};
    indices_ = {};
    classes_ = {};
  }

  /// Merges clusters until one is left, the last branch.
  void merge_clusters() {
    cl::Array<std::uint32_t> merged(context_, unique_), partners(context_, unique_);
    std::uint32_t next = unique_;
    bool merges_by_twos = false;
    for (std::uint32_t count = unique_; count > 1;) {
      if (merges_by_twos) {
        launch("kiln_bvh_pair_neighbours", count, count, partners);
      } else {
        launch("kiln_bvh_find_partners", count, count, clusters_, branches_, partners);
      }
      launch("kiln_bvh_mark_pairs", count, count, partners, numbers_);
      scan(count);
      const std::uint32_t ended = read_total();
      launch("kiln_bvh_merge_pairs", count, count, next, partners, numbers_, clusters_, merged,
             branches_, sizes_);
      std::swap(clusters_, merged);
      merges_by_twos = ended < kMinMergedShare * count;
      count -= ended;
      next += ended;
    }
    clusters_ = {};
  }

  /// Collapses the binary tree. \returns false if it would be too deep, or needs bounding prisms
  bool collapse(const DeviceLimits& limits, DeviceParts& parts) {
    // A node has 5 triangles or more. It has 8 children if one of them is a node: so two in five triangles is an upper
    // bound of the number of nodes.
    cl::Array<std::uint32_t> roots(context_, std::size_t{unique_} / 5 * 2 + 3);
    cl::Array<std::uint32_t> starts(context_, 2 * roots.size());
    cl::Array<std::uint32_t> leaf_roots(context_, unique_);
    const std::uint32_t root = narrow(branches_.size() - 1);
    roots.write(context_, std::span(&root, 1));
    std::uint32_t first = 0, node_count = 1, block_count = 0;
    for (; first < node_count; ++parts.depth) {
      if (parts.depth == limits.depth) return false;
      const std::uint32_t count = node_count - first;
      launch("kiln_bvh_count_children", count, count, first, roots, branches_, sizes_, numbers_);
      scan(2 * std::size_t{count});
      const std::uint32_t children = read_total();
      const std::uint32_t nodes = read(numbers_, count);
      launch("kiln_bvh_place_children", count, count, first, node_count, block_count, numbers_,
             roots, leaf_roots, starts, branches_, sizes_);
      first = node_count;
      node_count += nodes;
      block_count += children - nodes;
    }
    parts.blocks = cl::Array<kiln_bvh_block>(context_, block_count);
    cl::Array<float> areas(context_, elements_of_levels(block_count));
    launch("kiln_bvh_write_blocks", block_count, block_count, leaf_roots, branches_, positions_,
           triangles_, parts.blocks, areas);
    parts.leaves_per_line = sum(areas, block_count) / root_area();
    if (!(parts.leaves_per_line <= limits.leaves_per_line)) return false;
    parts.nodes = cl::Array<kiln_bvh_node>(context_, node_count);
    launch("kiln_bvh_write_nodes", node_count, node_count, roots, starts, branches_, sizes_,
           parts.nodes);
    return true;
  }

  double sum(cl::Array<float>& areas, std::size_t count) {
    std::size_t first = 0;
    do {
      launch("kiln_bvh_sum_areas", runs_of(count), narrow(count), narrow(first),
             narrow(first + count), areas);
      first += count;
      count = runs_of(count);
    } while (count > 1);
    return double{read(areas, first)};
  }

  double root_area() {
    const kiln_bvh_branch root = read(branches_, branches_.size() - 1);
    Box box;
    box.lo = Float4{root.lo[0], root.lo[1], root.lo[2], 0};
    box.hi = Float4{root.hi[0], root.hi[1], root.hi[2], 0};
    return double{box.half_area()};
  }

  cl::Context& context_;
  std::span<const Vec3> host_positions_;
  std::span<const Triangle> host_triangles_;
  std::uint32_t count_ = 0;   ///< Triangles given
  std::uint32_t unique_ = 0;  ///< Triangles in the tree
  cl::Array<Vec3> positions_;
  cl::Array<Triangle> triangles_;
  cl::Array<std::uint8_t> classes_;
  cl::Array<kiln_bvh_summary> summary_;
  cl::Array<std::uint64_t> keys_;
  cl::Array<std::uint32_t> indices_;
  /// Numbers that are scanned, and the levels of the scan: a counter per run and digit, a mark per triangle or cluster,
  /// or two counters per node of a level
  cl::Array<std::uint32_t> numbers_;
  std::size_t total_at_ = 0;  ///< Index of the last scan's total in numbers_
  cl::Array<kiln_bvh_branch> branches_;
  cl::Array<std::uint32_t> sizes_;  ///< Triangles below each branch
  cl::Array<std::uint32_t> clusters_;
};

}  // namespace

std::optional<DeviceParts> build_on_device(cl::Context& context, std::span<const Vec3> positions,
                                           std::span<const Triangle> triangles,
                                           const DeviceLimits& limits) {
  require_supported_count(triangles.size());
  return DeviceBuilder(context, positions, triangles).build(limits);
}

}  // namespace kiln::bvh
