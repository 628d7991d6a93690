#include "asset/gltf_draco.h"

#ifndef KILN_HAS_DRACO
namespace kiln {

DracoCounts count_draco(const GltfFile& /*file*/, const GltfValue& /*extension*/) { return {}; }

DracoMesh unpack_draco(const GltfFile& /*file*/, const GltfValue& extension,
                       const std::vector<DracoAttribute>& /*attributes*/) {
  extension.fail("it is compressed by Draco, which this build of Kiln does not include",
                 "Export it without compression, decompress it (gltf-transform copy), or build "
                 "Kiln with KILN_DRACO=ON and Draco installed.");
}

}  // namespace kiln
#else

#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_decoder.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>

#include "io/file/bounds.h"

namespace kiln {
namespace {

/// Limits the memory that a decoder may allocate, since Draco trusts the numbers in a file.
class DecodeLimits {
 public:
  DecodeLimits(const GltfValue& place, std::size_t bytes) : place_(place), bytes_(bytes) {}

  /// Checks the numbers of triangles and vertices before Draco allocates memory for them.
  /// \returns both numbers in the order of the file: triangles first in the sequential method,
  ///   vertices first in edgebreaker
  std::array<std::uint32_t, 2> check_connectivity(draco::DecoderBuffer ahead) const {
    std::array<std::uint32_t, 2> counts{};
    for (std::uint32_t& count : counts) {
      if (!draco::DecodeVarint(&count, &ahead)) fail();
    }
    constexpr std::uint64_t kMaxTrianglesPerByte = 512, kUncheckedTriangles = 65536,
                            kBytesPerTriangle = 160;
    const std::uint64_t max_count = std::max(counts[0], counts[1]);
    if (max_count > kMaxTrianglesPerByte * bytes_ + kUncheckedTriangles) {
      place_.fail("its " + std::to_string(bytes_) + " bytes cannot contain the " +
                  std::to_string(max_count) + " triangles or vertices that it declares");
    }
    require(saturated_product(max_count, kBytesPerTriangle));
    return counts;
  }

  void check_attributes(const draco::PointCloud& points) const {
    std::uint64_t bytes = 0;
    for (std::int32_t i = 0; i < points.num_attributes(); ++i) {
      // Each value takes memory for itself, for a copy as an integer, and for an index.
      bytes +=
          std::uint64_t{8} * static_cast<std::uint64_t>(points.attribute(i)->num_components()) + 8;
    }
    // An upper bound; points of real files need fewer bytes
    constexpr std::uint64_t kMaxBytesPerPoint = 1024;
    if (bytes > kMaxBytesPerPoint) {
      place_.fail("it has more attributes than a mesh can use");
    }
    require(saturated_product(points.num_points(), bytes));
  }

  [[noreturn]] void fail() const {
    place_.fail("its data is damaged, or not in Draco 2.2, which glTF requires");
  }

 private:
  void require(std::uint64_t bytes) const {
    const FailWith fail_with = [this](const std::string& /*place*/, const std::string& problem,
                                      const Message& remedy) { place_.fail(problem, remedy); };
    require_memory("its unpacked mesh", bytes, memory_failure(fail_with, ""));
  }

  const GltfValue& place_;
  std::size_t bytes_;
};

/// A decoder that checks sizes before it allocates memory for them.
template <typename Decoder>
class BoundedDecoder : public Decoder {
 public:
  explicit BoundedDecoder(const DecodeLimits& limits) : limits_(limits) {}

 protected:
  bool DecodeConnectivity() override {
    limits_.check_connectivity(*this->buffer());
    return Decoder::DecodeConnectivity();
  }
  bool DecodeAllAttributes() override {
    limits_.check_attributes(*this->point_cloud());
    return Decoder::DecodeAllAttributes();
  }

 private:
  const DecodeLimits& limits_;
};

/// A decoder that reads the header alone, and then stops with a failure.
template <typename Decoder>
class HeaderReader : public Decoder {
 public:
  explicit HeaderReader(const DecodeLimits& limits) : limits_(limits) {}
  std::optional<std::array<std::uint32_t, 2> > counts;

 protected:
  bool DecodeConnectivity() override {
    counts = limits_.check_connectivity(*this->buffer());
    return false;
  }

 private:
  const DecodeLimits& limits_;
};

/// Reads the header.
/// \returns the compression method
/// \throws Error(input) if it is no Draco header that glTF allows
int method_of(draco::DecoderBuffer ahead, const DecodeLimits& limits) {
  draco::DracoHeader header;
  if (!draco::PointCloudDecoder::DecodeHeader(&ahead, &header).ok() ||
      header.encoder_type != draco::TRIANGULAR_MESH || header.version_major != 2 ||
      header.version_minor != 2) {
    limits.fail();
  }
  return header.encoder_method;
}

template <typename Decoder>
std::array<std::uint32_t, 2> read_head(draco::DecoderBuffer buffer, const DecodeLimits& limits) {
  HeaderReader<Decoder> decoder(limits);
  const draco::DecoderOptions options;
  draco::Mesh discarded_mesh;
  static_cast<void>(decoder.Decode(options, &buffer, &discarded_mesh));
  if (!decoder.counts) limits.fail();
  return *decoder.counts;
}

void decode(std::string_view bytes, const DecodeLimits& limits, draco::Mesh& mesh) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  const int method = method_of(buffer, limits);
  std::unique_ptr<draco::MeshDecoder> decoder;
  if (method == draco::MESH_EDGEBREAKER_ENCODING) {
    decoder = std::make_unique<BoundedDecoder<draco::MeshEdgebreakerDecoder> >(limits);
  } else if (method == draco::MESH_SEQUENTIAL_ENCODING) {
    decoder = std::make_unique<BoundedDecoder<draco::MeshSequentialDecoder> >(limits);
  } else {
    limits.fail();
  }
  const draco::DecoderOptions options;
  if (!decoder->Decode(options, &buffer, &mesh).ok()) limits.fail();
}

GltfNumbers numbers_of(const draco::Mesh& mesh, const DracoAttribute& asked) {
  const auto fail = [&](const std::string& problem) { asked.accessor.fail(problem); };
  if (asked.id > 0xFFFFFFFFU) fail("its compressed data has no attribute with that number");
  const draco::PointAttribute* const attribute =
      mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(asked.id));
  if (attribute == nullptr) {
    fail("its compressed data has no attribute " + std::to_string(asked.id) + " (" + asked.name +
         ")");
  }
  GltfNumbers result;
  result.width = static_cast<std::size_t>(attribute->num_components());
  const bool has_requested_width = asked.width == GltfFile::kColor
                                       ? result.width == 3 || result.width == 4
                                       : result.width == asked.width;
  if (!has_requested_width) {
    fail("its compressed " + asked.name + " has " + std::to_string(result.width) +
         " numbers per vertex");
  }
  double largest = 1;  // The integer that represents 1 in normalised accessors
  if (asked.accessor["normalized"].flag() && !attribute->normalized()) {
    largest = GltfFile::integer_of_one(asked.accessor);
  }
  result.values.resize(std::size_t{mesh.num_points()} * result.width);
  float values[4];
  for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
    const draco::AttributeValueIndex value = attribute->mapped_index(draco::PointIndex(i));
    if (value.value() >= attribute->size() ||
        !attribute->ConvertValue<float>(value, static_cast<std::int8_t>(result.width), values)) {
      fail("its compressed " + asked.name + " is damaged at vertex " + std::to_string(i));
    }
    for (std::size_t k = 0; k < result.width; ++k) {
      const double number = values[k];
      result.values[i * result.width + k] =
          largest == 1 ? number : std::max(number / largest, -1.0);
    }
  }
  return result;
}

std::string_view bytes_of(const GltfFile& file, const GltfValue& extension) {
  const auto view = extension["bufferView"].index_into(file.list("bufferViews"));
  if (!view) extension.fail("it refers to no bufferView");
  return file.view(*view);
}

}  // namespace

DracoCounts count_draco(const GltfFile& file, const GltfValue& extension) {
  const std::string_view bytes = bytes_of(file, extension);
  const DecodeLimits limits(extension, bytes.size());
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  const int method = method_of(buffer, limits);
  if (method == draco::MESH_EDGEBREAKER_ENCODING) {
    const auto [vertices, triangles] = read_head<draco::MeshEdgebreakerDecoder>(buffer, limits);
    return {triangles, vertices};
  }
  if (method != draco::MESH_SEQUENTIAL_ENCODING) limits.fail();
  const auto [triangles, vertices] = read_head<draco::MeshSequentialDecoder>(buffer, limits);
  return {triangles, vertices};
}

DracoMesh unpack_draco(const GltfFile& file, const GltfValue& extension,
                       const std::vector<DracoAttribute>& attributes) {
  const std::string_view bytes = bytes_of(file, extension);
  draco::Mesh mesh;
  decode(bytes, DecodeLimits(extension, bytes.size()), mesh);
  DracoMesh result;
  result.points = mesh.num_points();
  result.indices.reserve(std::size_t{3} * mesh.num_faces());
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(f))) {
      if (corner.value() >= mesh.num_points()) {
        extension.fail("its triangle " + std::to_string(f) +
                       " refers to a vertex that does not exist");
      }
      result.indices.push_back(corner.value());
    }
  }
  for (const DracoAttribute& requested : attributes) {
    result.attributes.push_back(numbers_of(mesh, requested));
  }
  return result;
}

}  // namespace kiln
#endif
