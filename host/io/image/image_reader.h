// Shared by the image readers: input from a file or from memory, limits, and errors.
#pragma once

#include <cstdint>
#include <string>

#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "kiln/image_data.h"
#include "kiln/image_format.h"

namespace kiln {

/// Maximum width and height of an image.
inline constexpr std::uint32_t kLargestImageSide = 65536;

/// Makes the function that throws a reader's errors: Error(input) "Could not read '<file>' as
/// <kind>: <place>: <problem>. <remedy>", without " as <kind>" if `kind` is empty.
FailWith image_failure(std::string file, std::string kind);

/// Parses a picture in any format that load_image() reads. The first bytes determine the format;
/// for TGA, the extension must fit, too.
/// \param file  file name for messages
/// \throws Error(input)
Image parse_image(const ByteSource& source, const std::string& file,
                  const ImageLimits& limits = {});

/// True if the numbers in a file are linear light; see holds_linear_light() in kiln/image.h.
bool holds_linear_light(const ByteSource& source, const std::string& file);

/// True for a GPU texture (KTX 2, DDS) of two channels, which usually are x and y of normals. False
/// for other formats, in which two channels are grey and alpha.
bool is_two_channel_texture(const ByteSource& source, const std::string& file);

/// Parses any PNG: palettes and transparency are expanded; numbers of 1 to 16 bits are divided by their maximum;
/// gamma and colour profiles are ignored.
/// \throws Error(input), as below
Image parse_png(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Parses the first part of an OpenEXR file: scan lines or tiles; half, float or unsigned int. Channels: R G B A, R G
/// B, R G or R; Y or Y A; X Y Z. These channels have no layer, or belong to the first layer with such channels. The
/// image is the display window if the data window lies inside (pixels outside of it are 0), otherwise the data
/// window.
/// \throws Error(input) that names the file. Headers that exceed the file's content, the limits or memory are
///         refused before allocation, with the name of the field.
Image parse_exr(const ByteSource& source, const std::string& file, const ImageLimits& limits = {});

/// Checks that the chunks of a PNG are complete, and that they contain enough data for the size
/// that IHDR declares.
/// \throws what `fail` throws
void check_png(const ByteSource& source, const FailWith& fail, const ImageLimits& limits);

}  // namespace kiln
