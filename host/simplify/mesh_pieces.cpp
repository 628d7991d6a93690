#include "simplify/mesh_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "base/parallel.h"

namespace kiln {
namespace {

/// Items that a thread looks at at a time, and slices of a box that they are counted in.
constexpr std::size_t kItemsOfPart = std::size_t{1} << 16, kSlices = 1024;

struct Item {
  float x, y, z;
  std::uint32_t triangle;
};

/// Halves lists of items, which stay in order of their triangles.
class Halving {
 public:
  /// \param given  and where to write its halves, one after the other
  Halving(std::span<const Item> given, std::span<Item> halves)
      : given_(given), halves_(halves), parts_((given.size() + kItemsOfPart - 1) / kItemsOfPart) {}

  void run() {
    find_axis();
    count();
    find_middle();
    deal_out();
  }

 private:
  struct Part {
    Vec3 low, high;
    std::array<std::uint32_t, kSlices> of_slice{};
    std::vector<Item> middle;  ///< Items of the slice in which the halves meet.
    std::size_t lower = 0;     ///< Number in the lower half.
  };

  /// Calls `body` with each part, its first item, and where it ends.
  template <class Body>
  void each_part(const Body& body) {
    parallel_for(given_.size(), kItemsOfPart, [&](std::size_t begin, std::size_t end) {
      body(parts_[begin / kItemsOfPart], begin, end);
    });
  }
  float at(const Item& item) const { return item.*axis_; }
  std::size_t slice(const Item& item) const {
    return std::min(static_cast<std::size_t>((at(item) - low_) * slices_), kSlices - 1);
  }
  bool is_less(const Item& a, const Item& b) const {
    return at(a) != at(b) ? at(a) < at(b) : a.triangle < b.triangle;
  }

  /// The longest side of the box.
  void find_axis() {
    each_part([&](Part& part, std::size_t begin, std::size_t end) {
      const Item& first = given_[begin];
      Vec3 low{first.x, first.y, first.z}, high = low;
      for (const Item& p : given_.subspan(begin, end - begin)) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      }
      part.low = low;
      part.high = high;
    });
    Vec3 low = parts_[0].low, high = parts_[0].high;
    for (const Part& part : parts_) {
      low = {std::min(low.x, part.low.x), std::min(low.y, part.low.y), std::min(low.z, part.low.z)};
      high = {std::max(high.x, part.high.x), std::max(high.y, part.high.y),
              std::max(high.z, part.high.z)};
    }
    const float x = high.x - low.x, y = high.y - low.y, z = high.z - low.z;
    const bool along_x = x >= y && x >= z, along_y = !along_x && y >= z;
    axis_ = along_x ? &Item::x : along_y ? &Item::y : &Item::z;
    low_ = along_x ? low.x : along_y ? low.y : low.z;
    const float slices = kSlices / (along_x ? x : along_y ? y : z);
    slices_ = std::isfinite(slices) ? slices : 0;
  }

  void count() {
    each_part([&](Part& part, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++part.of_slice[slice(given_[i])];
    });
  }

  /// The first item of the upper half, in order along the axis, and how many of each part are below.
  void find_middle() {
    std::size_t below = 0, middle = 0;
    const std::size_t half = given_.size() / 2;
    for (;; ++middle) {
      std::size_t more = 0;
      for (const Part& part : parts_) more += part.of_slice[middle];
      if (below + more > half) break;
      below += more;
    }
    each_part([&](Part& part, std::size_t begin, std::size_t end) {
      for (std::size_t s = 0; s < middle; ++s) part.lower += part.of_slice[s];
      part.middle.reserve(part.of_slice[middle]);
      for (std::size_t i = begin; i < end; ++i) {
        if (slice(given_[i]) == middle) part.middle.push_back(given_[i]);
      }
    });
    std::vector<Item> all;
    for (const Part& part : parts_) all.insert(all.end(), part.middle.begin(), part.middle.end());
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(half - below);
    std::nth_element(all.begin(), first, all.end(),
                     [&](const Item& a, const Item& b) { return is_less(a, b); });
    first_ = *first;
    for (Part& part : parts_) {
      part.lower += static_cast<std::size_t>(
          std::count_if(part.middle.begin(), part.middle.end(),
                        [&](const Item& item) { return is_less(item, first_); }));
    }
  }

  void deal_out() {
    std::vector<std::size_t> lower_before(parts_.size(), 0);
    for (std::size_t i = 1; i < parts_.size(); ++i) {
      lower_before[i] = lower_before[i - 1] + parts_[i - 1].lower;
    }
    each_part([&](Part&, std::size_t begin, std::size_t end) {
      std::size_t lower = lower_before[begin / kItemsOfPart];
      std::size_t upper = given_.size() / 2 + begin - lower;
      for (std::size_t i = begin; i < end; ++i) {
        halves_[is_less(given_[i], first_) ? lower++ : upper++] = given_[i];
      }
    });
  }

  std::span<const Item> given_;
  std::span<Item> halves_;
  std::vector<Part> parts_;
  float Item::*axis_ = &Item::x;
  float low_ = 0, slices_ = 0;  ///< Start of the box along the axis, and slices a unit.
  Item first_{};                ///< First item of the upper half.
};

}  // namespace

std::vector<std::vector<std::uint32_t>> pieces_of(std::span<const Vec3> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::size_t least) {
  const std::size_t all = triangles.size();
  auto items = std::make_unique_for_overwrite<Item[]>(all);
  auto halves = std::make_unique_for_overwrite<Item[]>(all);
  parallel_for(all, kItemsOfPart, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3& corner = positions[triangles[t][0]];
      items[t] = {corner.x, corner.y, corner.z, static_cast<std::uint32_t>(t)};
    }
  });
  std::vector<std::size_t> starts{0, all};
  while (starts[1] / 2 >= least) {
    std::vector<std::size_t> next(2 * starts.size() - 1, all);
    // Large lists are halved by all threads, small ones by one each.
    parallel_for(
        starts.size() - 1, 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            const std::size_t first = starts[i], count = starts[i + 1] - first;
            Halving({items.get() + first, count}, {halves.get() + first, count}).run();
            next[2 * i] = first;
            next[2 * i + 1] = first + count / 2;
          }
        },
        starts[1] > kItemsOfPart ? 1 : 0);
    items.swap(halves);
    starts = std::move(next);
  }
  std::vector<std::vector<std::uint32_t>> result(starts.size() - 1);
  parallel_for(result.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i].reserve(starts[i + 1] - starts[i]);
      for (std::size_t k = starts[i]; k < starts[i + 1]; ++k) {
        result[i].push_back(items[k].triangle);
      }
    }
  });
  return result;
}

std::vector<std::uint8_t> between_pieces(const std::vector<std::vector<std::uint32_t>>& pieces,
                                         std::span<const Triangle> triangles,
                                         std::size_t vertices) {
  constexpr auto kNone = static_cast<std::uint32_t>(-1);
  std::vector<std::uint32_t> piece_of(vertices, kNone);
  std::vector<std::uint8_t> between(vertices, 0);
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    for (const std::uint32_t t : pieces[i]) {
      for (const std::uint32_t v : triangles[t]) {
        if (piece_of[v] == kNone) piece_of[v] = i;
        if (piece_of[v] != i) between[v] = 1;
      }
    }
  }
  return between;
}

}  // namespace kiln
