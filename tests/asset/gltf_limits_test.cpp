// glTF from strangers: what is refused before it costs time or memory, and what is not read.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "asset/gltf_files.h"
#include "asset/mesh_files.h"
#include "base/json_depth.h"
#include "base/memory.h"
#include "base/system_memory.h"
#include "io/file/byte_source.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "support/environment.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using mesh_files::expect_bad;
using mesh_files::expect_bad_text;
using mesh_files::load;
using mesh_files::load_text;
using mesh_files::write_file;
using nlohmann::json;

std::string nested(std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); }

TEST(JsonDepth, CountsListsAndObjectsAlone) {
  EXPECT_FALSE(is_nested_too_deep(nested(kMaxJsonDepth)));
  EXPECT_TRUE(is_nested_too_deep(nested(kMaxJsonDepth + 1)));
  std::string objects, ends;
  for (std::size_t i = 0; i <= kMaxJsonDepth; ++i) {
    objects += "{\"a\":";
    ends += "}";
  }
  EXPECT_TRUE(is_nested_too_deep(objects + "1" + ends));
  std::string many = "[";
  for (std::size_t i = 0; i < 3 * kMaxJsonDepth; ++i) many += "[],{},";
  EXPECT_FALSE(is_nested_too_deep(many + "0]"));
  const std::string brackets(3 * kMaxJsonDepth, '[');
  EXPECT_FALSE(is_nested_too_deep("[\"" + brackets + "\"]"));
  EXPECT_FALSE(is_nested_too_deep("[\"\\\"" + brackets + "\"]")) << "an escaped quote ends no text";
  EXPECT_TRUE(is_nested_too_deep("[\"\\\\\"," + brackets))
      << "an escaped backslash does not escape";
  EXPECT_FALSE(is_nested_too_deep("]]]]" + nested(kMaxJsonDepth)));
}

TEST(GltfLimits, DeepJsonIsRefused) {
  const std::string gltf = gltf_square().glb();
  const auto with_extras = [&](const std::string& extras) {
    GltfMaker maker = gltf_square();
    std::string text = maker.json.dump();
    // As text: a value that deep could not be destroyed.
    text.insert(text.size() - 1, R"(,"buffers":[{"byteLength":)" +
                                     std::to_string(maker.binary().size()) +
                                     R"(,"uri":"a.bin"}],"extras":)" + extras);
    const fs::path folder = scratch_folder();
    std::ofstream(folder / "a.bin", std::ios::binary) << maker.binary();
    std::ofstream(folder / "deep.gltf", std::ios::binary) << text;
    return folder / "deep.gltf";
  };
  EXPECT_EQ(load(with_extras(nested(kMaxJsonDepth - 1))).mesh.triangles.size(), 2U);
  for (const std::size_t depth : {kMaxJsonDepth, std::size_t{80000}}) {
    expect_bad(with_extras(nested(depth)), {"JSON", "200"});
  }
  // What is written, too: a program may hand on anything.
  const Mesh mesh = load_text("square.glb", gltf).mesh;
  const AssetMaterial material;
  SaveAssetOptions options;
  options.extras = "{\"a\":" + nested(80000) + "}";
  try {
    save_asset(mesh, std::span(&material, 1), scratch_folder() / "out.glb", options);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage);
  }
}

/// Views of one stream of zeros: packed into next to nothing.
GltfMaker overlapping_views(std::size_t count, bool same) {
  GltfMaker maker = gltf_square();
  constexpr std::size_t kElements = 60000, kStep = 64;
  const std::vector<unsigned char> zeros(kElements * kStep);
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(kElements, kStep));
  bytes.resize(
      meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), zeros.data(), kElements, kStep));
  const std::size_t view = maker.add_view(bytes);
  const json offset = maker.json["bufferViews"][view]["byteOffset"];
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t elements = same ? kElements : kElements - i;
    maker.json["bufferViews"].push_back({{"buffer", 0},
                                         {"byteLength", elements * kStep},
                                         {"extensions",
                                          {{"EXT_meshopt_compression",
                                            {{"buffer", 0},
                                             {"byteOffset", offset},
                                             {"byteLength", bytes.size()},
                                             {"byteStride", kStep},
                                             {"count", elements},
                                             {"mode", "ATTRIBUTES"}}}}}});
    maker.json["accessors"].push_back({{"bufferView", maker.json["bufferViews"].size() - 1},
                                       {"componentType", 5126},
                                       {"count", elements},
                                       {"type", "VEC3"}});
    json primitive{{"attributes", {{"POSITION", maker.json["accessors"].size() - 1}}}};
    if (i == 0) maker.json["meshes"][0]["primitives"].push_back(primitive);
  }
  maker.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  return maker;
}

TEST(GltfLimits, OverlappingViewsOfMeshoptAreRefusedBeforeTheyAreUnpacked) {
  // 64 bytes of each: 1 in 64 to the byte, and so many times that.
  expect_bad_text("many.glb", overlapping_views(100, false).glb(),
                  {"bufferViews", "EXT_meshopt_compression", "bytes can"});
  // The same one is unpacked once, however many views name it.
  EXPECT_EQ(load_text("same.glb", overlapping_views(100, true).glb()).mesh.positions.size(),
            60004U);
}

/// Limits the memory to a number of MiB beyond the present use while it lives.
class MemoryLeft {
 public:
  explicit MemoryLeft(std::uint64_t mebibytes) {
    set_memory_limit(os::resident_memory() + (mebibytes << 20));
  }
  ~MemoryLeft() { set_memory_limit(0); }
  MemoryLeft(const MemoryLeft&) = delete;
  MemoryLeft& operator=(const MemoryLeft&) = delete;
};

/// Makes peak_resident_bytes() start from the present use, where Linux can.
bool reset_peak_memory() {
  std::ofstream to("/proc/self/clear_refs");
  to << "5" << std::flush;
  return to.good();
}

/// Many primitives may name the same vertices, compressed to almost nothing: their sum is refused before any data is
/// decompressed.
TEST(GltfLimits, PrimitivesThatShareCompressedVerticesAreSummedBeforeTheyAreRead) {
  GltfMaker maker = overlapping_views(1, true);
  json& primitives = maker.json["meshes"][0]["primitives"];
  const json shared = primitives.back();
  while (primitives.size() < 201) primitives.push_back(shared);
  const std::string text = maker.glb();
  const std::uint64_t before = peak_resident_bytes();
  {
    const MemoryLeft left(512);
    expect_bad_text("many.glb", text,
                    {"many.glb: its meshes: 201 primitives", "12000004 vertices",
                     "4000002 triangles", "memory limit", "`memory_limit`"});
  }
  EXPECT_LT(peak_resident_bytes() - before, std::uint64_t{3} << 20)
      << "the view of 3.7 MB is not decompressed for the sum";
  // Several nodes count like several primitives.
  while (primitives.size() > 2) primitives.erase(2);
  for (int i = 0; i < 200; ++i) maker.json["nodes"].push_back({{"mesh", 0}});
  const MemoryLeft left(512);
  expect_bad_text("nodes.glb", maker.glb(), {"402 primitives", "12060804 vertices"});
}

/// What is asked for before reading is what reading takes.
TEST(GltfLimits, SumOfMemoryIsWhatReadingTakes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer's own memory counts";
#endif
  struct Kind {
    const char* name;
    bool normals, uvs, colors, tangents, indices, instances;
  };
  constexpr std::size_t kVertices = 60000, kPrimitives = 40;
  for (const Kind& kind : {Kind{"positions", false, false, false, false, false, false},
                           Kind{"indices", true, false, false, false, true, false},
                           Kind{"all", true, true, true, true, true, false},
                           Kind{"instances", true, true, false, false, true, true}}) {
    GltfMaker maker;
    std::vector<float> positions;
    for (std::size_t i = 0; i < 3 * kVertices; ++i) {
      positions.push_back(static_cast<float>(i * 7919 % 10007));
    }
    json primitive{{"attributes", {{"POSITION", maker.add<float>("VEC3", positions)}}}};
    const auto add = [&](const char* name, const char* type, std::size_t width) {
      std::vector<float> values(width * kVertices, 0.5F);
      for (std::size_t i = 0; width == 4 && i < kVertices; ++i) values[4 * i + 3] = 1;
      primitive["attributes"][name] = maker.add<float>(type, values);
    };
    if (kind.normals) add("NORMAL", "VEC3", 3);
    if (kind.uvs) add("TEXCOORD_0", "VEC2", 2);
    if (kind.colors) add("COLOR_0", "VEC4", 4);
    if (kind.tangents) add("TANGENT", "VEC4", 4);
    if (kind.indices) {
      std::vector<std::uint32_t> indices;
      for (std::uint32_t i = 0; i < 3 * kVertices; ++i) {
        indices.push_back(i * 7 % static_cast<std::uint32_t>(kVertices));
      }
      primitive["indices"] = maker.add<std::uint32_t>("SCALAR", indices);
    }
    maker.add_mesh(primitive);
    json& primitives = maker.json["meshes"][0]["primitives"];
    for (std::size_t i = 1; i < kPrimitives; ++i) {
      if (kind.instances) {
        maker.json["nodes"].push_back({{"mesh", 0}});
      } else {
        primitives.push_back(json(primitive));
      }
    }
    const std::string text = maker.glb();
    std::string message;
    {
      const MemoryLeft left(1);
      try {
        load_text("sum.glb", text);
      } catch (const Error& error) {
        message = error.what();
      }
    }
    const std::size_t at = message.find("would take ");
    ASSERT_NE(at, std::string::npos) << kind.name << ": " << message;
    const double stated = std::stod(message.substr(at + 11));
    os::return_free_blocks();
    if (!reset_peak_memory()) GTEST_SKIP() << "the system cannot forget the peak of memory";
    const std::uint64_t before = os::resident_memory();
    load_text("sum.glb", text);
    const double taken = static_cast<double>(peak_resident_bytes() - before) / 0x1p20;
    EXPECT_LT(taken, 1.1 * stated) << kind.name;
    EXPECT_GT(taken, 0.6 * stated) << kind.name;
    RecordProperty(kind.name, std::to_string(taken / stated));
  }
}

TEST(GltfLimits, LinksThatLeadOutOfTheFolderAreRefused) {
  const GltfMaker maker = gltf_square();
  const fs::path folder = scratch_folder();
  fs::create_directories(folder / "inside" / "deep");
  fs::create_directories(folder / "outside");
  const auto write_binary = [&](const fs::path& path) {
    std::ofstream(path, std::ios::binary) << maker.binary();
  };
  write_binary(folder / "outside" / "a.bin");
  write_binary(folder / "inside" / "deep" / "b.bin");
  fs::create_symlink(folder / "outside" / "a.bin", folder / "inside" / "out.bin");
  fs::create_directory_symlink(folder / "outside", folder / "inside" / "way");
  fs::create_symlink("deep/b.bin", folder / "inside" / "in.bin");
  const auto named = [&](const std::string& uri) {
    json text = maker.json;
    text["buffers"] = {{{"byteLength", maker.binary().size()}, {"uri", uri}}};
    std::ofstream(folder / "inside" / "a.gltf") << text.dump();
    return folder / "inside" / "a.gltf";
  };
  for (const char* const uri : {"out.bin", "way/a.bin"}) {
    expect_bad(named(uri), {"buffers[0].uri", "symbolic link", "`allow_outside`"});
    EXPECT_EQ(load_mesh(named(uri), {.outside = true}).triangles.size(), 2U);
  }
  EXPECT_EQ(load(named("in.bin")).mesh.triangles.size(), 2U) << "a link within the folder";
  expect_bad(named("../outside/a.bin"), {"buffers[0].uri", "`allow_outside`"});
  EXPECT_EQ(load_mesh(named("../outside/a.bin"), {.outside = true}).triangles.size(), 2U);
  EXPECT_THROW(load_mesh(named("http://x/a.bin"), {.outside = true}), Error);
  // The folder itself may be reached by a link.
  fs::create_directory_symlink(folder / "inside", folder / "door");
  named("deep/b.bin");
  EXPECT_EQ(load(folder / "door" / "a.gltf").mesh.triangles.size(), 2U);
}

/// Pictures too; and those of any format that are looked for by name.
TEST(GltfLimits, PicturesBehindLinksAreNotRead) {
  const fs::path folder = scratch_folder();
  fs::create_directories(folder / "inside" / "tex");
  const Image image{1, 1, 3, {1, 0, 0}};
  save_image(image, folder / "secret.png", {.format = ImageFormat::png8});
  fs::create_symlink(folder / "secret.png", folder / "inside" / "tex" / "a.png");
  GltfMaker maker = gltf_square();
  maker.json["buffers"] = {{{"byteLength", maker.binary().size()}, {"uri", "a.bin"}}};
  std::ofstream(folder / "inside" / "a.bin", std::ios::binary) << maker.binary();
  maker.json["images"] = {{{"uri", "tex/a.png"}}};
  maker.json["textures"] = {{{"source", 0}}};
  maker.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  maker.json["meshes"][0]["primitives"][0]["material"] = 0;
  std::ofstream(folder / "inside" / "a.gltf") << maker.json.dump();
  EXPECT_THROW(load_asset(folder / "inside" / "a.gltf"), Error);
  EXPECT_EQ(load_asset(folder / "inside" / "a.gltf", {.outside = true})
                .materials[0]
                .color_map.file.filename(),
            "a.png");
  // MTL names a path of another machine: what is found by its name must lie in the folder.
  std::ofstream(folder / "inside" / "b.mtl") << "newmtl m\nmap_Kd C:\\elsewhere\\a.png\n";
  std::ofstream(folder / "inside" / "b.obj")
      << "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
  const auto file_of = [&] {
    const Mesh mesh = load_mesh(folder / "inside" / "b.obj");
    return load_materials(mesh, folder / "inside" / "b.obj")[0].color_map.file;
  };
  EXPECT_FALSE(fs::exists(file_of()));
  fs::remove(folder / "inside" / "tex" / "a.png");
  save_image(image, folder / "inside" / "tex" / "a.png", {.format = ImageFormat::png8});
  EXPECT_TRUE(fs::exists(file_of()));
}

TEST(GltfLimits, VrmIsGltf) {
  const fs::path path = write_file("avatar.vrm", gltf_square().glb());
  EXPECT_EQ(load(path).mesh.triangles.size(), 2U);
  EXPECT_EQ(load_asset(path).nodes.size(), 1U);
  EXPECT_EQ(load_materials(load_mesh(path), path).size(), 1U);
  expect_bad_text("avatar.vrm", "v 0 0 0\n", {"avatar.vrm"});
}

TEST(GltfLimits, BinaryFilesBeyondFourGibibytes) {
  const fs::path path = write_file("large.glb", gltf_square().glb());
  std::error_code error;
  fs::resize_file(path, (std::uintmax_t{1} << 32) + 4096, error);  // takes no room on disk
  if (error) GTEST_SKIP() << "no large files here: " << error.message();
  expect_bad(path, {"4 GiB", ".gltf"});
}

TEST(ReadWhole, FilesThatChangeMeanwhileAreTold) {
  const FailWith fail = [](const std::string&, const std::string& problem, const Message&) {
    throw Error(ErrorCode::input, problem);
  };
  const auto problem_of = [&](std::size_t size) -> std::string {
    const fs::path path = write_file("a.bin", std::string(1000, 'a'));
    const std::unique_ptr<ByteSource> source = open_file(path, fail);
    if (size != 1000) fs::resize_file(path, size);  // else its time of change would be another
    try {
      read_whole(*source, fail);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(problem_of(900).find("900"), std::string::npos);
  EXPECT_NE(problem_of(0).find("changed while it was read"), std::string::npos);
  EXPECT_NE(problem_of(1100).find("1100"), std::string::npos);
  EXPECT_EQ(problem_of(1000), "");
}

/// An extension's picture that Kiln does not read: a whole sentence that names the place.
TEST(GltfLimits, PicturesOfOtherExtensionsAreTold) {
  GltfMaker maker = gltf_square();
  maker.json["textures"] = {{{"extensions", {{"EXT_texture_unheard_of", {{"source", 0}}}}}}};
  maker.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  maker.json["meshes"][0]["primitives"][0]["material"] = 0;
  std::vector<Warning> warnings;
  load_asset(write_file("other.glb", maker.glb()), {}, &warnings);
  std::string text;
  for (const Warning& warning : warnings) {
    if (warning.code == "picture-missing") text = warning.message.text();
  }
  EXPECT_NE(text.find("1 picture of its materials (textures[0]: EXT_texture_unheard_of) is in a "
                      "format of an extension that Kiln does not read"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace kiln::test
