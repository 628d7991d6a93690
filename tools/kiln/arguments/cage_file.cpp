#include "arguments/cage_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "arguments/parse.h"

namespace kiln::cli {
namespace {

constexpr std::size_t kRow = 4096;
constexpr float kNoVertex = -1;

bool is_image(const std::filesystem::path& path) { return lower_extension(path) == ".exr"; }

std::array<double, 3> way(const Vec3& from, const Vec3& to) {
  return {double{to.x} - from.x, double{to.y} - from.y, double{to.z} - from.z};
}

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// All vertices of one shell, an image's half.
struct Grid {
  std::uint32_t width = 0, rows = 0;

  explicit Grid(std::size_t vertices)
      : width(static_cast<std::uint32_t>(std::min(vertices, kRow))),
        rows(static_cast<std::uint32_t>((vertices + kRow - 1) / kRow)) {}
  std::size_t pixels() const { return std::size_t{width} * rows; }
};

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& problem) {
  throw Error(ErrorCode::input, "'" + path.string() + "' is no cage of LOW: " + problem +
                                    ". Save one with --cage auto --save-cage FILE.exr.");
}

Image image_of(const Mesh& cage, const Mesh& low) {
  const std::size_t count = low.positions.size();
  const Grid grid(count);
  Image image;
  image.width = grid.width;
  image.height = 2 * grid.rows;
  image.channels = 4;
  for (std::size_t shell = 0; shell < 2; ++shell) {
    for (std::size_t v = 0; v < grid.pixels(); ++v) {
      if (v >= count) {
        image.pixels.insert(image.pixels.end(), {0, 0, 0, kNoVertex});
        continue;
      }
      const Vec3 &at = low.positions[v], &outer = cage.positions[v],
                 &inner = cage.positions[count + v];
      std::array<double, 3> direction = way(inner, outer);
      const double size = std::sqrt(dot(direction, direction));
      std::array<float, 3> unit{};
      for (std::size_t k = 0; k < 3 && size > 0; ++k) {
        unit[k] = static_cast<float>(direction[k] / size);
        direction[k] = double{unit[k]};
      }
      const std::array<double, 3> off = shell == 0 ? way(at, outer) : way(inner, at);
      const double distance = size > 0 ? dot(off, direction) / dot(direction, direction) : 0;
      image.pixels.insert(image.pixels.end(),
                          {unit[0], unit[1], unit[2], static_cast<float>(distance)});
    }
  }
  return image;
}

}  // namespace

void save_cage(const Mesh& cage, const Mesh& low, const std::filesystem::path& path) {
  if (is_image(path)) {
    save_image(image_of(cage, low), path, {ImageFormat::exr_float});
  } else {
    save_obj(cage, path);
  }
}

Mesh cage_of(const Image& image, const std::filesystem::path& path, const Mesh& low) {
  const std::size_t count = low.positions.size();
  const Grid grid(count);
  if (image.channels != 4) {
    fail(path, "it has " + std::to_string(image.channels) + " channels, and a cage has 4");
  }
  if (image.width != grid.width || image.height != 2 * grid.rows) {
    fail(path, "it has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                   " pixels, but LOW's " + std::to_string(count) + " vertices need " +
                   std::to_string(grid.width) + " x " + std::to_string(2 * grid.rows));
  }
  Mesh cage;
  cage.name = path.stem().string();
  cage.origin = low.origin;
  cage.group_names = {"outer", "inner"};
  for (std::uint32_t shell = 0; shell < 2; ++shell) {
    const auto pixel = [&](std::size_t v) {
      return &image.pixels[4 * (shell * grid.pixels() + v)];
    };
    std::size_t held = grid.pixels();
    while (held > 0 && pixel(held - 1)[3] == kNoVertex) --held;
    if (held != count) {
      fail(path, "it has " + std::to_string(held) + " vertices, and LOW " + std::to_string(count));
    }
    for (std::size_t v = 0; v < count; ++v) {
      const float* p = pixel(v);
      if (p[3] == kNoVertex) {
        fail(path, std::string("the ") + (shell == 0 ? "outer" : "inner") + " pixel of vertex " +
                       std::to_string(v) + " has the alpha -1, which stands for no vertex");
      }
      if (!std::all_of(p, p + 4, [](float x) { return std::isfinite(x); })) {
        fail(path, std::string("the ") + (shell == 0 ? "outer" : "inner") + " pixel of vertex " +
                       std::to_string(v) + " is NaN or infinite");
      }
      const double by = shell == 0 ? double{p[3]} : -double{p[3]};
      const Vec3& at = low.positions[v];
      cage.positions.push_back({static_cast<float>(double{at.x} + p[0] * by),
                                static_cast<float>(double{at.y} + p[1] * by),
                                static_cast<float>(double{at.z} + p[2] * by)});
    }
    const auto first = static_cast<std::uint32_t>(shell * count);
    for (const Triangle& t : low.triangles) {
      cage.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      cage.groups.push_back(shell);
    }
  }
  return cage;
}

Mesh load_cage(const std::filesystem::path& path, const Mesh& low, const LoadMeshOptions& options,
               std::vector<Warning>* warnings) {
  return is_image(path) ? cage_of(load_image(path), path, low) : load_mesh(path, options, warnings);
}

}  // namespace kiln::cli
