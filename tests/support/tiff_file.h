// Writes small TIFF files byte by byte, without a library, with the tags of GeoTIFF and GDAL.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace kiln::test {

/// A little-endian TIFF of one strip, by the specification of TIFF 6.
class TiffFile {
 public:
  enum Type : std::uint16_t { kAscii = 2, kShort = 3, kLong = 4, kDouble = 12 };

  template <typename T>
  TiffFile(std::uint32_t width, std::uint32_t height, std::uint16_t format, std::vector<T> pixels) {
    add<std::uint32_t>(256, kLong, {width});
    add<std::uint32_t>(257, kLong, {height});
    add<std::uint16_t>(258, kShort, {static_cast<std::uint16_t>(8 * sizeof(T))});
    add<std::uint16_t>(259, kShort, {1});
    add<std::uint16_t>(262, kShort, {1});  // black is zero
    add<std::uint16_t>(277, kShort, {1});
    add<std::uint32_t>(278, kLong, {height});
    add<std::uint16_t>(339, kShort, {format});
    pixels_.assign(reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(T));
  }
  template <typename T>
  TiffFile& add(std::uint16_t tag, Type type, const std::vector<T>& values) {
    tags_[tag] = {
        type, static_cast<std::uint32_t>(values.size()),
        std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T))};
    return *this;
  }
  TiffFile& scale(double x, double y) { return add<double>(33550, kDouble, {x, y, 0}); }
  /// \param row  of the picture, whose place it is
  TiffFile& tie(double x, double y, double row = 0) {
    return add<double>(33922, kDouble, {0, row, 0, x, y, 0});
  }
  /// Pairs of GeoKeys.
  TiffFile& keys(const std::vector<std::pair<std::uint16_t, std::uint16_t>>& pairs) {
    std::vector<std::uint16_t> words{1, 1, 0, static_cast<std::uint16_t>(pairs.size())};
    for (const auto& [key, value] : pairs) words.insert(words.end(), {key, 0, 1, value});
    return add(34735, kShort, words);
  }
  TiffFile& no_data(const std::string& text) {
    return add(42113, kAscii, std::vector<char>(text.c_str(), text.c_str() + text.size() + 1));
  }

  std::string bytes() {
    add<std::uint32_t>(273, kLong, {8});
    add<std::uint32_t>(279, kLong, {static_cast<std::uint32_t>(pixels_.size())});
    std::string body = pixels_;
    std::vector<std::uint32_t> places;
    for (const auto& [tag, entry] : tags_) {
      if (body.size() % 2 != 0) body += '\0';
      places.push_back(static_cast<std::uint32_t>(8 + body.size()));
      if (entry.bytes.size() > 4) body += entry.bytes;
    }
    if (body.size() % 2 != 0) body += '\0';
    std::string file("II*\0", 4);
    put(file, static_cast<std::uint32_t>(8 + body.size()));
    file += body;
    put(file, static_cast<std::uint16_t>(tags_.size()));
    std::size_t i = 0;
    for (const auto& [tag, entry] : tags_) {
      put(file, tag);
      put(file, static_cast<std::uint16_t>(entry.type));
      put(file, entry.count);
      std::string value = entry.bytes;
      if (value.size() > 4) {
        value.clear();
        put(value, places[i]);
      }
      value.resize(4);
      file += value;
      ++i;
    }
    put(file, std::uint32_t{0});
    return file;
  }

 private:
  struct Entry {
    Type type;
    std::uint32_t count;
    std::string bytes;
  };
  template <typename T>
  static void put(std::string& to, T value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  std::map<std::uint16_t, Entry> tags_;
  std::string pixels_;
};

}  // namespace kiln::test
