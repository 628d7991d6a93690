#include "volume/outer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kPlanesPerTask = 16;  // Number of voxel planes per task of a parallel loop
/// A region of empty voxels is outside if it has at least 1 / kOuterDivisor as many voxels on the
/// volume's border as the region that has most of them there.
constexpr std::uint64_t kOuterDivisor = 20;

/// Maximum number of runs, since runs have 32-bit numbers.
constexpr std::uint64_t kMaxRuns = 0xFFFFFFFE;

/// Consecutive outside voxels of a row, from `first` to `last`.
struct VoxelRun {
  std::uint32_t first, last;
};

/// Peak memory per run: the run, its parent, its border voxels, and whether it is open.
constexpr std::uint64_t kBytesPerRun =
    sizeof(VoxelRun) + sizeof(std::uint32_t) + sizeof(std::uint64_t) + sizeof(char);

/// One bit per padded voxel, in CellGrid's layout.
class BitVolume {
 public:
  BitVolume(const std::array<std::uint32_t, 3>& size, std::size_t row_words)
      : size_(size),
        row_(row_words),
        bits_((std::size_t{size[1]} + 2) * (std::size_t{size[2]} + 2) * row_words) {}

  std::size_t row_words() const { return row_; }
  std::size_t rows() const { return size_[1] + 2; }
  std::size_t planes() const { return size_[2] + 2; }
  std::uint64_t* row(std::size_t y, std::size_t z) { return &bits_[(z * rows() + y) * row_]; }
  const std::uint64_t* row(std::size_t y, std::size_t z) const {
    return &bits_[(z * rows() + y) * row_];
  }
  /// Calls visit(y, z) for all rows of voxels, in parallel.
  template <typename Visit>
  void for_rows(const Visit& visit) const {
    parallel_for(size_[2], kPlanesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t z = begin; z < end; ++z) {
        for (std::size_t y = 0; y < size_[1]; ++y) visit(y + 1, z + 1);
      }
    });
  }
  const std::array<std::uint32_t, 3>& size() const { return size_; }

 private:
  std::array<std::uint32_t, 3> size_;
  std::size_t row_;
  std::vector<std::uint64_t> bits_;
};

/// Mask of the voxels of a row, without padding.
std::vector<std::uint64_t> voxel_mask(std::uint32_t count, std::size_t words) {
  std::vector<std::uint64_t> mask(words);
  for (std::uint32_t x = 1; x <= count; ++x) mask[x >> 6] |= std::uint64_t{1} << (x & 63);
  return mask;
}

/// Dilates along one axis: a bit is set if it or a neighbour along the axis is. Padding stays 0.
void dilate_along(const BitVolume& from, BitVolume& to, int axis,
                  const std::vector<std::uint64_t>& mask) {
  from.for_rows([&](std::size_t y, std::size_t z) {
    const std::uint64_t* source_row = from.row(y, z);
    std::uint64_t* out = to.row(y, z);
    const std::size_t words = from.row_words();
    if (axis == 0) {
      for (std::size_t w = 0; w < words; ++w) {
        const std::uint64_t before = source_row[w] << 1 | (w > 0 ? source_row[w - 1] >> 63 : 0);
        const std::uint64_t after =
            source_row[w] >> 1 | (w + 1 < words ? source_row[w + 1] << 63 : 0);
        out[w] = (source_row[w] | before | after) & mask[w];
      }
      return;
    }
    const std::uint64_t* before = axis == 1 ? from.row(y - 1, z) : from.row(y, z - 1);
    const std::uint64_t* after = axis == 1 ? from.row(y + 1, z) : from.row(y, z + 1);
    for (std::size_t w = 0; w < words; ++w) out[w] = source_row[w] | before[w] | after[w];
  });
}

/// Dilates by a cube with sides of 2 * radius + 1 voxels.
void dilate(BitVolume& bits, std::uint32_t radius, const std::vector<std::uint64_t>& mask) {
  BitVolume other(bits.size(), bits.row_words());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::uint32_t step = 0; step < radius; ++step) {
      dilate_along(bits, other, axis, mask);
      std::swap(bits, other);
    }
  }
}

/// Connected regions of voxels whose bit is 0.
class OutsideRegions {
 public:
  OutsideRegions(const BitVolume& solid, const std::string& name) : solid_(solid) {
    find_runs(name);
    join();
  }

  std::size_t run_count() const { return outside_runs_.size(); }
  const VoxelRun& run(std::size_t index) const { return outside_runs_[index]; }
  /// The runs of a row have the indices first_run(row) to first_run(row + 1) - 1.
  std::uint32_t first_run(std::size_t row) const { return first_runs_[row]; }

  /// For each run, 1 if its region is connected with the outside.
  std::vector<char> open_runs() {
    const auto [nx, ny, nz] = solid_.size();
    std::vector<std::uint64_t> border_voxels(outside_runs_.size());
    for (std::size_t row = 0; row + 1 < first_runs_.size(); ++row) {
      const std::size_t y = row % ny, z = row / ny;
      const bool side = y == 0 || y + 1 == ny || z == 0 || z + 1 == nz;
      for (std::uint32_t i = first_runs_[row]; i < first_runs_[row + 1]; ++i) {
        const VoxelRun& run = outside_runs_[i];
        const std::uint64_t count =
            side ? run.last - run.first + 1 : (run.first == 1 ? 1 : 0) + (run.last == nx ? 1 : 0);
        if (count != 0) border_voxels[region_sets_.find(i)] += count;
      }
    }
    const std::uint64_t max_border_voxels =
        border_voxels.empty() ? 0 : *std::max_element(border_voxels.begin(), border_voxels.end());
    std::vector<char> open(outside_runs_.size());
    for (std::uint32_t i = 0; i < outside_runs_.size(); ++i) {
      open[i] = max_border_voxels != 0 &&
                        border_voxels[region_sets_.find(i)] * kOuterDivisor >= max_border_voxels
                    ? 1
                    : 0;
    }
    return open;
  }

 private:
  void find_runs(const std::string& name) {
    const auto size = solid_.size();
    const std::size_t ny = size[1], nz = size[2];
    first_runs_.resize(ny * nz + 1);
    const std::vector<std::uint64_t> mask = voxel_mask(size[0], solid_.row_words());
    std::atomic<std::uint64_t> count = 0;
    solid_.for_rows([&](std::size_t y, std::size_t z) {
      // A run starts where a voxel is outside and the previous one is not.
      std::uint32_t started_runs = 0;
      std::uint64_t before = 0;
      for (std::size_t w = 0; w < mask.size(); ++w) {
        const std::uint64_t outside = ~solid_.row(y, z)[w] & mask[w];
        started_runs +=
            static_cast<std::uint32_t>(std::popcount(outside & ~(outside << 1 | before)));
        before = outside >> 63;
      }
      first_runs_[(z - 1) * ny + y - 1] = started_runs;
      count += started_runs;
    });
    if (count > kMaxRuns) {
      throw Error(ErrorCode::input, "The outside of volume '" + name + "' is too fragmented (" +
                                        std::to_string(count) +
                                        " runs of voxels). Smooth its noise, or contour all "
                                        "surfaces.");
    }
    require_memory("The outside of volume '" + name + "'", kBytesPerRun * count);
    std::uint32_t sum = 0;
    for (std::uint32_t& first : first_runs_) sum += std::exchange(first, sum);
    outside_runs_.resize(count);
    solid_.for_rows([&](std::size_t y, std::size_t z) { write_runs(y, z); });
    region_sets_ = DisjointSets(outside_runs_.size());
  }

  void write_runs(std::size_t y, std::size_t z) {
    VoxelRun* out = outside_runs_.data() + first_runs_[(z - 1) * solid_.size()[1] + y - 1];
    const std::uint64_t* row = solid_.row(y, z);
    // A run starts or ends where a bit differs from the previous one.
    std::uint32_t x = 1;
    const std::uint32_t end = solid_.size()[0] + 1;
    // Finds the position of the next bit with this value, from x on; the end of the row if there is
    // none
    const auto next = [&](bool solid) {
      while (x < end) {
        const std::uint64_t word = (solid ? row[x >> 6] : ~row[x >> 6]) >> (x & 63);
        if (word != 0) {
          x = std::min(end, x + static_cast<std::uint32_t>(std::countr_zero(word)));
          return;
        }
        x = (x | 63U) + 1;
      }
      x = end;
    };
    next(false);
    while (x < end) {
      const std::uint32_t first = x;
      next(true);
      *out++ = {first, x - 1};
      next(false);
    }
  }

  void join() {
    const auto size = solid_.size();
    const std::size_t ny = size[1], nz = size[2];
    parallel_for(nz, kPlanesPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t z = begin; z < end; ++z) {
        for (std::size_t y = 0; y < ny; ++y) {
          if (y > 0) join_rows(z * ny + y - 1, z * ny + y);
          if (z > begin) join_rows((z - 1) * ny + y, z * ny + y);
        }
      }
    });
    for (std::size_t z = kPlanesPerTask; z < nz; z += kPlanesPerTask) {
      for (std::size_t y = 0; y < ny; ++y) join_rows((z - 1) * ny + y, z * ny + y);
    }
  }

  void join_rows(std::size_t row_a, std::size_t row_b) {
    std::uint32_t a = first_runs_[row_a], b = first_runs_[row_b];
    while (a < first_runs_[row_a + 1] && b < first_runs_[row_b + 1]) {
      if (outside_runs_[a].first <= outside_runs_[b].last &&
          outside_runs_[b].first <= outside_runs_[a].last)
        region_sets_.join(a, b);
      if (outside_runs_[a].last < outside_runs_[b].last) {
        ++a;
      } else {
        ++b;
      }
    }
  }

  const BitVolume& solid_;
  std::vector<std::uint32_t> first_runs_;
  std::vector<VoxelRun> outside_runs_;
  /// Sets of touching runs; a set is a region, and the run with the lowest number represents it
  DisjointSets region_sets_{0};
};

/// Sets bits `first` to `last` of a row.
void set_bits(std::uint64_t* row, std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t w = first >> 6; w <= last >> 6; ++w) {
    std::uint64_t bits = ~std::uint64_t{0};
    if (w == first >> 6) bits &= ~std::uint64_t{0} << (first & 63);
    if (w == last >> 6) bits &= ~std::uint64_t{0} >> (63 - (last & 63));
    row[w] |= bits;
  }
}

}  // namespace

std::uint64_t fill_unreached(CellGrid& cells, std::uint32_t gap, const std::string& name) {
  const auto size = cells.size();
  const std::size_t words = cells.row_words();
  const std::vector<std::uint64_t> mask = voxel_mask(size[0], words);
  const auto line = [&](std::size_t y, std::size_t z) {
    return cells.plane(static_cast<std::uint32_t>(z)) + y * words;
  };
  // Peak memory: three volumes of bits (the solid, the reached voxels, and a temporary copy for
  // dilation).
  require_memory("The outside of volume '" + name + "'", 3 * sizeof(std::uint64_t) * words *
                                                             (std::uint64_t{size[1]} + 2) *
                                                             (std::uint64_t{size[2]} + 2));
  BitVolume solid(size, words);
  solid.for_rows(
      [&](std::size_t y, std::size_t z) { std::copy_n(line(y, z), words, solid.row(y, z)); });
  if (gap != 0) dilate(solid, gap, mask);
  BitVolume reached_voxels(size, words);
  {
    OutsideRegions outside_regions(solid, name);
    const std::vector<char> open = outside_regions.open_runs();
    reached_voxels.for_rows([&](std::size_t y, std::size_t z) {
      const std::size_t row = (z - 1) * size[1] + y - 1;
      for (std::uint32_t i = outside_regions.first_run(row); i < outside_regions.first_run(row + 1);
           ++i) {
        if (open[i] != 0)
          set_bits(reached_voxels.row(y, z), outside_regions.run(i).first,
                   outside_regions.run(i).last);
      }
    });
  }
  if (gap != 0) dilate(reached_voxels, gap, mask);
  std::atomic<std::uint64_t> filled_voxels = 0;
  reached_voxels.for_rows([&](std::size_t y, std::size_t z) {
    const std::uint64_t* from = reached_voxels.row(y, z);
    std::uint64_t* to = line(y, z);
    std::uint64_t count = 0;
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint64_t fill = mask[w] & ~from[w] & ~to[w];
      count += static_cast<std::uint64_t>(std::popcount(fill));
      to[w] |= fill;
    }
    filled_voxels += count;
  });
  return filled_voxels;
}

}  // namespace kiln
