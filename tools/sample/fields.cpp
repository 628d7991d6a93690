#include "fields.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/volume.h"

namespace kiln::sample {
namespace {

constexpr double kHalfSide = 1.1;  // half the side of the cube that the voxels sample

/// Distance to a box around the origin, positive inside.
double box(const Point& p, const Point& half) {
  const double x = std::abs(p.x) - half.x, y = std::abs(p.y) - half.y, z = std::abs(p.z) - half.z;
  const double outside = std::hypot(std::max(x, 0.0), std::max(y, 0.0), std::max(z, 0.0));
  return -outside - std::min(std::max({x, y, z}), 0.0);
}

/// Rotates a point about z, then about x. Angles in radians.
Point rotate(const Point& p, double about_z, double about_x) {
  const double c = std::cos(about_z), s = std::sin(about_z);
  const Point q{c * p.x + s * p.y, c * p.y - s * p.x, p.z};
  const double d = std::cos(about_x), t = std::sin(about_x);
  return {q.x, d * q.y + t * q.z, d * q.z - t * q.y};
}

template <typename T>
void store_voxel(double value, double highest, std::byte* to) {
  T voxel;
  if constexpr (std::is_floating_point_v<T>) {
    voxel = static_cast<T>(value);
  } else {
    voxel = static_cast<T>(std::lround(std::clamp(value, 0.0, highest)));
  }
  std::memcpy(to, &voxel, sizeof voxel);
}

}  // namespace

double sphere_field(const Point& p) { return 0.9 - std::hypot(p.x, p.y, p.z); }

double torus_field(const Point& p) { return 0.25 - std::hypot(std::hypot(p.x, p.y) - 0.65, p.z); }

double gyroid_field(const Point& p) {
  constexpr double kRadiansPerUnit = 3 * std::numbers::pi;
  constexpr double kHalfThickness = 0.06;
  const double x = kRadiansPerUnit * p.x, y = kRadiansPerUnit * p.y, z = kRadiansPerUnit * p.z;
  const double sx = std::sin(x), sy = std::sin(y), sz = std::sin(z);
  const double cx = std::cos(x), cy = std::cos(y), cz = std::cos(z);
  const double value = sx * cy + sy * cz + sz * cx;
  const double slope =
      kRadiansPerUnit * std::hypot(cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz);
  const double sheet = kHalfThickness - std::abs(value) / std::max(slope, kRadiansPerUnit * 0.5);
  return std::min(sheet, 0.95 - std::hypot(p.x, p.y, p.z));
}

double boxes_field(const Point& p) {
  const double body = box(p, {0.55, 0.45, 0.5});
  const double bar = box(rotate(p, 0.5, 0.35), {0.85, 0.2, 0.25});
  const double slot = box(rotate(p - Point{0.1, 0, 0.5}, -0.4, 0.0), {0.18, 1.2, 0.25});
  const double step = box(p - Point{-0.55, -0.45, 0.5}, {0.3, 0.25, 0.35});
  return std::min({std::max(body, bar), -slot, -step});
}

std::optional<Field> field_of(std::string_view name) {
  static constexpr std::pair<std::string_view, Field> kFields[] = {{"sphere", sphere_field},
                                                                   {"torus", torus_field},
                                                                   {"gyroid", gyroid_field},
                                                                   {"boxes", boxes_field}};
  for (const auto& [known, field] : kFields) {
    if (known == name) return field;
  }
  return std::nullopt;
}

double surface_value(VoxelType type) {
  return type == VoxelType::u8 ? 127.5 : type == VoxelType::u16 ? 32767.5 : 0;
}

Volume sample_volume(Field field, std::uint32_t size, VoxelType type) {
  if (type != VoxelType::u8 && type != VoxelType::u16 && type != VoxelType::f32) {
    throw Error(ErrorCode::usage, std::string("a volume of ") + name_of(type) +
                                      " cannot be sampled; choose u8, u16 or f32");
  }
  if (size < 2) throw Error(ErrorCode::usage, "a volume needs 2 voxels along an axis, or more");
  Volume volume;
  volume.size = {size, size, size};
  volume.type = type;
  const double spacing = 2 * kHalfSide / (size - 1);
  volume.origin = {-kHalfSide, -kHalfSide, -kHalfSide};
  for (std::size_t a = 0; a < 3; ++a) {
    volume.axes[a] = {};
    volume.axes[a][a] = spacing;
  }
  const std::size_t each = size_of(type), row = std::size_t{size} * each;
  volume.voxels.resize(row * size * size);
  const double middle = surface_value(type);
  const double scale = type == VoxelType::f32 ? 1 : middle / (4 * spacing);
  std::atomic<std::uint32_t> next{0};
  const auto work = [&] {
    const auto at = [spacing](std::uint32_t i) { return i * spacing - kHalfSide; };
    for (std::uint32_t z = next++; z < size; z = next++) {
      for (std::uint32_t y = 0; y < size; ++y) {
        std::byte* to = volume.voxels.data() + (std::size_t{z} * size + y) * row;
        for (std::uint32_t x = 0; x < size; ++x, to += each) {
          const double value = middle + scale * field({at(x), at(y), at(z)});
          if (type == VoxelType::f32) {
            store_voxel<float>(value, 0, to);
          } else if (type == VoxelType::u8) {
            store_voxel<std::uint8_t>(value, 255, to);
          } else {
            store_voxel<std::uint16_t>(value, 65535, to);
          }
        }
      }
    }
  };
  std::vector<std::thread> threads(std::max(1u, std::thread::hardware_concurrency()) - 1);
  for (std::thread& thread : threads) thread = std::thread(work);
  work();
  for (std::thread& thread : threads) thread.join();
  return volume;
}

}  // namespace kiln::sample
