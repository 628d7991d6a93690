// BVH: builds the tree of shared/bvh.h on the device.
//
// Purpose: on a GPU, the host's builder and the upload of its tree take longer than all rays of a bake.
//
// Algorithm, one phase after the other:
// 1. Triangles are classified, and the bounds of their centres are reduced.
// 2. Keys, Morton codes of centres (Morton 1966), are sorted by a stable radix sort of 4 bits a pass. Each work-item
//    counts the digits of a run of keys; a scan over all counters, digit by digit, gives the first place of each digit
//    of each run; each work-item then moves its keys in order.
// 3. Duplicates, which are neighbours now, are dropped: the triangle of the lowest index stays.
// 4. Clusters, at first single triangles, are merged bottom up by parallel locally-ordered clustering (Meister, Bittner
//    2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction"): each cluster searches
//    KILN_BVH_SEARCH_RADIUS neighbours on either side for the partner with the smallest common surface, and mutual
//    partners merge. A scan compacts the clusters. Pairs are strictly ordered by surface, distance of their places
//    (as exclusive or) and lower place, so that at least one pair merges; equal boxes merge by twos. Nested boxes can
//    still form long chains of one-sided choices: if few clusters merge, the host has all neighbours merge by twos next.
// 5. The binary tree is collapsed from the root, level by level: the child with the largest surface is replaced by its
//    two children until a node has 8 (as the host's builder does); subtrees of up to 4 triangles become leaves.
//
// Nothing depends on the order of work-items, so each run gives the same bytes. The tree differs from the host's.
//
// kernel                    one work-item                       memory traffic
// kiln_bvh_classify         KILN_BVH_RUN triangles              reads 48 B a triangle, writes 1 B
// kiln_bvh_join_summaries   KILN_BVH_RUN summaries              reads 48 B a summary
// kiln_bvh_make_keys        a triangle                          reads 49 B, writes 12 B
// kiln_bvh_count_digits     KILN_BVH_RUN keys                   reads 8 B a key, writes 64 B a run
// kiln_bvh_move_keys        KILN_BVH_RUN keys                   reads 12 B a key and 64 B a run, writes 12 B a key
// kiln_bvh_scan_up          KILN_BVH_RUN numbers                reads 4 B a number
// kiln_bvh_scan_down        KILN_BVH_RUN numbers                reads and writes 4 B a number
// kiln_bvh_mark_unique      a key                               reads 12 B, 72 B more at a key equal to the last
// kiln_bvh_make_leaves      a key                               reads 52 B, writes 40 B
// kiln_bvh_find_partners    a cluster                           reads 36 B for each of 16 neighbours
// kiln_bvh_pair_neighbours  a cluster                           4 B
// kiln_bvh_mark_pairs       a cluster                           reads 8 B, writes 4 B
// kiln_bvh_merge_pairs      a cluster                           reads 12 B, 64 B more if it merges; writes 4 or 40 B
// kiln_bvh_count_children   a node of 8 children                reads 0.4 kB
// kiln_bvh_place_children   a node of 8 children                reads 0.4 kB, writes 4 B a child
// kiln_bvh_write_nodes      a node of 8 children                reads 0.4 kB, writes 256 B
// kiln_bvh_write_blocks     a leaf                              reads 0.3 kB, writes 160 B
// kiln_bvh_sum_areas        KILN_BVH_RUN numbers                reads 4 B a number
//
// Local size 64; global sizes are padded. No defines. Strengths: no atomics, barriers or local memory, so it runs on
// any device. Limits: no bounding prisms, and a depth that depends on the input; where a tree needs prisms or is too
// deep, the host builds (host/accel/bvh_device.cpp).
#include "shared/bvh.h"
#include "shared/bvh_build.h"

typedef struct bvh_box {
  float lo[3];
  float hi[3];
} bvh_box;

/// Returns the bits of a coordinate, those of +0 for -0: so equal numbers have equal bits, whether or not the device
/// flushes denormals.
static inline uint bvh_get_bits(float value) {
  const uint bits = as_uint(value);
  return bits == 0x80000000u ? 0u : bits;
}

static inline bool bvh_is_finite(float value) {
  return (as_uint(value) & 0x7F800000u) != 0x7F800000u;
}

static inline size_t bvh_get_corner(global const uint* triangles, size_t triangle, int corner) {
  return 3 * (size_t)triangles[3 * triangle + corner];
}

static inline bool bvh_is_same_point(global const float* a, global const float* b) {
  return bvh_get_bits(a[0]) == bvh_get_bits(b[0]) && bvh_get_bits(a[1]) == bvh_get_bits(b[1]) &&
         bvh_get_bits(a[2]) == bvh_get_bits(b[2]);
}

static inline bvh_box bvh_compute_triangle_box(global const float* positions, global const uint* triangles,
                                               size_t triangle) {
  global const float* a = positions + bvh_get_corner(triangles, triangle, 0);
  global const float* b = positions + bvh_get_corner(triangles, triangle, 1);
  global const float* c = positions + bvh_get_corner(triangles, triangle, 2);
  bvh_box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = min(a[axis], min(b[axis], c[axis]));
    box.hi[axis] = max(a[axis], max(b[axis], c[axis]));
  }
  return box;
}

/// Computes half the surface area of the box around two boxes; infinite if it overflows.
static inline float bvh_compute_joint_half_area(global const kiln_bvh_branch* a,
                                                global const kiln_bvh_branch* b) {
#pragma OPENCL FP_CONTRACT OFF
  const float x = max(a->hi[0], b->hi[0]) - min(a->lo[0], b->lo[0]);
  const float y = max(a->hi[1], b->hi[1]) - min(a->lo[1], b->lo[1]);
  const float z = max(a->hi[2], b->hi[2]) - min(a->lo[2], b->lo[2]);
  const float area = (x * y + y * z) + z * x;
  return area < INFINITY ? area : INFINITY;
}

/// Classifies a triangle by the host's rule (mesh/usable.h), that the cross product of two edges is not 0 in double
/// precision. A component of it, in single precision, is known to be nonzero if it exceeds its rounding, which is below
/// 2^-22 of the sum of its products' sizes, and below 1e-30 where denormals are flushed.
static inline uint bvh_classify(global const float* positions, global const uint* triangles,
                                size_t triangle, uint position_count) {
#pragma OPENCL FP_CONTRACT OFF
  for (int corner = 0; corner < 3; ++corner) {
    if (triangles[3 * triangle + corner] >= position_count) return KILN_BVH_BAD_INDEX;
  }
  global const float* p = positions + bvh_get_corner(triangles, triangle, 0);
  global const float* q = positions + bvh_get_corner(triangles, triangle, 1);
  global const float* r = positions + bvh_get_corner(triangles, triangle, 2);
  float largest = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    if (!bvh_is_finite(p[axis]) || !bvh_is_finite(q[axis]) || !bvh_is_finite(r[axis]))
      return KILN_BVH_SKIPPED;
    largest = max(largest, max(fabs(p[axis]), max(fabs(q[axis]), fabs(r[axis]))));
  }
  if (bvh_is_same_point(p, q) || bvh_is_same_point(q, r) || bvh_is_same_point(r, p))
    return KILN_BVH_SKIPPED;
  if (!(largest <= 1048576.0f)) return KILN_BVH_UNCERTAIN;
  const float ax = q[0] - p[0], ay = q[1] - p[1], az = q[2] - p[2];
  const float bx = r[0] - p[0], by = r[1] - p[1], bz = r[2] - p[2];
  const float yz = ay * bz, zy = az * by, zx = az * bx, xz = ax * bz, xy = ax * by, yx = ay * bx;
  const float relative = 1.0f / 1048576.0f, absolute = 1e-30f;
  const bool has_area = fabs(yz - zy) > (fabs(yz) + fabs(zy)) * relative + absolute ||
                        fabs(zx - xz) > (fabs(zx) + fabs(xz)) * relative + absolute ||
                        fabs(xy - yx) > (fabs(xy) + fabs(yx)) * relative + absolute;
  return has_area ? KILN_BVH_USABLE : KILN_BVH_UNCERTAIN;
}

static inline kiln_bvh_summary bvh_make_empty_summary(void) {
  kiln_bvh_summary summary;
  for (int axis = 0; axis < 3; ++axis) {
    summary.lo[axis] = INFINITY;
    summary.hi[axis] = -INFINITY;
    summary.pad[axis] = 0;
  }
  summary.usable = summary.uncertain = summary.bad = 0;
  return summary;
}

/// \param is_resolved  1: `classes` holds the classes already; 0: it is written
kernel void kiln_bvh_classify(const uint count, const uint position_count, const uint is_resolved,
                              global const float* restrict positions,
                              global const uint* restrict triangles, global uchar* restrict classes,
                              global kiln_bvh_summary* restrict summaries) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t item = get_global_id(0);
  const size_t first = item * KILN_BVH_RUN;
  if (first >= count) return;
  const size_t end = min(first + KILN_BVH_RUN, (size_t)count);
  kiln_bvh_summary summary = bvh_make_empty_summary();
  for (size_t i = first; i < end; ++i) {
    const uint kind =
        is_resolved != 0 ? classes[i] : bvh_classify(positions, triangles, i, position_count);
    if (is_resolved == 0) classes[i] = (uchar)kind;
    summary.uncertain += kind == KILN_BVH_UNCERTAIN ? 1 : 0;
    summary.bad += kind == KILN_BVH_BAD_INDEX ? 1 : 0;
    if (kind != KILN_BVH_USABLE) continue;
    ++summary.usable;
    const bvh_box box = bvh_compute_triangle_box(positions, triangles, i);
    for (int axis = 0; axis < 3; ++axis) {
      const float center = box.lo[axis] + box.hi[axis];
      summary.lo[axis] = min(summary.lo[axis], center);
      summary.hi[axis] = max(summary.hi[axis], center);
    }
  }
  summaries[item] = summary;
}

kernel void kiln_bvh_join_summaries(const uint count, global const kiln_bvh_summary* restrict summaries,
                                    global kiln_bvh_summary* restrict joined) {
  const size_t item = get_global_id(0);
  const size_t first = item * KILN_BVH_RUN;
  if (first >= count) return;
  const size_t end = min(first + KILN_BVH_RUN, (size_t)count);
  kiln_bvh_summary sum = bvh_make_empty_summary();
  for (size_t i = first; i < end; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      sum.lo[axis] = min(sum.lo[axis], summaries[i].lo[axis]);
      sum.hi[axis] = max(sum.hi[axis], summaries[i].hi[axis]);
    }
    sum.usable += summaries[i].usable;
    sum.uncertain += summaries[i].uncertain;
    sum.bad += summaries[i].bad;
  }
  joined[item] = sum;
}

/// Moves the 16 bits of a number apart: bit i becomes bit 3 i.
static inline ulong bvh_spread_bits(ulong x) {
  x = (x | x << 16) & 0x00000000FF0000FFul;
  x = (x | x << 8) & 0x000000F00F00F00Ful;
  x = (x | x << 4) & 0x00000C30C30C30C3ul;
  x = (x | x << 2) & 0x0000249249249249ul;
  return x;
}

/// \param summary  of all triangles
kernel void kiln_bvh_make_keys(const uint count, global const kiln_bvh_summary* restrict summary,
                               global const float* restrict positions,
                               global const uint* restrict triangles,
                               global const uchar* restrict classes, global ulong* restrict keys,
                               global uint* restrict indices) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  indices[i] = (uint)i;
  if (classes[i] != KILN_BVH_USABLE) {
    keys[i] = KILN_BVH_KEY_SKIPPED;
    return;
  }
  const bvh_box box = bvh_compute_triangle_box(positions, triangles, i);
  const float extent = max(summary->hi[0] - summary->lo[0],
                           max(summary->hi[1] - summary->lo[1], summary->hi[2] - summary->lo[2]));
  const float scale = extent > 1e-30f && extent < INFINITY ? KILN_BVH_CELLS / extent : 0.0f;
  ulong code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float place = (box.lo[axis] + box.hi[axis] - summary->lo[axis]) * scale;
    // NaN becomes cell 0
    const uint cell = place > 0.0f ? (uint)min(place, (float)(KILN_BVH_CELLS - 1)) : 0;
    code |= bvh_spread_bits(cell) << axis;
  }
  uint hash = 0;
  for (int corner = 0; corner < 3; ++corner) {
    global const float* p = positions + bvh_get_corner(triangles, i, corner);
    for (int axis = 0; axis < 3; ++axis) {
      hash = (hash ^ bvh_get_bits(p[axis])) * 0x9E3779B1u;
      hash ^= hash >> 15;
    }
  }
  keys[i] = code << KILN_BVH_HASH_BITS | hash >> (32 - KILN_BVH_HASH_BITS);
}

/// The counters of all digits in a run of keys.
typedef struct bvh_counters {
  ulong low, high;
} bvh_counters;

static inline uint bvh_get_counter(bvh_counters counters, uint digit) {
  return (uint)((digit < 8 ? counters.low : counters.high) >> 8 * (digit & 7)) & 0xFFu;
}

static inline bvh_counters bvh_increment(bvh_counters counters, uint digit) {
  const ulong increment = (ulong)1 << 8 * (digit & 7);
  counters.low += digit < 8 ? increment : 0;
  counters.high += digit < 8 ? 0 : increment;
  return counters;
}

static inline uint bvh_extract_digit(ulong key, uint shift) {
  return (uint)(key >> shift) & (KILN_BVH_DIGITS - 1);
}

/// \param counts  number of keys with digit 0 in each run, then with digit 1 in each run, and so on
kernel void kiln_bvh_count_digits(const uint count, const uint runs, const uint shift,
                                  global const ulong* restrict keys, global uint* restrict counts) {
  const size_t run = get_global_id(0);
  if (run >= runs) return;
  const size_t end = min((run + 1) * KILN_BVH_RUN, (size_t)count);
  bvh_counters counters = {0, 0};
  for (size_t i = run * KILN_BVH_RUN; i < end; ++i)
    counters = bvh_increment(counters, bvh_extract_digit(keys[i], shift));
  for (uint digit = 0; digit < KILN_BVH_DIGITS; ++digit)
    counts[digit * (size_t)runs + run] = bvh_get_counter(counters, digit);
}

/// \param places  position of the first key of each digit of each run: the scanned counts
kernel void kiln_bvh_move_keys(const uint count, const uint runs, const uint shift,
                               global const uint* restrict places, global const ulong* restrict keys,
                               global const uint* restrict indices, global ulong* restrict to_keys,
                               global uint* restrict to_indices) {
  const size_t run = get_global_id(0);
  if (run >= runs) return;
  const size_t end = min((run + 1) * KILN_BVH_RUN, (size_t)count);
  bvh_counters counters = {0, 0};
  for (size_t i = run * KILN_BVH_RUN; i < end; ++i) {
    const ulong key = keys[i];
    const uint digit = bvh_extract_digit(key, shift);
    const size_t place = places[digit * (size_t)runs + run] + bvh_get_counter(counters, digit);
    counters = bvh_increment(counters, digit);
    to_keys[place] = key;
    to_indices[place] = indices[i];
  }
}

/// Computes one level of the upward pass of a scan: sums runs of numbers. \param from, to  first number of this level,
/// and of the next
kernel void kiln_bvh_scan_up(const uint count, const uint from, const uint to,
                             global uint* restrict numbers) {
  const size_t item = get_global_id(0);
  const size_t first = item * KILN_BVH_RUN;
  if (first >= count) return;
  const size_t end = min(first + KILN_BVH_RUN, (size_t)count);
  uint sum = 0;
  for (size_t i = first; i < end; ++i) sum += numbers[from + i];
  numbers[to + item] = sum;
}

/// Computes one level of the downward pass: replaces each number by the sum of those before it. \param above  first
/// number of the level above, which is scanned already \param is_top  1: that level is only the total, which is kept
kernel void kiln_bvh_scan_down(const uint count, const uint from, const uint above, const uint is_top,
                               global uint* restrict numbers) {
  const size_t item = get_global_id(0);
  const size_t first = item * KILN_BVH_RUN;
  if (first >= count) return;
  const size_t end = min(first + KILN_BVH_RUN, (size_t)count);
  uint sum = is_top != 0 ? 0 : numbers[above + item];
  for (size_t i = first; i < end; ++i) {
    const uint value = numbers[from + i];
    numbers[from + i] = sum;
    sum += value;
  }
}

/// Writes 1 for triangles that belong in the tree, 0 for others. Equal triangles have equal keys. The lowest index comes
/// first, since the sort is stable. Nearly all equal keys belong to equal triangles, so few steps back are needed.
kernel void kiln_bvh_mark_unique(const uint count, global const float* restrict positions,
                                 global const uint* restrict triangles,
                                 global const ulong* restrict keys,
                                 global const uint* restrict indices, global uint* restrict marks) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const ulong key = keys[i];
  uint mark = (key & KILN_BVH_KEY_SKIPPED) == 0 ? 1 : 0;
  for (size_t k = i; mark != 0 && k > 0 && keys[k - 1] == key; --k) {
    bool is_same = true;
    for (int corner = 0; corner < 3; ++corner) {
      is_same = is_same && bvh_is_same_point(positions + bvh_get_corner(triangles, indices[i], corner),
                                             positions + bvh_get_corner(triangles, indices[k - 1], corner));
    }
    if (is_same) mark = 0;
  }
  marks[i] = mark;
}

/// \param places  the scanned marks \param total  their sum
kernel void kiln_bvh_make_leaves(const uint count, const uint total,
                                 global const float* restrict positions,
                                 global const uint* restrict triangles,
                                 global const uint* restrict indices,
                                 global const uint* restrict places,
                                 global kiln_bvh_branch* restrict branches,
                                 global uint* restrict sizes, global uint* restrict clusters) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const uint place = places[i];
  if ((i + 1 < count ? places[i + 1] : total) == place) return;
  const uint triangle = indices[i];
  const bvh_box box = bvh_compute_triangle_box(positions, triangles, triangle);
  kiln_bvh_branch leaf;
  for (int axis = 0; axis < 3; ++axis) {
    leaf.lo[axis] = box.lo[axis];
    leaf.hi[axis] = box.hi[axis];
  }
  leaf.left = triangle;
  leaf.right = KILN_NO_TRIANGLE;
  branches[place] = leaf;
  sizes[place] = 1;
  clusters[place] = place;
}

/// Finds the partner of each cluster, and writes its index.
kernel void kiln_bvh_find_partners(const uint count, global const uint* restrict clusters,
                                   global const kiln_bvh_branch* restrict branches,
                                   global uint* restrict partners) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  global const kiln_bvh_branch* branch = branches + clusters[i];
  const uint first = i > KILN_BVH_SEARCH_RADIUS ? i - KILN_BVH_SEARCH_RADIUS : 0;
  const uint last = min(i + KILN_BVH_SEARCH_RADIUS, count - 1);
  uint partner = KILN_NO_TRIANGLE;
  float least_area = INFINITY;
  for (uint k = first; k <= last; ++k) {
    if (k == i) continue;
    const float area = bvh_compute_joint_half_area(branch, branches + clusters[k]);
    // Of partners at the same distance, the one with the lower index is chosen.
    const bool is_better = partner == KILN_NO_TRIANGLE || area < least_area ||
                           (area == least_area && (k ^ i) < (partner ^ i));
    if (!is_better) continue;
    partner = k;
    least_area = area;
  }
  partners[i] = partner;
}

/// Makes clusters 2 k and 2 k + 1 partners; the last one of an odd number has none.
kernel void kiln_bvh_pair_neighbours(const uint count, global uint* restrict partners) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  partners[i] = (i ^ 1u) < count ? i ^ 1u : KILN_NO_TRIANGLE;
}

/// True if a cluster merges with its partner.
static inline bool bvh_is_merged(global const uint* partners, uint i) {
  return partners[i] != KILN_NO_TRIANGLE && partners[partners[i]] == i;
}

/// Writes 1 for clusters that are merged into their partner, the later one of each pair; 0 for others.
kernel void kiln_bvh_mark_pairs(const uint count, global const uint* restrict partners,
                                global uint* restrict marks) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  marks[i] = bvh_is_merged(partners, i) && partners[i] < i ? 1 : 0;
}

/// \param places  the scanned marks \param next  index of the first new branch
kernel void kiln_bvh_merge_pairs(const uint count, const uint next, global const uint* restrict partners,
                                 global const uint* restrict places, global const uint* restrict clusters,
                                 global uint* restrict merged, global kiln_bvh_branch* restrict branches,
                                 global uint* restrict sizes) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const bool is_merged = bvh_is_merged(partners, i);
  const uint partner = partners[i];
  if (is_merged && partner < i) return;
  const uint to = i - places[i];
  if (!is_merged) {
    merged[to] = clusters[i];
    return;
  }
  const uint left = clusters[i];
  const uint right = clusters[partner];
  const uint self = next + places[partner];
  kiln_bvh_branch branch;
  for (int axis = 0; axis < 3; ++axis) {
    branch.lo[axis] = min(branches[left].lo[axis], branches[right].lo[axis]);
    branch.hi[axis] = max(branches[left].hi[axis], branches[right].hi[axis]);
  }
  branch.left = left;
  branch.right = right;
  branches[self] = branch;
  sizes[self] = sizes[left] + sizes[right];
  merged[to] = self;
}

/// Collects up to 8 descendants of a branch, which become the children of one node. \returns their number
static inline uint bvh_collect_children(global const kiln_bvh_branch* branches, global const uint* sizes,
                                        uint root, uint children[KILN_BVH_WIDTH]) {
  float areas[KILN_BVH_WIDTH];
  children[0] = root;
  // Only the root of the whole tree may fit a leaf, which is then its one child.
  areas[0] = sizes[root] <= KILN_BVH_LEAF_TRIANGLES ? -1.0f : 0.0f;
  uint count = 1;
  while (count < KILN_BVH_WIDTH) {
    int largest_child = -1;
    float largest = -1.0f;
    for (uint k = 0; k < count; ++k) {
      if (areas[k] > largest) {
        largest = areas[k];
        largest_child = (int)k;
      }
    }
    if (largest_child < 0) break;
    const uint replaced = children[largest_child];
    children[largest_child] = branches[replaced].left;
    children[count] = branches[replaced].right;
    for (int side = 0; side < 2; ++side) {
      const uint k = side == 0 ? (uint)largest_child : count;
      global const kiln_bvh_branch* child = branches + children[k];
      // Leaves get a negative area, so that they are not replaced by their children.
      areas[k] = sizes[children[k]] <= KILN_BVH_LEAF_TRIANGLES
                     ? -1.0f
                     : bvh_compute_joint_half_area(child, child);
    }
    ++count;
  }
  return count;
}

/// Counts the children of the nodes of a level. \param counts  per node the number of children that are nodes, then
/// per node that of leaves
kernel void kiln_bvh_count_children(const uint count, const uint first, global const uint* restrict roots,
                                    global const kiln_bvh_branch* restrict branches,
                                    global const uint* restrict sizes, global uint* restrict counts) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  uint children[KILN_BVH_WIDTH];
  const uint child_count = bvh_collect_children(branches, sizes, roots[first + i], children);
  uint nodes = 0;
  for (uint k = 0; k < child_count; ++k) nodes += sizes[children[k]] > KILN_BVH_LEAF_TRIANGLES ? 1 : 0;
  counts[i] = nodes;
  counts[count + i] = child_count - nodes;
}

/// Assigns positions to the children of a level's nodes.
/// \param places  the scanned counts \param next_node, next_block  first free places
/// \param starts  per node, the places of its first child that is a node, and of its first leaf
kernel void kiln_bvh_place_children(const uint count, const uint first, const uint next_node,
                                    const uint next_block, global const uint* restrict places,
                                    global uint* roots, global uint* restrict leaf_roots,
                                    global uint* restrict starts,
                                    global const kiln_bvh_branch* restrict branches,
                                    global const uint* restrict sizes) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  uint node = next_node + places[i];
  // The counts of leaves follow the counts of nodes.
  uint block = next_block + places[count + i] - places[count];
  starts[2 * (first + i)] = node;
  starts[2 * (first + i) + 1] = block;
  uint children[KILN_BVH_WIDTH];
  const uint child_count = bvh_collect_children(branches, sizes, roots[first + i], children);
  for (uint k = 0; k < child_count; ++k) {
    if (sizes[children[k]] > KILN_BVH_LEAF_TRIANGLES) {
      roots[node++] = children[k];
    } else {
      leaf_roots[block++] = children[k];
    }
  }
}

kernel void kiln_bvh_write_nodes(const uint count, global const uint* restrict roots,
                                 global const uint* restrict starts,
                                 global const kiln_bvh_branch* restrict branches,
                                 global const uint* restrict sizes,
                                 global kiln_bvh_node* restrict nodes) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  uint children[KILN_BVH_WIDTH];
  const uint child_count = bvh_collect_children(branches, sizes, roots[i], children);
  uint node = starts[2 * i];
  uint block = starts[2 * i + 1];
  global kiln_bvh_node* to = nodes + i;
  for (uint k = 0; k < KILN_BVH_WIDTH; ++k) {
    const bool is_used = k < child_count;
    const uint child = is_used ? children[k] : 0;
    for (int axis = 0; axis < 3; ++axis) {
      to->planes[axis][0][k] = is_used ? branches[child].lo[axis] - KILN_BVH_EPSILON : INFINITY;
      to->planes[axis][1][k] = is_used ? branches[child].hi[axis] + KILN_BVH_EPSILON : -INFINITY;
    }
    to->pad[k] = 0;
    if (!is_used) {
      to->child[k] = KILN_BVH_LEAF;
    } else if (sizes[child] > KILN_BVH_LEAF_TRIANGLES) {
      to->child[k] = node++;
    } else {
      to->child[k] = KILN_BVH_LEAF | block++;
    }
  }
}

/// Writes leaves, and half the surface area of each.
kernel void kiln_bvh_write_blocks(const uint count, global const uint* restrict leaf_roots,
                                  global const kiln_bvh_branch* restrict branches,
                                  global const float* restrict positions,
                                  global const uint* restrict triangles,
                                  global kiln_bvh_block* restrict blocks,
                                  global float* restrict areas) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const uint root = leaf_roots[i];
  areas[i] = bvh_compute_joint_half_area(branches + root, branches + root);
  // A subtree of up to 4 triangles has at most 4 branches to visit at a time.
  uint stack[KILN_BVH_LEAF_TRIANGLES];
  stack[0] = root;
  uint stack_size = 1;
  uint lane = 0;
  uint first_triangle = 0;
  global kiln_bvh_block* to = blocks + i;
  while (stack_size != 0) {
    global const kiln_bvh_branch* branch = branches + stack[--stack_size];
    if (branch->right != KILN_NO_TRIANGLE) {
      stack[stack_size++] = branch->right;
      stack[stack_size++] = branch->left;
      continue;
    }
    if (lane == 0) first_triangle = branch->left;
    to->triangle[lane] = branch->left;
    for (int corner = 0; corner < 3; ++corner) {
      global const float* p = positions + bvh_get_corner(triangles, branch->left, corner);
      for (int axis = 0; axis < 3; ++axis) to->corner[corner][axis][lane] = p[axis];
    }
    ++lane;
  }
  global const float* p = positions + bvh_get_corner(triangles, first_triangle, 0);
  for (; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
    to->triangle[lane] = KILN_NO_TRIANGLE;
    for (int corner = 0; corner < 3; ++corner) {
      for (int axis = 0; axis < 3; ++axis) to->corner[corner][axis][lane] = p[axis];
    }
  }
}

/// Computes one level of a sum of areas. \param from, to  first area of this level, and of the next
kernel void kiln_bvh_sum_areas(const uint count, const uint from, const uint to,
                               global float* restrict areas) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t item = get_global_id(0);
  const size_t first = item * KILN_BVH_RUN;
  if (first >= count) return;
  const size_t end = min(first + KILN_BVH_RUN, (size_t)count);
  float sum = 0.0f;
  for (size_t i = first; i < end; ++i) sum += areas[from + i];
  areas[to + item] = sum;
}
