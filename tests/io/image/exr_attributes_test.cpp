// Attributes of OpenEXR's headers: what is not refused is read by OpenEXR's library as far as its length says.
#include <OpenEXR/ImfAttribute.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIDManifestAttribute.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/file/byte_source.h"
#include "io/image/exr_header.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "support/environment.h"

namespace kiln {
namespace {

/// Every type that OpenEXR 3.1 knows but the ID manifest, and one that it does not.
const std::vector<std::string> kTypes = {"box2f",        "box2i",
                                         "chlist",       "chromaticities",
                                         "compression",  "deepImageState",
                                         "double",       "envmap",
                                         "float",        "floatvector",
                                         "int",          "keycode",
                                         "lineOrder",    "m33d",
                                         "m33f",         "m44d",
                                         "m44f",         "preview",
                                         "rational",     "string",
                                         "stringvector", "tiledesc",
                                         "timecode",     "v2d",
                                         "v2f",          "v2i",
                                         "v3d",          "v3f",
                                         "v3i",          "nobody's own"};

class BytesStream : public Imf::IStream {
 public:
  explicit BytesStream(const std::string& bytes) : IStream("bytes"), bytes_(bytes) {}
  bool read(char* to, int count) override {
    if (static_cast<std::size_t>(count) > bytes_.size() - at_) throw std::runtime_error("beyond");
    std::memcpy(to, &bytes_[at_], static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t to) override { at_ = to; }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

std::string word(std::size_t value) {
  std::string bytes;
  for (unsigned i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 255U);
  return bytes;
}

/// A body that may be whole: texts, small numbers and zeros, so that lengths inside are often right.
std::string body_of(std::mt19937& random, const std::string& type) {
  if (type == "keycode" && random() % 2 == 0) return std::string(20, '\0') + word(4) + word(64);
  std::string body;
  const std::size_t pieces = random() % 6;
  for (std::size_t i = 0; i < pieces; ++i) {
    const std::size_t length = random() % 5;
    if (type == "stringvector") body += word(length) + std::string(length, 'a');
    if (type == "chlist") body += std::string(length, 'a') + std::string(17, '\0');
    if (type == "preview") body += word(length);
    if (type != "stringvector" && type != "chlist") {
      for (std::size_t k = 0; k < 4 * length; ++k) body += static_cast<char>(random() % 3);
    }
  }
  if (type == "chlist") body += '\0';
  if (random() % 4 == 0 && !body.empty()) body.resize(random() % body.size());
  if (random() % 4 == 0 && !body.empty())
    body[random() % body.size()] = static_cast<char>(random());
  return body;
}

/// A header with the attribute alone: whether it is refused for its length.
bool refused(const std::string& type, const std::string& body) {
  std::string bytes = word(20000630) + word(2) + "a";
  bytes += '\0' + type + '\0' + word(body.size()) + body + '\0';
  try {
    read_exr_headers(
        *bytes_in_memory(bytes),
        [](const std::string& field, const std::string& what, const Message&) {
          throw Error(ErrorCode::input, field + ": " + what);
        },
        4096);
  } catch (const Error& error) {
    return std::string(error.what()).find("which no " + type + " has") != std::string::npos;
  }
  ADD_FAILURE() << "a header without windows was taken";
  return false;
}

TEST(ExrAttributes, AreReadAsFarAsTheirLengths) {
  Imf::staticInitialize();
  std::mt19937 random(5);
  for (const std::string& type : kTypes) {
    std::size_t whole = 0, kept = 0;
    for (int i = 0; i < 1000; ++i) {
      std::string body = body_of(random, type);
      // For types of one length: that length often.
      if (random() % 2 == 0 && type != "keycode" && type != "chlist" && type != "stringvector") {
        constexpr std::size_t kLengths[] = {1, 4, 8, 9, 12, 16, 24, 28, 32, 36, 64, 72, 128};
        body.resize(kLengths[random() % std::size(kLengths)]);
      }
      if (refused(type, body)) continue;
      ++kept;
      if (!Imf::Attribute::knownType(type.c_str())) continue;  // read as it is
      const std::string more = body + std::string(4096, '\1');
      BytesStream stream(more);
      const std::unique_ptr<Imf::Attribute> attribute(Imf::Attribute::newAttribute(type.c_str()));
      try {
        attribute->readValueFrom(stream, static_cast<int>(body.size()), 2);
      } catch (const std::exception&) {
        continue;  // ends the reading, which harms nobody
      }
      ++whole;
      ASSERT_EQ(stream.tellg(), body.size()) << type << " of " << body.size() << " bytes";
    }
    EXPECT_GT(kept, 0U) << type;
    if (Imf::Attribute::knownType(type.c_str())) {
      EXPECT_GT(whole, 0U) << type;
    }
  }
}

/// OpenEXR 3.1 reads an ID manifest 4 bytes too far: what it takes for the next attribute's name lacks them.
TEST(ExrAttributes, IdManifestsHarmNothing) {
  const std::filesystem::path path = test::scratch_folder() / "manifest.exr";
  Imf::IDManifest manifest;
  Imf::IDManifest::ChannelGroupManifest& group = manifest.add("Y");
  group.setComponent("name");
  group.insert(1, std::string("left"));
  group.insert(2, std::string("right"));
  Imf::Header header(3, 2);
  header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
  // Before "channels", which would be lost.
  header.insert("a", Imf::IDManifestAttribute(Imf::CompressedIDManifest(manifest)));
  std::vector<float> values = {1, 2, 3, 4, 5, 6};
  {
    Imf::FrameBuffer buffer;
    buffer.insert("Y", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 12));
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(2);
  }
  const Image image = load_image(path);
  EXPECT_EQ(image.channels, 1U);
  EXPECT_EQ(image.pixels, values);
}

}  // namespace
}  // namespace kiln
