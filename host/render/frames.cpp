// Draws frames with a z-buffer, as real-time renderers do, and measures their cost (Wang, Froehlich, Goebel 2003,
// figure 7; Barry and Wood 2007, table 1).
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string>

#include "accel/raster.h"
#include "render/render.h"

namespace kiln {
namespace {

constexpr std::uint32_t kFrameTilePixels = KILN_RENDER_TILE * KILN_RENDER_TILE;
constexpr std::uint32_t kMaxFrameSide = 2048;
constexpr std::uint32_t kWarmUpFrames = 2;  // drawn before the frames that are timed

void check_frame(const RenderOptions& options) {
  check_render(options);
  const auto refuse = [](const std::string& message) { throw Error(ErrorCode::usage, message); };
  if (options.size > kMaxFrameSide) {
    refuse("The size of a frame is " + std::to_string(options.size) +
           " pixels a side: use 1 to 2048.");
  }
  if (options.show_colors) refuse("Frames are always lit: leave out the option show_colors.");
  if (options.zoom != 1 || options.at)
    refuse("Frames show the whole mesh: leave out the options 'zoom' and 'at'.");
}

/// Converts the camera to a depth view with the picture's pixels, for the rasterizer. The picture's edges are rounded
/// to multiples of 1 / KILN_RASTER_UNIT pixel.
kiln_view depth_view_of(const kiln_render_params& params) {
  kiln_view view{};
  std::copy_n(params.right, 3, view.right);
  std::copy_n(params.up, 3, view.up);
  std::copy_n(params.toward, 3, view.toward);
  const auto snapped = [](double pixels) {
    return static_cast<float>(std::nearbyint(pixels * KILN_RASTER_UNIT) / KILN_RASTER_UNIT);
  };
  view.scale = 1 / params.pixel;
  view.left = snapped(-double{params.left_edge} / params.pixel);
  view.top = snapped(double{params.top_edge} / params.pixel);
  view.width = params.width;
  view.height = params.height;
  view.flags = KILN_RASTER_TWO_SIDED;
  return view;
}

std::vector<Vec3> to_vectors(const std::vector<float>& numbers) {
  std::vector<Vec3> result(numbers.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  }
  return result;
}

std::vector<Triangle> triangles_of(const std::vector<std::uint32_t>& numbers) {
  std::vector<Triangle> result(numbers.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  }
  return result;
}

/// Draws frames of one size, and owns the device arrays that they need.
class FramePainter {
 public:
  FramePainter(const Scene::Impl& scene, const RenderOptions& options)
      : scene_(scene),
        context_(context_of(scene.device)),
        with_map_(scene.has_map && !options.ignore_map && !options.flat),
        rasterizer_(context_, to_vectors(scene.positions.download(context_)),
                    triangles_of(scene.position_indices.download(context_))) {
    grow(options.size, options.size);
  }

  bool with_map() const { return with_map_; }

  /// Makes the parameters of a frame's kernels, for a camera that shows the target.
  /// \param options  must have the size with which the painter was created
  kiln_render_params place_camera(const CameraTarget& target, const RenderOptions& options) const {
    RenderOptions single_sample_options = options;
    single_sample_options.samples = 1;
    kiln_render_params params = camera_params(Camera::fit(target, single_sample_options),
                                              scene_.target.local_frame, single_sample_options);
    const std::uint32_t rows = (params.height + KILN_RENDER_TILE - 1) / KILN_RENDER_TILE;
    params.pixel_count = params.sample_count = params.tile_columns * rows * kFrameTilePixels;
    params.capacity = sample_capacity_;
    return params;
  }

  /// Enqueues the kernels of a frame, without waiting for them.
  void draw(const kiln_render_params& params) {
    const kiln_view view = depth_view_of(params);
    rasterizer_.draw({&view, 1}, depth_keys_);
    const std::uint32_t count = params.pixel_count;
    context_.launch(context_.kernel("render", "kiln_render_convert_keys"), count, kLocal, params,
                    depth_keys_.keys, depth_keys_.drawn, scene_.position_indices, scene_.positions,
                    hits_.triangle, hits_.barycentric);
    context_.launch(context_.kernel("render", "kiln_render_compute_surface"), count, kLocal, params,
                    hits_.triangle, hits_.barycentric, scene_.position_indices, scene_.positions,
                    scene_.normal_indices, scene_.normals, surface_);
    if (with_map_) {
      kiln_render_map_params map = scene_.map_params;
      map.count = count;
      map.capacity = params.capacity;
      context_.launch(context_.kernel("render", "kiln_render_apply_map"), count, kLocal, map,
                      hits_.triangle, hits_.barycentric, scene_.shading, scene_.uvs, scene_.map,
                      surface_);
    }
    context_.launch(context_.kernel("render", "kiln_render_shade"), count, kLocal, params,
                    hits_.triangle, surface_, unoccluded_, colors_);
  }

  void wait_for_kernels() { context_.finish(); }

  std::vector<float> colors() { return colors_.download(context_); }

 private:
  void grow(std::uint32_t width, std::uint32_t height) {
    const auto tiles = [](std::uint32_t pixels) {
      return (pixels + KILN_RENDER_TILE - 1) / KILN_RENDER_TILE;
    };
    sample_capacity_ = tiles(width) * tiles(height) * kFrameTilePixels;
    depth_keys_ = DepthKeys(context_, DepthKeys::count(width, height));
    hits_ = DeviceCorrespondence(context_, sample_capacity_);
    surface_ = cl::Array<float>(context_, std::size_t{KILN_SURFACE_PLANES} * sample_capacity_);
    unoccluded_ = cl::Array<std::uint8_t>(context_, sample_capacity_);
    colors_ = cl::Array<float>(context_, std::size_t{3} * sample_capacity_);
  }

  const Scene::Impl& scene_;
  cl::Context& context_;
  bool with_map_;
  Rasterizer rasterizer_;
  std::uint32_t sample_capacity_ = 0;
  DepthKeys depth_keys_;
  DeviceCorrespondence hits_;
  cl::Array<float> surface_, colors_;
  cl::Array<std::uint8_t> unoccluded_;
};

/// Returns what the camera shows: RenderOptions::frame, or the scene's own mesh.
CameraTarget select_target(const Scene::Impl& scene, const RenderOptions& options) {
  return options.frame == nullptr ? scene.target : CameraTarget::of(*options.frame);
}

/// Counts the vertices that a renderer would process: the different combinations of position, normal and, with a map,
/// UV at the corners of triangles; see FrameCost::vertices.
std::uint64_t count_vertices(const Scene::Impl& scene, bool with_map) {
  cl::Context& context = context_of(scene.device);
  const std::vector<std::uint32_t> position = scene.position_indices.download(context);
  const std::vector<std::uint32_t> normal = scene.normal_indices.download(context);
  std::vector<float> uv;
  if (with_map) uv = scene.uvs.download(context);
  using CornerKey = std::array<std::uint64_t, 2>;
  std::vector<CornerKey> corners(position.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = {std::uint64_t{position[i]} << 32 | normal[i], 0};
    if (!with_map) continue;
    std::uint32_t bits[2];
    std::memcpy(bits, &uv[2 * i], sizeof bits);
    corners[i][1] = std::uint64_t{bits[0]} << 32 | bits[1];
  }
  std::sort(corners.begin(), corners.end());
  return static_cast<std::uint64_t>(std::unique(corners.begin(), corners.end()) - corners.begin());
}

}  // namespace

Image Scene::Impl::rasterise(const RenderOptions& options) const {
  check_frame(options);
  FramePainter painter(*this, options);
  const kiln_render_params params = painter.place_camera(select_target(*this, options), options);
  painter.draw(params);
  Image image{params.width, params.height, 3, {}};
  image.pixels.resize(std::size_t{params.width} * params.height * 3);
  copy_pixels_to_picture(painter.colors(), params, image);
  return image;
}

FrameCost Scene::Impl::time_frames(const RenderOptions& options, std::uint32_t frames) const {
  check_frame(options);
  if (frames < 1 || frames > 1000) {
    throw Error(ErrorCode::usage,
                "The number of frames to time is " + std::to_string(frames) + ": use 1 to 1000.");
  }
  FramePainter painter(*this, options);
  FrameCost cost;
  cost.frames = frames;
  const CameraTarget camera_target = select_target(*this, options);
  std::vector<double> seconds;
  for (std::uint32_t i = 0; i < frames + kWarmUpFrames; ++i) {
    RenderOptions rotated_options = options;
    rotated_options.azimuth_degrees += 360.0 * (i % frames) / frames;
    const kiln_render_params params = painter.place_camera(camera_target, rotated_options);
    painter.wait_for_kernels();
    const auto start = std::chrono::steady_clock::now();
    painter.draw(params);
    painter.wait_for_kernels();
    const std::chrono::duration<double> frame_seconds = std::chrono::steady_clock::now() - start;
    cost.width = params.width;
    cost.height = params.height;
    if (i >= kWarmUpFrames) seconds.push_back(frame_seconds.count());
  }
  std::sort(seconds.begin(), seconds.end());
  cost.seconds_least = seconds.front();
  cost.seconds_most = seconds.back();
  cost.seconds_median = (seconds[(frames - 1) / 2] + seconds[frames / 2]) / 2;
  cost.triangles = position_indices.size() / 3;
  cost.vertices = count_vertices(*this, painter.with_map());
  // Bytes that a renderer would store for each vertex without and with a map, each triangle, and each texel
  constexpr std::uint64_t kPlainVertexBytes = 24, kMappedVertexBytes = 48, kTriangleBytes = 12,
                          kTexelBytes = 6;
  cost.bytes = cost.triangles * kTriangleBytes +
               cost.vertices * (painter.with_map() ? kMappedVertexBytes : kPlainVertexBytes);
  if (painter.with_map()) {
    cost.bytes += std::uint64_t{map_params.width} * map_params.height * kTexelBytes;
  }
  return cost;
}

Image Scene::rasterise(const RenderOptions& options) const { return impl_->rasterise(options); }

FrameCost Scene::time_frames(const RenderOptions& options, std::uint32_t frames) const {
  return impl_->time_frames(options, frames);
}

}  // namespace kiln
