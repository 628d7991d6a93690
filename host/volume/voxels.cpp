#include "volume/voxels.h"

#include <algorithm>
#include <atomic>
#include <cfloat>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>

#include "base/formatted.h"
#include "base/parallel.h"
#include "base/voxel_type.h"

namespace kiln {
namespace {

constexpr std::size_t kVoxelsPerTask = std::size_t{1} << 18;
constexpr std::uint32_t kMaxSide = 32766;

/// Calls body(typed pointer, count) with the volume's voxel type.
template <typename Body>
auto with_type(const Volume& volume, const Body& body) {
  const std::byte* data = volume.voxels.data();
  return with_voxel_type(
      volume.type, [&]<typename T>(const T&) { return body(reinterpret_cast<const T*>(data)); });
}

std::size_t voxel_count(const Volume& volume) {
  return std::size_t{volume.size[0]} * volume.size[1] * volume.size[2];
}

struct FiniteRange {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  std::uint64_t not_finite = 0;
  /// Number of voxels that are +infinity, and of those that are -infinity
  std::uint64_t infinite_count = 0, minus_infinite_count = 0;
};

FiniteRange find_finite_range(const Volume& volume) {
  return with_type(volume, [&](const auto* voxels) {
    using T = std::remove_cvref_t<decltype(*voxels)>;
    FiniteRange finite_range;
    std::mutex mutex;
    parallel_for(voxel_count(volume), kVoxelsPerTask, [&](std::size_t begin, std::size_t end) {
      T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::lowest();
      std::uint64_t not_finite_count = 0, infinite_count = 0, minus_infinite_count = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const T value = voxels[i];
        if constexpr (std::is_floating_point_v<T>) {
          const bool is_exact = std::abs(value) <= std::numeric_limits<T>::max();
          not_finite_count += is_exact ? 0 : 1;
          infinite_count += value > std::numeric_limits<T>::max() ? 1 : 0;
          minus_infinite_count += value < std::numeric_limits<T>::lowest() ? 1 : 0;
          low = is_exact && value < low ? value : low;
          high = is_exact && value > high ? value : high;
        } else {
          low = std::min(low, value);
          high = std::max(high, value);
        }
      }
      if (not_finite_count == end - begin) low = high = 0;  // No voxel of this range is finite
      const std::lock_guard lock(mutex);
      finite_range.not_finite += not_finite_count;
      finite_range.infinite_count += infinite_count;
      finite_range.minus_infinite_count += minus_infinite_count;
      if (not_finite_count == end - begin) return;
      finite_range.lowest = std::min(finite_range.lowest, static_cast<double>(low));
      finite_range.highest = std::max(finite_range.highest, static_cast<double>(high));
    });
    return finite_range;
  });
}

void check(const Volume& volume, const ContourOptions& options) {
  const auto fail = [&](const std::string& text) {
    throw Error(ErrorCode::input, "Volume '" + volume.name + "' " + text);
  };
  if (!std::isfinite(options.iso)) {
    throw Error(ErrorCode::usage, "The iso value is not finite: give a number.");
  }
  if (options.outer_gap > 64) {
    throw Error(ErrorCode::usage, "The outer gap " + std::to_string(options.outer_gap) +
                                      " is out of range: give 0 to 64 voxels.");
  }
  const std::string sides = std::to_string(volume.size[0]) + " x " +
                            std::to_string(volume.size[1]) + " x " +
                            std::to_string(volume.size[2]) + " voxels";
  for (const std::uint32_t side : volume.size) {
    if (side < 2 || side > kMaxSide) {
      fail("has " + sides + ": a surface needs 2 to " + std::to_string(kMaxSide) +
           " along each axis.");
    }
  }
  if (volume.voxels.size() != voxel_count(volume) * size_of(volume.type)) {
    fail("has " + sides + " of " + std::to_string(size_of(volume.type)) + " bytes, but " +
         std::to_string(volume.voxels.size()) + " bytes of data.");
  }
  const auto& a = volume.axes;
  const double determinant = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                             a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                             a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
  double lengths = 1;
  for (const auto& axis : a) lengths *= std::hypot(axis[0], axis[1], axis[2]);
  for (const double value : volume.origin) {
    if (!std::isfinite(value)) fail("has an origin that is not finite.");
  }
  if (!(std::abs(determinant) > 1e-6 * lengths) || !std::isfinite(lengths)) {
    fail("has axes that span no space: check its spacing and directions.");
  }
}

std::string number(double value) { return formatted("%.9g", value); }

}  // namespace

const char* DeviceVoxels::type_name() const {
  switch (type) {
    case VoxelType::u8:
      return "uchar";
    case VoxelType::i8:
      return "char";
    case VoxelType::u16:
      return "ushort";
    case VoxelType::i16:
      return "short";
    default:
      return "float";
  }
}

DeviceVoxels convert_voxels(const Volume& volume, const ContourOptions& options, double& lowest,
                            double& highest) {
  check(volume, options);
  DeviceVoxels result;
  result.data = volume.voxels.data();
  result.type = volume.type;
  result.iso = static_cast<float>(std::clamp<double>(options.iso, -FLT_MAX, FLT_MAX));
  if (static_cast<double>(result.iso) < options.iso) {
    result.iso = std::nextafter(result.iso, std::numeric_limits<float>::infinity());
  }
  FiniteRange finite_range;
  if (volume.type == VoxelType::f32 || volume.type == VoxelType::f64) {
    finite_range = find_finite_range(volume);
    if (!(finite_range.lowest <= finite_range.highest)) {
      throw Error(ErrorCode::input,
                  "Volume '" + volume.name + "' has no finite voxel: it holds nothing to contour.");
    }
    lowest = finite_range.lowest;
    highest = finite_range.highest;
  }
  result.not_finite = finite_range.not_finite;
  double outside_value =
      options.inside == Inside::above ? finite_range.lowest : finite_range.highest;
  // Infinite voxels inside the solid get the value of the deepest finite voxel inside. If no finite
  // voxel is inside, they get the mirror image, at the iso value, of the farthest value outside.
  const bool is_solid_above = options.inside == Inside::above;
  const bool has_infinity_inside =
      (is_solid_above ? finite_range.infinite_count : finite_range.minus_infinite_count) != 0;
  if (has_infinity_inside) {
    const double farthest = is_solid_above ? finite_range.highest : finite_range.lowest;
    const bool has_finite_inside = is_solid_above ? farthest > options.iso : farthest < options.iso;
    result.infinity_value = has_finite_inside ? farthest : 2 * options.iso - outside_value;
  }
  if (has_infinity_inside || (size_of(volume.type) >= 4 && volume.type != VoxelType::f32)) {
    // Voxels are stored as differences to the iso value, so that single precision loses no digits
    // of values near it.
    const auto relative = [&](double value) {
      const double difference = value - options.iso;
      if (std::isnan(difference) || std::isinf(value)) return static_cast<float>(value);
      const auto rounded_difference =
          static_cast<float>(std::clamp<double>(difference, -FLT_MAX, FLT_MAX));
      if (rounded_difference == 0 && difference != 0) return difference < 0 ? -FLT_MIN : FLT_MIN;
      return rounded_difference;
    };
    // Differences too small for a float only matter if all differences are small. Otherwise such
    // voxels can be taken to lie on the surface.
    const bool tiny = finite_range.highest - finite_range.lowest < 1e6 * double{FLT_MIN};
    const auto changes = [&](double value) {
      const double size = std::abs(value - options.iso);
      return size <= DBL_MAX && (size > FLT_MAX || (tiny && size != 0 && size < FLT_MIN));
    };
    std::atomic<std::uint64_t> changed = 0;
    result.converted.resize(voxel_count(volume));
    with_type(volume, [&](const auto* voxels) {
      parallel_for(
          result.converted.size(), kVoxelsPerTask, [&](std::size_t begin, std::size_t end) {
            std::uint64_t count = 0;
            for (std::size_t i = begin; i < end; ++i) {
              auto value = static_cast<double>(voxels[i]);
              if (has_infinity_inside && std::isinf(value) && (value > 0) == is_solid_above) {
                value = result.infinity_value;
              }
              result.converted[i] = relative(value);
              count += changes(value) ? 1 : 0;
            }
            changed += count;
          });
    });
    result.beyond_float = changed;
    result.data = reinterpret_cast<const std::byte*>(result.converted.data());
    result.type = VoxelType::f32;
    result.iso = 0;
    outside_value = relative(outside_value);
  }
  result.outside = std::isfinite(outside_value) ? static_cast<float>(outside_value) : 0.0F;
  return result;
}

void throw_no_surface(const Volume& volume, const ContourOptions& options) {
  const FiniteRange finite_range = find_finite_range(volume);
  if (finite_range.lowest == finite_range.highest) {
    throw Error(ErrorCode::input, "Volume '" + volume.name + "' is constant: every voxel is " +
                                      number(finite_range.lowest) +
                                      ", so there is no surface in it.");
  }
  const bool is_at_end = options.iso == finite_range.lowest || options.iso == finite_range.highest;
  throw Error(ErrorCode::input,
              "The iso value " + number(options.iso) + " is " +
                  (is_at_end ? "at the end of" : "outside") + " the range of volume '" +
                  volume.name + "': its voxels lie between " + number(finite_range.lowest) +
                  " and " + number(finite_range.highest) + ". Give one strictly between them.");
}

}  // namespace kiln
