// Cages. As text: LOW and its cage as OBJ, an empty line between them. Else, after a first byte below 8 (LOW's number of
// triangles less one): the floats of a cage as an image. Either gives corners for each triangle of LOW, or kiln::Error.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "asset/mesh_reader.h"
#include "job/match_inputs.h"
#include "kiln/error.h"
#include "mesh/cage.h"

namespace {

kiln::Mesh strip(std::uint32_t triangles) {
  kiln::Mesh mesh;
  for (std::uint32_t v = 0; v < triangles + 2; ++v) {
    mesh.positions.push_back({static_cast<float>(v / 2), static_cast<float>(v % 2), 0});
  }
  for (std::uint32_t t = 0; t < triangles; ++t) mesh.triangles.push_back({t, t + 1, t + 2});
  return mesh;
}

void check(const kiln::Mesh& low, const kiln::Mesh& cage, bool image) {
  const kiln::CageCorners corners = kiln::read_cage(low, cage, kiln::Frame::of(low));
  const std::size_t count = 3 * low.triangles.size();
  const bool hull = corners.kind == kiln::CageKind::hull;
  const bool shells = corners.kind == kiln::CageKind::shells;
  if (hull != (corners.hull != nullptr) || corners.outer_corners.size() != (hull ? 0 : count) ||
      corners.inner_corners.size() != (shells ? count : 0) || (image && !shells)) {
    std::abort();
  }
}

void take_image(const std::uint8_t* data, std::size_t size) {
  const kiln::Mesh low = strip(data[0] + 1U);
  kiln::Image image;
  image.width = static_cast<std::uint32_t>(low.positions.size());
  image.height = 2;
  image.channels = 4;
  image.pixels.resize(std::size_t{image.width} * image.height * image.channels);
  std::memcpy(image.pixels.data(), data + 1, std::min(size - 1, 4 * image.pixels.size()));
  check(low, kiln::cage_from_image(image, "input", low), true);
}

void take_text(std::string_view text) {
  const std::size_t end = text.find("\n\n");
  if (end == std::string_view::npos) return;
  const auto mesh = [](std::string_view bytes) {
    std::vector<kiln::Warning> warnings;
    return kiln::parse_mesh({"input", bytes, &warnings}, kiln::MeshFormat::obj);
  };
  const kiln::Mesh low = mesh(text.substr(0, end)), cage = mesh(text.substr(end + 2));
  check(low, cage, false);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    if (size > 0 && data[0] < 8) {
      take_image(data, size);
    } else {
      take_text({reinterpret_cast<const char*>(data), size});
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
