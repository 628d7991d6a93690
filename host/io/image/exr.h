// OpenEXR images, and functions shared with the other EXR files (match_io.cpp, cluster_io.cpp).
#pragma once

#include <ImfHeader.h>
#include <ImfIO.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "io/file/atomic_file.h"
#include "io/file/byte_source.h"
#include "io/image/exr_header.h"
#include "io/image/image_rows.h"
#include "kiln/error.h"
#include "kiln/image_data.h"
#include "kiln/image_format.h"

namespace kiln {

/// Writes half or float values with PIZ compression, in the channels Y, or R G, or R G B, or R G B
/// A. Floats are unchanged; halves are rounded to nearest even, and become infinite above 65504.
/// \throws Error(output)
void save_exr(const Image& image, const std::filesystem::path& path,
              const SaveImageOptions& options);

/// Begins the file that save_image() would write, for rows that are put afterwards.
std::unique_ptr<ImageRows> save_exr_rows(const ImageShape& shape, const std::filesystem::path& path,
                                         const SaveImageOptions& options);

/// Encodes the same file in memory.
std::vector<std::byte> encode_exr(const Image& image, const SaveImageOptions& options);

/// Writes the levels of a mip-map as tiles: each level has half the size of the previous one, rounded down, and the
/// last one is 1 x 1.
/// \throws Error(output)
void save_exr_mips(const std::vector<const Image*>& levels, const std::filesystem::path& path,
                   const SaveImageOptions& options);

/// Adds attributes for texts, and for the origin of positions unless it is 0.
/// \param prefix  prefix of the attributes' names: "" or "LAYER."
void put_texts(Imf::Header& header, const std::string& prefix, const std::array<double, 3>& origin,
               const std::vector<ImageText>& texts);

/// \throws Error(usage) for invalid texts (ImageText)
void check_texts(const std::vector<ImageText>& texts);

/// OpenEXR's input, which reads from the ByteSource that was checked.
class ExrSource : public Imf::IStream {
 public:
  /// All arguments must outlive the stream.
  ExrSource(const ByteSource& source, const std::string& file, const ExrPlan& plan)
      : Imf::IStream(file.c_str()), source_(source), plan_(plan) {}
  /// \throws std::exception at the end of the file
  bool read(char bytes[], int count) override;
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  const ByteSource& source_;
  const ExrPlan& plan_;
  std::uint64_t position_ = 0;
};

/// OpenEXR's output, which writes to an AtomicFile. OpenEXR writes the end of a file in a
/// destructor, which ignores errors; so check() must be called after that.
class ExrStream : public Imf::OStream {
 public:
  explicit ExrStream(AtomicFile& file);
  void write(const char bytes[], int count) override;
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override;
  /// \throws Error(output) if a write failed
  void check() const;

 private:
  AtomicFile& file_;
  std::uint64_t position_ = 0;
  std::exception_ptr error_;
};

/// Calls write(), and turns OpenEXR's exceptions into errors that name the file.
/// \throws Error(output)
template <typename Write>
void name_exr_errors(const AtomicFile& file, const ExrStream& stream, const Write& write) {
  try {
    write();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    stream.check();
    file.fail(error.what(), 0);
  }
}

/// Opens a file, calls write(stream), and commits it.
/// \throws Error(output)
template <typename Write>
void write_exr(const std::filesystem::path& path, const Write& write) {
  AtomicFile file(path);
  ExrStream stream(file);
  name_exr_errors(file, stream, [&] { write(stream); });
  stream.check();
  file.commit();
}

/// Number of rows that are converted and written at a time. It is a multiple of the number of rows
/// that any compression method packs together.
inline constexpr std::size_t kExrBandRows = 256;

/// Rows `first` to `first` + `count` - 1 of an image, converted to T.
template <typename T>
void convert_rows(const Image& image, std::size_t first, std::size_t count, std::vector<T>& band,
                  int threads) {
  const std::size_t row = std::size_t{image.width} * image.channels;
  band.resize(std::max(band.size(), count * row));
  const float* from = image.pixels.data() + first * row;
  parallel_for(
      count, 16,
      [&](std::size_t begin, std::size_t end) {
        std::transform(from + begin * row, from + end * row,
                       band.begin() + static_cast<std::ptrdiff_t>(begin * row),
                       [](float value) { return T(value); });
      },
      threads);
}

/// Number of threads for OpenEXR: `threads`, or the number of cores if that is 0. Starts OpenEXR's
/// global thread pool if it has no threads yet.
int exr_threads(int threads);

}  // namespace kiln
