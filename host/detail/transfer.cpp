// Rows of maps that are not in the registry: transfers of the high poly's textures, variants, and custom maps
// of the caller.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>

#include "detail/low_frames.h"
#include "detail/own.h"
#include "detail/surface_texture.h"
#include "image/grey.h"
#include "mesh/kernels_shared.h"
#include "mesh/tangent.h"

namespace kiln {
namespace {

/// True if a texture holds one number per point, such as roughness. If it were stored in three
/// equal channels, it would take three times the memory, count errors three times, and not fit
/// formats of one channel.
bool is_scalar(const Texture& texture) {
  const auto is_grey_value = [](const std::array<float, 4>& v) {
    return v[0] == v[1] && v[0] == v[2];
  };
  return texture.kind == TextureKind::linear &&
         std::all_of(texture.plain.begin(), texture.plain.end(), is_grey_value) &&
         std::all_of(texture.factors.begin(), texture.factors.end(),
                     [&](const Texture::Factor& factor) { return is_grey_value(factor.times); }) &&
         std::all_of(texture.images.begin(), texture.images.end(),
                     [](const auto& image) { return image != nullptr && is_grey(*image, 0); });
}

class PlainTransfer : public PointFunction {
 public:
  PlainTransfer(const MapRequest& request, const Texture& texture, const MapInfo& info)
      : texture_(request.source, texture, {info.kind.name, request.options.fill_high}),
        channels_(info.channels) {}

  PointNeeds needs() const override {
    return {.position = false,
            .normal = false,
            .uv = texture_.needs_uvs(),
            .weight_sides = texture_.needs_other_uvs(),
            .distance = false};
  }
  bool has_weights() const override { return texture_.has_weights(); }
  void operator()(const HighPoint& point, float* value) const override {
    if (has_weights()) value[3] = 1;
    if (!point.found) return;
    float pixel[4];
    const float weight = texture_.read(point, pixel);
    std::copy_n(pixel, channels_, value);
    if (has_weights()) value[3] = weight;
  }
  void report(BakedMap&, std::vector<Warning>& warnings) const override {
    texture_.report(warnings);
  }

 private:
  SurfaceTexture texture_;
  std::uint32_t channels_;
};

/// Converts a tangent-space normal map of the high poly to the space of the bake's normals.
class NormalTransfer : public PointFunction {
 public:
  NormalTransfer(const MapRequest& request, const Texture& texture, std::string_view name)
      : source_(request.source),
        texture_(request.source, texture, {name, request.options.fill_high}),
        frames_(request),
        reads_(request.reads()) {}

  PointNeeds needs() const override {
    return {.position = false,
            .uv = true,
            .weight_sides = texture_.needs_other_uvs(),
            .distance = false};
  }

  void prepare(std::uint64_t source_version) override {
    if (source_version_ == source_version) return;
    normals_ = reads_->read_source(source_.attributes.normals);
    indices_ = reads_->read_source(source_.attributes.normal_indices);
    std::vector<Vec3> positions, normals;
    std::vector<Vec2> uvs;
    for (std::size_t t = 0; t < source_.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        positions.push_back(source_.positions[source_.triangles[t][k]]);
        normals.push_back(normal_of(t, k));
        // Tangents are computed from the UVs that the picture uses.
        const auto triangle = static_cast<std::uint32_t>(t);
        const Vec2& uv = texture_.uv_of(triangle, k);
        const auto [u, v] = texture_.transform_uv(triangle, uv.x, uv.y);
        uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
      }
    }
    tangents_ = mikk_tangents(positions, normals, uvs);
    source_version_ = source_version;
  }

  void operator()(const HighPoint& point, float* value) const override {
    Vec3d normal = point.normal;
    if (point.found) {
      float pixel[4];
      texture_.read(point, pixel);
      const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
      Vec3d up{}, right{};
      const CornerTangent* corners = &tangents_[std::size_t{3} * point.triangle];
      for (std::size_t k = 0; k < 3; ++k) {
        up += to_double(normal_of(point.triangle, k)) * weights[k];
        right += to_double(corners[k].tangent) * weights[k];
      }
      const Vec3d front = cross(up, right) * double{corners[0].sign};
      const Vec3d scaled_normal =
          right * double{pixel[0]} + front * double{pixel[1]} + up * double{pixel[2]};
      const double size = length(scaled_normal);
      // If point.normal was flipped because the face points away from the low poly, the mapped
      // normal is flipped, too.
      const double side = dot(up, point.normal) < 0 ? -1 : 1;
      if (size > 0) normal = scaled_normal * (side / size);
    }
    Vec3d local = frames_.transform_to_space(point, normal);
    const double size = length(local);
    if (size > 0) local = local * (1 / size);
    value[0] = static_cast<float>(local.x);
    value[1] = static_cast<float>(local.y);
    value[2] = static_cast<float>(local.z);
  }

  void report(BakedMap&, std::vector<Warning>& warnings) const override {
    texture_.report(warnings);
  }

 private:
  Vec3 normal_of(std::size_t triangle, std::size_t corner) const {
    const float* n = &normals_[std::size_t{3} * indices_[3 * triangle + corner]];
    return {n[0], n[1], n[2]};
  }

  const Source::Impl& source_;
  SurfaceTexture texture_;
  LowFrames frames_;
  std::shared_ptr<BandReads> reads_;
  std::vector<float> normals_;
  std::vector<std::uint32_t> indices_;
  std::vector<CornerTangent> tangents_;  // Tangents at the triangle's corners
  std::optional<std::uint64_t> source_version_;
};

MapRow row_of(const Transfer& transfer) {
  MapRow row;
  row.info.kind = MapKind(transfer.name);
  row.info.channels = 3;
  row.info.description = "texture of the high poly, filtered over each texel's footprint";
  row.follows_positions = true;
  if (transfer.texture.kind == TextureKind::normal) {
    row.info.type = MapType::unit_vector;
    row.info.description = "normal map of the high poly, in the requested space";
    row.reads_around = true;
    row.make = [info = row.info, &transfer](const MapRequest& request) {
      return make_point_map(request, info,
                            std::unique_ptr<PointFunction>(std::make_unique<NormalTransfer>(
                                request, transfer.texture, info.kind.name)));
    };
    return row;
  }
  row.info.type = transfer.texture.kind == TextureKind::srgb ? MapType::color : MapType::vector;
  if (is_scalar(transfer.texture)) {
    row.info.channels = 1;
    row.info.type = MapType::signed_scalar;
  }
  row.info.missed = MissedTexels::neighbours;
  row.make = [info = row.info, &transfer](const MapRequest& request) {
    return make_point_map(request, info,
                          std::unique_ptr<PointFunction>(
                              std::make_unique<PlainTransfer>(request, transfer.texture, info)));
  };
  return row;
}

/// The options of a variant, and the results that its map shares with others that use the same
/// options.
struct VariantWork : SharedWork {
  explicit VariantWork(BakeOptions new_options) : options(std::move(new_options)) {}
  void next_band() override { variant_works.next_band(); }
  void next_source() override { variant_works.next_source(); }
  BakeOptions options;
  SharedWorks variant_works;
};

MapRow row_of(const MapVariant& variant) {
  const MapRow& base = map_row(variant.kind);
  MapRow row = base;
  row.info.kind = MapKind{std::string_view(variant.name)};
  row.make = [&base, variant](const MapRequest& request) {
    auto work = std::make_shared<VariantWork>(options_of(variant, request.options));
    work->variant_works.add(request.reads());
    request.shared.add(work);
    return base.make({request.source, request.surface, work->options, work->variant_works,
                      request.footprint_divisor, request.is_reference});
  };
  if (!base.range) return row;
  row.range = [&base, variant](const RangeRequest& request, std::uint32_t channel) {
    const BakeOptions options = options_of(variant, request.options);
    return base.range({request.source, options, request.reach}, channel);
  };
  return row;
}

bool is_name(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !name.empty() && name.size() <= 64 && is_letter(name[0]) &&
         std::all_of(name.begin(), name.end(),
                     [&](char c) { return is_letter(c) || c == '_' || (c >= '0' && c <= '9'); });
}

void check_name(const std::string& name, std::span<const MapRow> rows) {
  const auto fail = [&](const std::string& problem) {
    throw Error(ErrorCode::usage, "A map cannot be called '" + name + "'" + problem);
  };
  const auto has_name = [&](const MapRow& row) { return row.info.kind.name == name; };
  if (!is_name(name)) fail(": use a letter, then letters, digits and _.");
  if (std::any_of(map_rows().begin(), map_rows().end(), has_name)) {
    fail(", which is another map's name: choose a different one.");
  }
  if (std::any_of(rows.begin(), rows.end(), has_name))
    fail(", since two maps have this name: rename one of them.");
}

}  // namespace

BakeOptions options_of(const MapVariant& variant, BakeOptions options) {
  if (variant.occlusion) options.occlusion = *variant.occlusion;
  if (variant.curvature_radius) options.curvature_radius = variant.curvature_radius;
  if (variant.light) options.light = *variant.light;
  if (variant.id_by) options.id_by = *variant.id_by;
  return options;
}

std::vector<double> occlusion_error_bounds(const BakeOptions& options) {
  std::vector<double> bounds;
  const auto add = [&](MapKind kind, double bound) {
    if (bound > 0 && obeys(map_row(kind).info, "occlusion.max_error")) bounds.push_back(bound);
  };
  for (const MapKind kind : options.maps) add(kind, options.occlusion.max_error);
  for (const MapVariant& variant : options.variants) {
    add(variant.kind, options_of(variant, options).occlusion.max_error);
  }
  return bounds;
}

std::vector<MapRow> own_rows(const BakeOptions& options) {
  std::vector<MapRow> rows;
  for (const Transfer& transfer : options.transfers) {
    check_name(transfer.name, rows);
    rows.push_back(row_of(transfer));
  }
  for (const OwnMap& map : options.own_maps) {
    check_name(map.name, rows);
    rows.push_back(own_map(map));
  }
  for (const MapVariant& variant : options.variants) {
    check_name(variant.name, rows);
    rows.push_back(row_of(variant));
  }
  return rows;
}

}  // namespace kiln
