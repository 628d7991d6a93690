#include "support/pictures.h"

#include "kiln/image.h"

namespace kiln::test {

Image read_picture(const std::filesystem::path& path) { return load_image(path); }

}  // namespace kiln::test
