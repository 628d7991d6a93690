// Reads pictures for tests that need no more of kiln/image.h, whose changes then do not compile them anew.
#pragma once

#include <filesystem>

#include "kiln/image_data.h"

namespace kiln::test {

/// load_image() of a file.
Image read_picture(const std::filesystem::path& path);

}  // namespace kiln::test
