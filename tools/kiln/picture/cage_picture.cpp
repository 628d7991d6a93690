#include "picture/cage_picture.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "arguments/bake_job.h"
#include "arguments/cage_file.h"
#include "arguments/match_flags.h"
#include "arguments/parse.h"
#include "kiln/cage.h"
#include "kiln/render.h"
#include "picture/canvas.h"

namespace kiln::cli {
namespace {

constexpr Colour kTint = {0.98F, 0.62F, 0.16F}, kEdge = {0.62F, 0.27F, 0.02F};
constexpr float kHides = 0.3F;  // of what lies below
constexpr double kEdgeWidth = 1.5, kEdgeHides = 0.9;
constexpr double kStep = 1;      // pixels along an edge
constexpr double kBehind = 1.5;  // pixels, in depth: an edge lies on its faces

/// Without the inner shell and what no picture needs.
Mesh outer_of(const Mesh& cage) {
  Mesh outer;
  outer.name = cage.name;
  outer.origin = cage.origin;
  outer.positions = cage.positions;
  for (std::size_t t = 0; t < cage.triangles.size(); ++t) {
    const bool inner = !cage.groups.empty() && cage.group_names[cage.groups[t]] == "inner";
    if (!inner) outer.triangles.push_back(cage.triangles[t]);
  }
  return outer;
}

struct Viewed {
  double x = 0, y = 0, depth = 0;
};

Viewed project(const PictureGeometry& geometry, const Mesh& mesh, std::uint32_t vertex) {
  const Vec3& p = mesh.positions[vertex];
  const auto at =
      geometry.project({mesh.origin[0] + p.x, mesh.origin[1] + p.y, mesh.origin[2] + p.z});
  return {at[0], at[1], at[2]};
}

/// Draws the parts of an edge that nothing of the cage lies before.
void draw_edge(const Viewed& a, const Viewed& b, const Image& depth, double behind,
               Canvas& canvas) {
  const double size = std::hypot(b.x - a.x, b.y - a.y);
  if (!std::isfinite(size)) return;
  const auto steps = static_cast<std::size_t>(std::clamp(size / kStep, 1.0, 65536.0));
  const auto at = [&](std::size_t i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    return Viewed{a.x + (b.x - a.x) * share, a.y + (b.y - a.y) * share,
                  a.depth + (b.depth - a.depth) * share};
  };
  const auto seen = [&](const Viewed& p) {
    if (!(p.x >= 0 && p.y >= 0 && p.x < depth.width && p.y < depth.height)) return false;
    return p.depth + behind >=
           double{*depth.at(static_cast<std::size_t>(p.x), static_cast<std::size_t>(p.y))};
  };
  for (std::size_t i = 0; i <= steps; ++i) {
    const Viewed from = at(i);
    if (!seen(from)) continue;
    while (i < steps && seen(at(i + 1))) ++i;
    const Viewed to = at(i);
    canvas.line(from.x, from.y, to.x, to.y, kEdgeWidth, kEdge, kEdgeHides);
  }
}

}  // namespace

Mesh outer_cage(const BakeJob& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings) {
  if (!arguments.cage_mesh.empty()) {
    return outer_of(
        load_cage(arguments.cage_mesh, low, load_options(arguments, MeshSide::low), &warnings));
  }
  const bool automatic = arguments.cage_auto;
  const Length length = arguments.options.match.cage.value_or(Length{});
  if ((automatic || length.relative) && high == nullptr) {
    throw Error(ErrorCode::usage, "--cage " + (automatic ? kAutomatic : length_text(length)) +
                                      " goes by HIGH: add --reference HIGH, or give a length in "
                                      "world units.");
  }
  if (automatic) {
    MatchInputs inputs;
    inputs.read(arguments, *high, low, warnings);
    inputs.make_cage(arguments, device, *high, low, warnings);
    return outer_of(*inputs.cage_mesh());
  }
  const double unit = length.relative ? Source(device, *high).stats().diagonal : 1;
  return outer_of(offset_cage(low, length.value * unit));
}

CagePicture::CagePicture(const Device& device, Mesh cage)
    : mesh_(std::move(cage)), scene_(device, mesh_) {}

void CagePicture::draw(const Scene& within, const RenderOptions& options, Image& picture) const {
  const Image depth = scene_.draw_depth(options), below = within.draw_depth(options);
  for (std::size_t i = 0; i < depth.pixels.size(); ++i) {
    if (!(depth.pixels[i] > Scene::kNoDepth) || depth.pixels[i] < below.pixels[i]) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = picture.pixels[3 * i + c];
      value += kHides * (kTint[c] - value);
    }
  }
  const PictureGeometry geometry = scene_.geometry(options);
  std::vector<Viewed> viewed;
  viewed.reserve(mesh_.positions.size());
  for (std::uint32_t v = 0; v < mesh_.positions.size(); ++v) {
    viewed.push_back(project(geometry, mesh_, v));
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh_.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  Canvas canvas(std::move(picture));
  for (const auto& [a, b] : edges) {
    draw_edge(viewed[a], viewed[b], depth, kBehind * geometry.pixel, canvas);
  }
  picture = canvas.take();
}

}  // namespace kiln::cli
