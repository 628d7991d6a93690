#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>

#include <string>
#include <vector>

#include "io/image/exr.h"
#include "kiln/match.h"

namespace kiln {

void save_clusters(const VisibilityClusters& clusters, const std::filesystem::path& path) {
  const std::size_t count = std::size_t{clusters.width} * clusters.height;
  if (count == 0 || clusters.count == 0 || clusters.number.size() != count ||
      clusters.directions.size() != count * clusters.count) {
    throw Error(ErrorCode::usage,
                "Clusters cannot be saved: their arrays must have width x height (x count) "
                "elements.");
  }
  Imf::Header header(static_cast<int>(clusters.width), static_cast<int>(clusters.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer buffer;
  const auto add = [&](const std::string& name, Imf::PixelType type, const void* data,
                       std::size_t stride) {
    header.channels().insert(name, Imf::Channel(type));
    buffer.insert(name, Imf::Slice(type, static_cast<char*>(const_cast<void*>(data)), stride,
                                   stride * clusters.width));
  };
  const std::vector<std::uint32_t> number(clusters.number.begin(), clusters.number.end());
  add("count", Imf::UINT, number.data(), sizeof(std::uint32_t));
  for (std::uint32_t k = 0; k < clusters.count; ++k) {
    const std::string layer = "direction" + std::to_string(k);
    const std::size_t stride = sizeof(Vec3) * clusters.count;
    add(layer + ".X", Imf::FLOAT, &clusters.directions[k].x, stride);
    add(layer + ".Y", Imf::FLOAT, &clusters.directions[k].y, stride);
    add(layer + ".Z", Imf::FLOAT, &clusters.directions[k].z, stride);
  }
  write_exr(path, [&](ExrStream& stream) {
    Imf::OutputFile output(stream, header, exr_threads(0));
    output.setFrameBuffer(buffer);
    output.writePixels(static_cast<int>(clusters.height));
  });
}

}  // namespace kiln
