#include "asset/gltf_file.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "asset/file_finder.h"
#include "asset/gltf_draco.h"
#include "base/counted.h"
#include "base/json_depth.h"
#include "base/option.h"
#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "io/file/text_scanner.h"
#include "kiln/files.h"

namespace kiln {
namespace {

static_assert(std::endian::native == std::endian::little,
              "glTF stores little-endian numbers, which are read without conversion");

constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

template <typename T>
T read_as(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// A component type of accessors, by its number in glTF.
struct ComponentType {
  std::size_t bytes;
  double largest;  ///< The integer that represents 1 in normalised accessors
  double (*read)(const char* from);
};

template <typename T>
constexpr ComponentType component_type() {
  return {sizeof(T), static_cast<double>(std::numeric_limits<T>::max()),
          [](const char* from) { return static_cast<double>(read_as<T>(from)); }};
}

constexpr std::uint64_t kFloat = 5126;
constexpr const char* kMeshopt = "EXT_meshopt_compression";
// Upper bounds of the compression ratio of meshopt. Vertices keep at least 1/64 of their size,
// since each 16 bytes take at least 2 bits.
constexpr std::uint64_t kMaxUnpackedRatio = 64, kMaxUncheckedViewBytes = 65536;

ComponentType component_of(const GltfValue& place, std::uint64_t type) {
  switch (type) {
    case 5120:
      return component_type<std::int8_t>();
    case 5121:
      return component_type<std::uint8_t>();
    case 5122:
      return component_type<std::int16_t>();
    case 5123:
      return component_type<std::uint16_t>();
    case 5125:
      return component_type<std::uint32_t>();
    case kFloat:
      return component_type<float>();
    default:
      place.fail("it has components of type " + std::to_string(type) +
                 ", which does not exist in glTF");
  }
}

std::size_t width_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  if (type == "MAT4") return GltfFile::kMatrix;
  return 0;
}

/// Decodes the percent-encoded bytes of a URI. Invalid escapes stay as they are.
std::string decode_percent(std::string_view text) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 &&
        digit(text[i + 2]) >= 0) {
      result += static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2]));
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

/// Decodes base64.
/// \returns false if there are invalid characters
bool decode_base64(std::string_view text, std::string& bytes) {
  while (text.ends_with('=')) text.remove_suffix(1);
  bytes.clear();
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    int value = 0;
    if (c >= 'A' && c <= 'Z') {
      value = c - 'A';
    } else if (c >= 'a' && c <= 'z') {
      value = c - 'a' + 26;
    } else if (c >= '0' && c <= '9') {
      value = c - '0' + 52;
    } else if (c == '+' || c == '-') {
      value = 62;
    } else if (c == '/' || c == '_') {
      value = 63;
    } else {
      return false;
    }
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> count & 0xFF);
    }
  }
  return true;
}

bool is_supported(const std::string& extension) {
  // The specification says that a reader must reject files that require an unknown extension.
  // However, each extension KHR_materials_* only adds effects, such as clearcoat or sheen, to the
  // core material, and Kiln has no map for these. Geometry, UVs and maps remain valid, so a warning
  // names the ignored extension. Lights and metadata do not affect surfaces.
  for (const char* start : {"KHR_materials_", "KHR_lights_", "KHR_xmp", "KHR_animation_"}) {
    if (extension.starts_with(start)) return true;
  }
  return extension == "KHR_mesh_quantization" || extension == "KHR_texture_transform" ||
         extension == "EXT_texture_webp" || extension == kMeshopt ||
         extension == "EXT_mesh_gpu_instancing" || extension.starts_with("VRM") ||
         (kReadsDraco && extension == kDraco);
}

}  // namespace

GltfFile::~GltfFile() = default;

GltfFile::GltfFile(const MeshInput& input) : input_(input) {
  std::string_view text = input.bytes;
  if (text.starts_with("glTF")) {
    const auto word = [&](std::size_t at) { return read_as<std::uint32_t>(text.data() + at); };
    constexpr const char* kExportAgain = "Export or copy the file again.";
    if (text.size() < 20) input.fail("", "the file is truncated within its header", kExportAgain);
    if (word(4) != 2) {
      input.fail("byte 4", "it is binary glTF of version " + std::to_string(word(4)),
                 "Export it as glTF 2.0.");
    }
    const std::uint64_t length = word(8);
    if (length > text.size()) {
      input.fail("byte 8",
                 "the file is truncated: it should have " + std::to_string(length) +
                     " bytes, but has " + std::to_string(text.size()),
                 kExportAgain);
    }
    if (length < 20)
      input.fail("byte 8", "its length of " + std::to_string(length) + " is too short",
                 kExportAgain);
    if (length < text.size()) {
      input.warn("trailing-bytes",
                 counted(text.size() - length, "byte") + " after the end were ignored.",
                 text.size() - length);
    }
    const auto chunk = [&](std::size_t at) {
      const std::uint64_t size = word(at);
      if (size > length - at - 8) {
        input.fail("byte " + std::to_string(at),
                   "a chunk should have " + std::to_string(size) + " bytes, but only " +
                       std::to_string(length - at - 8) + " are left",
                   kExportAgain);
      }
      return text.substr(at + 8, size);
    };
    const std::string_view json = chunk(12);
    if (word(16) != kJsonChunk) input.fail("byte 16", "its first chunk is not JSON", kExportAgain);
    for (std::size_t chunk_offset = 20 + json.size(); chunk_offset + 8 <= length;) {
      const std::string_view content = chunk(chunk_offset);
      if (word(chunk_offset + 4) == kBinaryChunk && !has_binary_) {
        binary_ = content;
        has_binary_ = true;
      }
      chunk_offset += 8 + content.size();
    }
    text = json;
  }
  const FailWith fail = [&input](const std::string& place, const std::string& problem,
                                 const Message& remedy) { input.fail(place, problem, remedy); };
  // The worst case is a list of empty lists: each is two characters of text, but takes 16 bytes and
  // a vector in memory.
  require_memory("its JSON", saturated_product(24, text.size()), memory_failure(fail, ""));
  if (is_nested_too_deep(text)) {
    input.fail("", "its JSON is nested more than " + std::to_string(kMaxJsonDepth) + " levels deep",
               "Remove deeply nested data, such as extras, and export the file again.");
  }
  try {
    json_ = std::make_unique<nlohmann::json>(nlohmann::json::parse(text.begin(), text.end()));
  } catch (const nlohmann::json::parse_error& error) {
    input.fail("byte " + std::to_string(error.byte) + " of the JSON", "it is not valid JSON there",
               "Export or copy the file again.");
  } catch (const nlohmann::json::exception&) {
    input.fail("", "a number of its JSON is out of range", "Export the file again.");
  }
  const GltfValue asset = root()["asset"];
  const std::string version = asset["version"].text();
  if (!asset.exists() || !version.starts_with("2.")) {
    asset.fail(version.empty() ? "it has no version" : "it is glTF " + version.substr(0, 20),
               "Export it as glTF 2.0.");
  }
  const GltfValue required = root()["extensionsRequired"];
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = required.at(i).text();
    if (is_supported(name)) continue;
    required.at(i).fail("it needs the extension " + printable(name.substr(0, 100)) +
                            (name == kDraco ? ", but this build of Kiln does not include Draco"
                                            : ", which Kiln does not read"),
                        name == kDraco
                            ? "Export it without compression, decompress it (gltf-transform copy), "
                              "or build Kiln with KILN_DRACO=ON and Draco installed."
                            : "Export it without this extension.");
  }
}

GltfValue GltfFile::root() const { return {input_, json_.get(), ""}; }

bool GltfFile::decode_data_uri(const GltfValue& uri, std::string& bytes) {
  const std::string text = uri.text();
  if (!text.starts_with("data:")) return false;
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) uri.fail("its data URI has no data");
  if (!std::string_view(text).substr(0, comma).ends_with(";base64")) {
    bytes = decode_percent(std::string_view(text).substr(comma + 1));
  } else if (!decode_base64(std::string_view(text).substr(comma + 1), bytes)) {
    uri.fail("its data is not valid base64");
  }
  return true;
}

std::filesystem::path GltfFile::path_of(const GltfValue& uri) const {
  std::string text = decode_percent(uri.text());
  std::replace(text.begin(), text.end(), '\\', '/');
  const std::filesystem::path path = text;
  const bool has_scheme = text.find(':') < text.find('/');
  const std::string quoted_uri = "\"" + printable(text.substr(0, 200)) + "\"";
  const auto fail_outside = [&](const std::string& why) {
    uri.fail(quoted_uri + why + ", and was not read",
             "Move it into the folder of the glTF file, and refer to it by a relative path; or "
             "allow it (" +
                 option("allow_outside") + ").");
  };
  if (text.empty() || has_scheme || text.find('\0') != text.npos) {
    uri.fail(quoted_uri + " is not a file in the folder of the glTF file, and was not read",
             "Move it into the folder of the glTF file, and refer to it by a relative path.");
  }
  if (!input_.folder) {
    uri.fail(quoted_uri + " is a separate file, but the glTF was read from memory",
             "Give the path of the glTF file, or a GLB that contains all data.");
  }
  std::filesystem::path file = *input_.folder / path;
  if (input_.options.outside) return file;
  bool leaves_folder = path.is_absolute();
  for (const std::filesystem::path& part : path) leaves_folder = leaves_folder || part == "..";
  if (leaves_folder) fail_outside(" is no file in the folder of the glTF file");
  if (!lies_within(*input_.folder, file)) {
    fail_outside(" is a symbolic link to a file outside the folder of the glTF file");
  }
  return file;
}

std::string_view GltfFile::buffer(std::size_t index) const {
  const GltfValue buffer = list("buffers").at(index);
  const GltfValue uri = buffer["uri"];
  const std::uint64_t length = buffer["byteLength"].count(0);
  std::string_view bytes;
  if (!uri.exists()) {
    if (index != 0 || !has_binary_) {
      buffer.fail("it has neither a URI nor the binary chunk of a GLB");
    }
    bytes = binary_;
  } else {
    auto& cached_buffer = buffers_[index];
    if (cached_buffer == nullptr) {
      std::string buffer_bytes;
      cached_buffer = decode_data_uri(uri, buffer_bytes)
                          ? std::make_shared<const std::string>(std::move(buffer_bytes))
                          : read_buffer(uri);
    }
    bytes = *cached_buffer;
  }
  if (length > bytes.size()) {
    buffer.fail(
        "it should have " + std::to_string(length) + " bytes, but " + there_are_only(bytes.size()),
        "The data is truncated: export or copy it again.");
  }
  return bytes.substr(0, length);
}

/// The contents of a buffer's file. It is read once, even if several buffers refer to it.
std::shared_ptr<const std::string> GltfFile::read_buffer(const GltfValue& uri) const {
  const std::filesystem::path path = path_of(uri);
  std::shared_ptr<const std::string>& cached_file = files_[path.lexically_normal()];
  if (cached_file != nullptr) return cached_file;
  const FailWith fail = [&](const std::string& /*place*/, const std::string& problem,
                            const Message& remedy) {
    uri.fail("'" + printable(uri.text()) + "': " + problem, remedy);
  };
  cached_file = std::make_shared<const std::string>(read_whole(*open_file(path, fail), fail));
  OutputSet::protect(path);
  return cached_file;
}

/// The bytes of a buffer that a view refers to, whether compressed or not.
std::string_view GltfFile::part_of_buffer(const GltfValue& view) const {
  const auto buffer_index = view["buffer"].index_into(list("buffers"));
  if (!buffer_index) view.fail("it names no buffer");
  const std::string_view bytes = buffer(*buffer_index);
  const std::uint64_t offset = view["byteOffset"].count(0), length = view["byteLength"].count(0);
  if (offset > bytes.size() || length > bytes.size() - offset) {
    view.fail("it takes " + std::to_string(length) + " bytes from byte " + std::to_string(offset) +
              " on, but buffers[" + std::to_string(*buffer_index) + "] has only " +
              std::to_string(bytes.size()));
  }
  return bytes.substr(offset, length);
}

GltfFile::CompressedView GltfFile::compressed_view_of(const GltfValue& packed) const {
  const auto buffer = packed["buffer"].index_into(list("buffers"));
  if (!buffer) packed.fail("it names no buffer");
  return {*buffer,
          packed["byteOffset"].count(0),
          packed["byteLength"].count(0),
          packed["count"].count(0),
          packed["byteStride"].count(0),
          packed["mode"].text(),
          packed["filter"].text()};
}

/// Rejects compressed views that together unpack to more than their bytes can hold, before any of
/// them is decompressed: each may be valid by itself, while thousands of them overlap.
void GltfFile::check_packed() const {
  if (are_compressed_views_checked_) return;
  const GltfValue views = list("bufferViews");
  std::set<CompressedView> parts;
  std::set<std::size_t> buffers;
  std::uint64_t unpacked = 0, bytes = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const GltfValue packed = views.at(i)["extensions"][kMeshopt];
    if (!packed.exists()) continue;
    const auto [part, added] = parts.insert(compressed_view_of(packed));
    if (!added) continue;
    if (part->step != 0 &&
        part->count > (kMaxUnpackedRatio * part->length + kMaxUncheckedViewBytes) / part->step) {
      packed.fail("it should hold " + std::to_string(part->count) + " elements, more than its " +
                  std::to_string(part->length) + " compressed bytes can hold");
    }
    unpacked = saturated_sum(unpacked, saturated_product(part->count, part->step));
    buffers.insert(part->buffer);
  }
  for (const std::size_t i : buffers) bytes += buffer(i).size();
  if (unpacked > kMaxUnpackedRatio * bytes + kMaxUncheckedViewBytes) {
    views.fail("the views that " + std::string(kMeshopt) + " compresses would decompress to " +
               std::to_string(unpacked) + " bytes, more than their " + std::to_string(bytes) +
               " compressed bytes can hold");
  }
  const FailWith fail = [&](const std::string& /*place*/, const std::string& problem,
                            const Message& remedy) { views.fail(problem, remedy); };
  require_memory("its decompressed data", unpacked, memory_failure(fail, ""));
  are_compressed_views_checked_ = true;
}

std::string GltfFile::unpack(const GltfValue& packed, const CompressedView& part) const {
  const std::string_view bytes = part_of_buffer(packed);
  const std::uint64_t count = part.count, step = part.step;
  const std::string &mode = part.mode, &filter = part.filter;
  const bool vertices = mode == "ATTRIBUTES", triangles = mode == "TRIANGLES";
  if (!vertices && !triangles && mode != "INDICES")
    packed["mode"].fail("it is not a mode of meshopt");
  const bool is_valid_stride = vertices
                                   ? step >= 4 && step <= 256 && step % 4 == 0
                                   : (step == 2 || step == 4) && (!triangles || count % 3 == 0);
  if (!is_valid_stride) packed.fail("its byteStride or count is invalid for its mode");
  const auto* const compressed = reinterpret_cast<const unsigned char*>(bytes.data());
  std::string result(count * step, '\0');
  const int error =
      vertices ? meshopt_decodeVertexBuffer(result.data(), count, step, compressed, bytes.size())
      : triangles
          ? meshopt_decodeIndexBuffer(result.data(), count, step, compressed, bytes.size())
          : meshopt_decodeIndexSequence(result.data(), count, step, compressed, bytes.size());
  if (error != 0) packed.fail("its data is damaged, or was written by a newer meshopt");
  if (filter.empty() || filter == "NONE") return result;
  if (filter == "OCTAHEDRAL" && vertices && (step == 4 || step == 8)) {
    meshopt_decodeFilterOct(result.data(), count, step);
  } else if (filter == "QUATERNION" && vertices && step == 8) {
    meshopt_decodeFilterQuat(result.data(), count, step);
  } else if (filter == "EXPONENTIAL" && vertices) {
    meshopt_decodeFilterExp(result.data(), count, step);
  } else {
    packed["filter"].fail("it is not a meshopt filter for this mode and byteStride");
  }
  return result;
}

std::string_view GltfFile::view(std::size_t index) const {
  const GltfValue view = list("bufferViews").at(index);
  const GltfValue packed = view["extensions"][kMeshopt];
  if (!packed.exists()) return part_of_buffer(view);
  const CompressedView part = compressed_view_of(packed);
  view_size(index);  // Called for its check: rejects views of a wrong size
  if (const auto known = unpacked_.find(part); known != unpacked_.end()) return known->second;
  return unpacked_.emplace(part, unpack(packed, part)).first->second;
}

double GltfFile::integer_of_one(const GltfValue& accessor) {
  const std::uint64_t type = accessor["componentType"].count(0);
  return type == kFloat ? 1 : component_of(accessor, type).largest;
}

/// Size of a buffer view in bytes, once it is decompressed. Nothing is decompressed to find it.
std::size_t GltfFile::view_size(std::size_t index) const {
  const GltfValue view = list("bufferViews").at(index);
  const GltfValue packed = view["extensions"][kMeshopt];
  if (!packed.exists()) return part_of_buffer(view).size();
  check_packed();
  const CompressedView part = compressed_view_of(packed);
  const std::uint64_t size = saturated_product(part.count, part.step);
  if (size != view["byteLength"].count(0)) {
    packed.fail("its count times byteStride is not the byteLength of its bufferView");
  }
  return size;
}

/// Where the elements of an accessor lie in a buffer view.
struct GltfFile::Elements {
  std::size_t view = 0, count = 0, offset = 0, step = 0;
};

GltfFile::Elements GltfFile::check_elements(const GltfValue& accessor,
                                            const GltfValue& place_of_view, std::size_t count,
                                            std::uint64_t offset, std::uint64_t component_type,
                                            std::size_t width, std::size_t row_step) const {
  const auto view_index = place_of_view.index_into(list("bufferViews"));
  if (!view_index) accessor.fail("it names no bufferView");
  const std::size_t size = component_of(accessor, component_type).bytes * width;
  const std::size_t step = std::max<std::size_t>(row_step != 0 ? row_step : size, 1);
  const std::size_t bytes = view_size(*view_index);
  // This cannot overflow: counts in JSON are at most 2^53, and the division comes first.
  const bool is_within_view = count == 0 || (offset <= bytes && bytes - offset >= size &&
                                             (count - 1) <= (bytes - offset - size) / step);
  if (!is_within_view) {
    accessor.fail("its " + counted(count, "element") + " from byte " + std::to_string(offset) +
                  " on are more than bufferViews[" + std::to_string(*view_index) +
                  "] has: " + std::to_string(bytes) + " bytes");
  }
  return {*view_index, count, offset, step};
}

/// Address of the first of some elements, whose location in the buffer was checked before; null if there are none.
const char* GltfFile::first_of(const Elements& elements) const {
  return elements.count == 0 ? nullptr : view(elements.view).data() + elements.offset;
}

/// Finds where the elements of an accessor lie, except for sparse ones. Returns nothing if all
/// elements are zero.
std::optional<GltfFile::Elements> GltfFile::check_elements(const GltfValue& accessor) const {
  const std::uint64_t count = accessor["count"].count(0);
  const GltfValue view = accessor["bufferView"];
  if (const auto index = view.index_into(list("bufferViews"))) {
    const std::size_t step = list("bufferViews").at(*index)["byteStride"].count(0);
    return check_elements(accessor, view, count, accessor["byteOffset"].count(0),
                          accessor["componentType"].count(0), width_of(accessor["type"].text()),
                          step);
  }
  constexpr std::size_t kMaxUncheckedZeros = 65536;
  if (count > std::max(input_.bytes.size(), kMaxUncheckedZeros)) {
    accessor.fail("it has " + std::to_string(count) +
                  " elements without a bufferView, more than the file has bytes");
  }
  return std::nullopt;
}

std::size_t GltfFile::count(std::size_t index) const {
  const GltfValue accessor = list("accessors").at(index);
  check_elements(accessor);
  return accessor["count"].count(0);
}

GltfNumbers GltfFile::read(std::size_t index, std::size_t width, bool indices) const {
  const GltfValue accessor = list("accessors").at(index);
  const std::uint64_t type = accessor["componentType"].count(0);
  const ComponentType component = component_of(accessor, type);
  const std::size_t file_width = width_of(accessor["type"].text());
  if (file_width != width && !(width == kColor && (file_width == 3 || file_width == 4))) {
    accessor.fail("it is of type \"" + printable(accessor["type"].text().substr(0, 20)) +
                  "\", where " +
                  (width == kColor    ? "VEC3 or VEC4"
                   : width == kMatrix ? "MAT4"
                   : width == 1       ? "SCALAR"
                                      : "VEC" + std::to_string(width)) +
                  " belongs");
  }
  if (file_width == kMatrix && type != kFloat) {
    accessor.fail("it has matrices of integers, which Kiln does not read");
  }
  if (indices && (type == kFloat || type == 5120 || type == 5122)) {
    accessor.fail("it has indices that are no unsigned integers");
  }
  const bool normalized = accessor["normalized"].flag() && type != kFloat;
  const std::size_t count = this->count(index);
  const GltfValue sparse = accessor["sparse"];
  const std::optional<Elements> source_elements = check_elements(accessor);
  const FailWith fail = [&](const std::string& /*place*/, const std::string& problem,
                            const Message& remedy) { accessor.fail(problem, remedy); };
  require_memory("its numbers", saturated_product(count, file_width * sizeof(double)),
                 memory_failure(fail, ""));
  GltfNumbers result{file_width, std::vector<double>(count * file_width)};
  const auto copy = [&](const char* element, std::size_t to) {
    for (std::size_t k = 0; k < file_width; ++k) {
      const double value = component.read(element + k * component.bytes);
      result.values[to * file_width + k] =
          normalized ? std::max(value / component.largest, -1.0) : value;
    }
  };
  if (source_elements) {
    const char* const first = first_of(*source_elements);
    for (std::size_t i = 0; i < count; ++i) copy(first + i * source_elements->step, i);
  }
  if (!sparse.exists()) return result;
  const std::size_t changed_count = sparse["count"].count(0);
  const GltfValue places = sparse["indices"], values = sparse["values"];
  const std::uint64_t place_type = places["componentType"].count(0);
  if (place_type != 5121 && place_type != 5123 && place_type != 5125) {
    places.fail("it has indices that are no unsigned integers");
  }
  const Elements at = check_elements(places, places["bufferView"], changed_count,
                                     places["byteOffset"].count(0), place_type, 1, 0);
  const Elements value = check_elements(values, values["bufferView"], changed_count,
                                        values["byteOffset"].count(0), type, file_width, 0);
  const char *const first_place = first_of(at), *const first_value = first_of(value);
  const ComponentType place_component = component_of(places, place_type);
  for (std::size_t i = 0; i < changed_count; ++i) {
    const auto target_element =
        static_cast<std::size_t>(place_component.read(first_place + i * at.step));
    if (target_element >= count) {
      places.fail("it refers to element " + std::to_string(target_element) + ", but " +
                  there_are_only(count));
    }
    copy(first_value + i * value.step, target_element);
  }
  return result;
}

GltfNumbers GltfFile::numbers(std::size_t accessor, std::size_t width) const {
  return read(accessor, width, false);
}

bool GltfFile::holds_integers(std::size_t accessor) const {
  return list("accessors").at(accessor)["componentType"].count(0) != kFloat;
}

std::vector<std::uint32_t> GltfFile::indices(std::size_t accessor, std::size_t below) const {
  const GltfNumbers read_numbers = read(accessor, 1, true);
  std::vector<std::uint32_t> result(read_numbers.values.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const double index = read_numbers.values[i];
    if (!(index < static_cast<double>(below))) {
      list("accessors")
          .at(accessor)
          .fail("its index " + std::to_string(i) + " is " +
                std::to_string(static_cast<std::uint64_t>(index)) + ", but " +
                there_are_only(below) + (below == 1 ? " vertex" : " vertices"));
    }
    result[i] = static_cast<std::uint32_t>(index);
  }
  return result;
}

}  // namespace kiln
