#include "render/render.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/formatted.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/low_shading.h"
#include "mesh/low_surface.h"
#include "mesh/normals.h"
#include "mesh/steps.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTilePixels = KILN_RENDER_TILE * KILN_RENDER_TILE;
/// Pictures are drawn in sections of tiles, each with at most this many samples, which bounds the device memory.
constexpr std::uint32_t kMaxSamplesPerSection = 1 << 20;
constexpr double kMinZoom = 0.01, kMaxZoom = 1e5;
/// Maximum distance of occluders, as a share of the length of the picture's longer side.
constexpr double kMaxOccluderShare = 0.4;

template <typename T>
cl::Array<T> upload_array(cl::Context& context, const T* data, std::size_t size) {
  return {context, std::span<const T>(data, size)};
}

cl::Array<std::uint32_t> upload_array(cl::Context& context,
                                      const std::vector<Triangle>& triangles) {
  return upload_array(context, triangles.data()->data(), triangles.size() * 3);
}

cl::Array<float> upload_array(cl::Context& context, const std::vector<Vec3>& vectors) {
  return upload_array(context, &vectors.data()->x, vectors.size() * 3);
}

/// Returns evenly distributed points of the unit disc, x and y of each (Vogel 1979). Projected up to the hemisphere,
/// they are cosine-distributed directions.
std::vector<float> vogel_disc(std::size_t count) {
  constexpr double kGoldenAngle = 2.39996322972865332;
  std::vector<float> result(2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const double k = static_cast<double>(i);
    const double radius = std::sqrt((k + 0.5) / static_cast<double>(count));
    result[2 * i] = static_cast<float>(radius * std::cos(k * kGoldenAngle));
    result[2 * i + 1] = static_cast<float>(radius * std::sin(k * kGoldenAngle));
  }
  return result;
}

void assign(kiln_float (&target)[3], const Vec3d& source) {
  target[0] = static_cast<float>(source.x);
  target[1] = static_cast<float>(source.y);
  target[2] = static_cast<float>(source.z);
}

/// Device arrays for one section of the picture, a range of tiles.
struct PictureSection {
  cl::Array<float> points;   ///< Ray data in 7 planes; see RayCaster
  cl::Array<float> surface;  ///< Surface data in KILN_SURFACE_PLANES planes
  cl::Array<std::uint8_t> hit, open;
  cl::Array<float> colors;  ///< Colours, [3 * pixels]
  DeviceCorrespondence match;

  PictureSection(cl::Context& context, std::uint32_t samples, std::uint32_t pixels)
      : points(context, std::size_t{7} * samples),
        surface(context, std::size_t{KILN_SURFACE_PLANES} * samples),
        hit(context, samples),
        open(context, samples),
        colors(context, std::size_t{3} * pixels),
        match(context, samples) {}
};

}  // namespace

void check_render(const RenderOptions& options) {
  const auto require = [](bool fits, const std::string& message) {
    if (!fits) throw Error(ErrorCode::usage, message);
  };
  require(options.size >= 1 && options.size <= 8192,
          "The picture's size is " + std::to_string(options.size) + ": use 1 to 8192 pixels.");
  require(options.samples >= 1 && options.samples <= 16,
          "The number of samples per side of a pixel is " + std::to_string(options.samples) +
              ": use 1 to 16.");
  require(options.ambient_rays <= 255, "The number of rays per pixel for ambient occlusion is " +
                                           std::to_string(options.ambient_rays) +
                                           ": use 0 (none) to 255.");
  require(std::isfinite(options.azimuth_degrees) && std::abs(options.azimuth_degrees) <= 1e6,
          "The view's azimuth is " + decimal(options.azimuth_degrees) +
              ": use a finite number of degrees, such as 30.");
  require(options.elevation_degrees >= -90 && options.elevation_degrees <= 90,
          "The view's elevation is " + decimal(options.elevation_degrees) +
              ": use -90 (from below) to 90 (from above) degrees.");
  require(options.zoom >= kMinZoom && options.zoom <= kMaxZoom,
          "The picture's zoom is " + decimal(options.zoom) +
              ": use 0.01 to 100000; 1 shows all of the mesh.");
  require(!options.at || std::all_of(options.at->begin(), options.at->end(),
                                     [](double x) { return std::isfinite(x); }),
          "The point at the picture's centre is not finite: give three finite coordinates.");
}

kiln_render_params camera_params(const Camera& camera, const Frame& frame,
                                 const RenderOptions& options) {
  kiln_render_params params{};
  const Vec3d picture_center =
      Vec3d(camera.center[0] - frame.center[0], camera.center[1] - frame.center[1],
            camera.center[2] - frame.center[2]) *
      frame.scale;
  const double pixel = camera.pixel() * frame.scale;
  assign(params.right, camera.right);
  assign(params.up, camera.up);
  assign(params.toward, camera.toward);
  params.left_edge =
      static_cast<float>(dot(picture_center, camera.right) - pixel * camera.width / 2);
  params.top_edge = static_cast<float>(dot(picture_center, camera.up) + pixel * camera.height / 2);
  params.pixel = static_cast<float>(pixel);
  params.width = camera.width;
  params.height = camera.height;
  assign(params.key, camera.key);
  const Vec3d half_vector = camera.key + Vec3d{0, 0, 1};
  assign(params.half_way, half_vector * (1 / length(half_vector)));
  params.samples = options.samples;
  params.tile_columns = (camera.width + KILN_RENDER_TILE - 1) / KILN_RENDER_TILE;
  params.flat = options.flat ? 1 : 0;
  params.show_normals = options.show_normals ? 1 : 0;
  params.show_colors = options.show_colors ? 1 : 0;
  return params;
}

void copy_pixels_to_picture(const std::vector<float>& colors, const kiln_render_params& params,
                            Image& image) {
  for (std::uint32_t i = 0; i < params.pixel_count; ++i) {
    const std::uint32_t tile = params.first_tile + i / kTilePixels;
    const std::uint32_t index_in_tile = i % kTilePixels;
    const std::uint32_t x =
        tile % params.tile_columns * KILN_RENDER_TILE + index_in_tile % KILN_RENDER_TILE;
    const std::uint32_t y =
        tile / params.tile_columns * KILN_RENDER_TILE + index_in_tile / KILN_RENDER_TILE;
    if (x < params.width && y < params.height) {
      std::copy_n(&colors[std::size_t{3} * i], 3, image.at(x, y));
    }
  }
}

Scene::Impl::Impl(const Device& opened, const Mesh& mesh, const NormalMap& normal_map)
    : device(opened) {
  if (mesh.triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + mesh.name +
                    "' has no triangles, so there is nothing to draw. Check that the file holds "
                    "faces and not points alone.");
  }
  target = CameraTarget::of(mesh);
  cl::Context& context = context_of(device);
  const std::vector<Vec3> local_positions = target.local_frame.to_frame(mesh);
  rays = std::make_unique<RayCaster>(context, local_positions, mesh.triangles);
  const std::uint64_t skipped = rays->stats().skipped;
  if (skipped == mesh.triangles.size()) {
    throw Error(ErrorCode::input,
                (skipped == 1 ? "The only triangle of '" + mesh.name + "' has no area, or has"
                              : "All " + std::to_string(skipped) + " triangles of '" + mesh.name +
                                    "' have no area, or have") +
                    " non-finite corners, so there is nothing to draw. "
                    "Check the file's coordinates.");
  }
  if (skipped != 0) {
    warnings.push_back(
        {"mesh-skipped",
         std::to_string(skipped) + " of " + std::to_string(mesh.triangles.size()) +
             " triangles of '" + mesh.name + "' " +
             (skipped == 1 ? "has no area, or has non-finite corners; it is not drawn."
                           : "have no area, or have non-finite corners; they are not drawn."),
         skipped});
  }
  if (const std::string coarse = coarse_steps(mesh, target.local_frame); !coarse.empty()) {
    warnings.push_back({"coarse-source", "'" + mesh.name + "': " + coarse, 1});
  }
  positions = upload_array(context, local_positions);
  position_indices = upload_array(context, mesh.triangles);
  const CornerNormals corners = corner_normals(mesh, local_positions);
  normals = upload_array(context, corners.normals);
  normal_indices = upload_array(context, corners.triangles);
  if (normal_map.image != nullptr) upload_map(mesh, normal_map);
}

void Scene::Impl::upload_map(const Mesh& mesh, const NormalMap& normal_map) {
  const Image& image = *normal_map.image;
  const std::size_t texel_count = std::size_t{image.width} * image.height;
  if (texel_count == 0 || image.channels < 3 ||
      image.pixels.size() != texel_count * image.channels) {
    throw Error(ErrorCode::input, "The normal map is " + std::to_string(image.width) + "x" +
                                      std::to_string(image.height) + " with " +
                                      std::to_string(image.channels) +
                                      " channels: give an image with red, green and blue.");
  }
  if (mesh.uv_triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + mesh.name +
                    "' has no texture coordinates, so a normal map cannot be applied to it. Unwrap "
                    "it first, or leave the map out.");
  }
  cl::Context& context = context_of(device);
  const LowSurface surface = LowSurface::of(mesh, target.local_frame);
  shading =
      cl::Array<kiln_low_shading>(context, std::span<const kiln_low_shading>(low_shading(surface)));
  std::vector<float> corner_uvs;
  corner_uvs.reserve(surface.triangles.size() * 6);
  for (const auto& corners : surface.triangles) {
    for (const LowSurface::Corner& corner : corners) {
      corner_uvs.push_back(corner.uv.x);
      corner_uvs.push_back(corner.uv.y);
    }
  }
  uvs = upload_array(context, corner_uvs.data(), corner_uvs.size());

  std::vector<std::uint16_t> quantised_texels(texel_count * 3);
  parallel_for(texel_count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    constexpr float kFlat[3] = {0.5F, 0.5F, 1};
    for (std::size_t i = begin; i < end; ++i) {
      const float* texel = &image.pixels[i * image.channels];
      const bool finite =
          std::isfinite(texel[0]) && std::isfinite(texel[1]) && std::isfinite(texel[2]);
      const float* direction = finite ? texel : kFlat;
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = std::clamp(direction[c], 0.0F, 1.0F) * KILN_RENDER_MAP_ONE;
        const float rounded = value + 0.5F;
        quantised_texels[i * 3 + c] = static_cast<std::uint16_t>(rounded);
      }
    }
  });
  map = upload_array(context, quantised_texels.data(), quantised_texels.size());
  map_params.width = image.width;
  map_params.height = image.height;
  map_params.y_scale = normal_map.flip_y ? -1.0F : 1.0F;
  switch (normal_map.space) {
    case NormalMapSpace::tangent:
      map_params.space = normal_map.bitangent == Bitangent::vertex ? KILN_SPACE_TANGENT_VERTEX
                                                                   : KILN_SPACE_TANGENT;
      break;
    case NormalMapSpace::object:
      map_params.space = KILN_SPACE_OBJECT;
      break;
    case NormalMapSpace::face:
      map_params.space = KILN_SPACE_FACE;
      break;
  }
  has_map = true;
}

Camera Scene::Impl::camera(const RenderOptions& options) const {
  return Camera::fit(options.frame == nullptr ? target : CameraTarget::of(*options.frame), options);
}

Image Scene::Impl::draw(const RenderOptions& options) const {
  check_render(options);
  if (options.show_colors && (!has_map || options.ignore_map || options.flat)) {
    throw Error(
        ErrorCode::usage,
        "The colours of a map were requested, but there is no map, or it is disabled: give a map.");
  }
  return trace(camera(options), options, false);
}

Image Scene::Impl::draw_depth(const RenderOptions& options) const {
  check_render(options);
  RenderOptions depth_options = options;
  depth_options.samples = 1;
  depth_options.ambient_rays = 0;
  const Camera depth_camera = camera(options);
  // The first channel is the depth in the local frame; the second is positive where the mesh is visible.
  const Image local_depth = trace(depth_camera, depth_options, true);
  const Frame& frame = target.local_frame;
  const Vec3d picture_center = {depth_camera.center[0] - frame.center[0],
                                depth_camera.center[1] - frame.center[1],
                                depth_camera.center[2] - frame.center[2]};
  const double center_depth = dot(picture_center, depth_camera.toward);
  Image depth{local_depth.width, local_depth.height, 1, {}};
  depth.pixels.reserve(local_depth.pixels.size() / 3);
  for (std::size_t i = 0; i < local_depth.pixels.size(); i += 3) {
    const float* pixel = &local_depth.pixels[i];
    depth.pixels.push_back(pixel[1] > 0 ? static_cast<float>(pixel[0] / frame.scale - center_depth)
                                        : kNoDepth);
  }
  return depth;
}

Image Scene::Impl::trace(const Camera& camera, const RenderOptions& options, bool depth) const {
  kiln_render_params params = camera_params(camera, target.local_frame, options);
  const std::uint32_t samples_per_pixel = options.samples * options.samples;
  if (depth) {
    params.show_depth = 1;
    params.show_normals = params.show_colors = 0;
  } else if (!options.show_normals && !options.show_colors) {
    params.ambient_passes = (options.ambient_rays + samples_per_pixel - 1) / samples_per_pixel;
  }

  const std::uint32_t samples_per_tile = kTilePixels * samples_per_pixel;
  const std::uint32_t tiles =
      params.tile_columns * ((camera.height + KILN_RENDER_TILE - 1) / KILN_RENDER_TILE);
  const std::uint32_t tiles_per_section = std::min(tiles, kMaxSamplesPerSection / samples_per_tile);
  params.capacity = tiles_per_section * samples_per_tile;

  // The peak memory is checked before anything is allocated: the picture itself, and for one section the samples on the
  // device, and the colours on device and host.
  constexpr std::uint64_t kBytesPerSample =
      7 * sizeof(float) + KILN_SURFACE_PLANES * sizeof(float) + 2 + 17;
  // Bytes that PoCL itself allocates to run the kernels
  constexpr std::uint64_t kLaunchBytes = 12 << 20;
  require_memory("The picture",
                 kLaunchBytes + std::uint64_t{camera.width} * camera.height * 3 * sizeof(float) +
                     kBytesPerSample * params.capacity +
                     std::uint64_t{6} * sizeof(float) * tiles_per_section * kTilePixels);
  cl::Context& context = context_of(device);
  PictureSection section(context, params.capacity, tiles_per_section * kTilePixels);
  const std::vector<float> disc =
      vogel_disc(std::max(1U, params.ambient_passes) * std::size_t{samples_per_pixel});
  const cl::Array<float> device_disc = upload_array(context, disc.data(), disc.size());

  RayQuery surface_ray;
  // Rays reach through the bounding sphere of the mesh, whose radius in the local frame is 0.5: the kernel starts them
  // in a plane at a distance of 0.75 from the sphere's centre.
  surface_ray.t_max = 1.5F;
  surface_ray.two_sided = true;
  RayQuery occlusion_ray;
  occlusion_ray.t_min = 5e-5F;
  // Without the lower bound, the maximum distance of occluders would be below t_min, the minimum distance, in an
  // extreme close-up.
  occlusion_ray.t_max =
      std::max(occlusion_ray.t_min,
               static_cast<float>(std::min(
                   2.0, kMaxOccluderShare * 2 * camera.half_side * target.local_frame.scale)));
  occlusion_ray.two_sided = true;

  Image image{camera.width, camera.height, 3, {}};
  image.pixels.resize(std::size_t{camera.width} * camera.height * 3);
  std::vector<float> colors(section.colors.size());
  for (params.first_tile = 0; params.first_tile < tiles; params.first_tile += tiles_per_section) {
    params.pixel_count = std::min(tiles_per_section, tiles - params.first_tile) * kTilePixels;
    params.sample_count = params.pixel_count * samples_per_pixel;
    const std::uint32_t count = params.sample_count;
    context.launch(context.kernel("render", "kiln_render_write_camera_rays"), count, kLocal, params,
                   section.points);
    rays->intersect(section.points, count, params.capacity, surface_ray, section.match);
    context.launch(context.kernel("render", "kiln_render_compute_surface"), count, kLocal, params,
                   section.match.triangle, section.match.barycentric, position_indices, positions,
                   normal_indices, normals, section.surface);
    // Ambient occlusion is computed around the mesh's own normal, before the normal map is applied.
    for (kiln_uint pass = 0; pass < params.ambient_passes; ++pass) {
      context.launch(context.kernel("render", "kiln_render_write_ambient_rays"), count, kLocal,
                     params, pass, section.match.triangle, section.surface, device_disc,
                     section.points);
      rays->occluded(section.points, count, params.capacity, occlusion_ray, section.hit);
      context.launch(context.kernel("render", "kiln_render_count_open"), count, kLocal, params,
                     pass, section.hit, section.open);
    }
    if (has_map && !options.ignore_map && !options.flat && !depth) {
      kiln_render_map_params with_map = map_params;
      with_map.count = count;
      with_map.capacity = params.capacity;
      if (options.show_colors) with_map.space = KILN_RENDER_COLORS;
      context.launch(context.kernel("render", "kiln_render_apply_map"), count, kLocal, with_map,
                     section.match.triangle, section.match.barycentric, shading, uvs, map,
                     section.surface);
    }
    context.launch(context.kernel("render", "kiln_render_shade"), params.pixel_count, kLocal,
                   params, section.match.triangle, section.surface, section.open, section.colors);
    section.colors.read(context, std::span(colors).first(std::size_t{3} * params.pixel_count));
    copy_pixels_to_picture(colors, params, image);
  }
  return image;
}

Scene::Scene(const Device& device, const Mesh& mesh, const NormalMap& map)
    : impl_(std::make_shared<const Impl>(device, mesh, map)) {}

Image Scene::draw(const RenderOptions& options) const { return impl_->draw(options); }

PictureGeometry Scene::geometry(const RenderOptions& options) const {
  check_render(options);
  const Camera camera = impl_->camera(options);
  const auto axis = [](const Vec3d& v) { return std::array<double, 3>{v.x, v.y, v.z}; };
  return {camera.width,        camera.height, axis(camera.right), axis(camera.up),
          axis(camera.toward), camera.center, camera.pixel()};
}

Image Scene::draw_depth(const RenderOptions& options) const { return impl_->draw_depth(options); }

const std::vector<Warning>& Scene::warnings() const { return impl_->warnings; }

Image render(const Device& device, const Mesh& mesh, const RenderOptions& options,
             const NormalMap& map) {
  return Scene(device, mesh, map).draw(options);
}

}  // namespace kiln
