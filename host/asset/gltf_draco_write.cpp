#include "asset/gltf_draco_write.h"

#include "kiln/error.h"

#ifndef KILN_HAS_DRACO
namespace kiln {

bool can_pack_draco() { return false; }

DracoPrimitive pack_draco(std::span<const std::uint32_t> /*indices*/, std::size_t /*vertices*/,
                          std::span<const DracoStream> /*streams*/) {
  throw Error(ErrorCode::usage,
              "This build of Kiln does not include Draco. Choose meshopt, or build Kiln with "
              "KILN_DRACO=ON and Draco installed.");
}

}  // namespace kiln
#else

#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include <algorithm>

namespace kiln {
namespace {

draco::GeometryAttribute::Type type_of(DracoStream::Use use) {
  switch (use) {
    case DracoStream::Use::position:
      return draco::GeometryAttribute::POSITION;
    case DracoStream::Use::normal:
      return draco::GeometryAttribute::NORMAL;
    case DracoStream::Use::uv:
      return draco::GeometryAttribute::TEX_COORD;
    case DracoStream::Use::other:
      break;
  }
  return draco::GeometryAttribute::GENERIC;
}

int bits_of(DracoStream::Use use) {
  return use == DracoStream::Use::position || use == DracoStream::Use::uv ? 16 : 12;
}

}  // namespace

bool can_pack_draco() { return true; }

DracoPrimitive pack_draco(std::span<const std::uint32_t> indices, std::size_t vertices,
                          std::span<const DracoStream> streams) {
  draco::Mesh mesh;
  mesh.set_num_points(static_cast<std::uint32_t>(vertices));
  mesh.SetNumFaces(indices.size() / 3);
  for (std::size_t t = 0; t < indices.size() / 3; ++t) {
    draco::Mesh::Face face;
    for (std::size_t k = 0; k < 3; ++k) face[k] = draco::PointIndex(indices[3 * t + k]);
    mesh.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(t)), face);
  }
  DracoPrimitive result;
  std::vector<std::int32_t> attributes;
  for (const DracoStream& stream : streams) {
    const bool is_integer = !stream.shares.empty();
    const std::size_t step = stream.width * (is_integer ? sizeof(std::uint16_t) : sizeof(float));
    draco::GeometryAttribute attribute;
    attribute.Init(type_of(stream.use), nullptr, static_cast<std::uint8_t>(stream.width),
                   is_integer ? draco::DT_UINT16 : draco::DT_FLOAT32, is_integer,
                   static_cast<std::int64_t>(step), 0);
    const std::int32_t id =
        mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(vertices));
    const auto* const source_values = is_integer
                                          ? reinterpret_cast<const char*>(stream.shares.data())
                                          : reinterpret_cast<const char*>(stream.values.data());
    for (std::size_t i = 0; i < vertices; ++i) {
      mesh.attribute(id)->SetAttributeValue(
          draco::AttributeValueIndex(static_cast<std::uint32_t>(i)), source_values + i * step);
    }
    attributes.push_back(id);
    result.ids.push_back(mesh.attribute(id)->unique_id());
  }
  // Vertices that are split at seams have equal positions. Merging these values tells Draco that
  // the triangles on both sides are neighbours.
  mesh.DeduplicateAttributeValues();
  draco::ExpertEncoder encoder(mesh);
  // Speed from 0 to 10, the fastest. A speed of 0 would make files less than 1% smaller
  constexpr int kEncoderSpeed = 3;
  encoder.SetSpeedOptions(kEncoderSpeed, kEncoderSpeed);
  encoder.SetTrackEncodedProperties(true);
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (streams[i].shares.empty()) {
      encoder.SetAttributeQuantization(attributes[i], bits_of(streams[i].use));
    }
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) {
    throw Error(ErrorCode::internal,
                "Draco could not compress a mesh: " + status.error_msg_string() + ".");
  }
  result.bytes.assign(buffer.data(), buffer.size());
  result.vertices = encoder.num_encoded_points();
  result.indices = 3 * encoder.num_encoded_faces();
  return result;
}

}  // namespace kiln
#endif
