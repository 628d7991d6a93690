#pragma once

namespace kiln {

/// "MAJOR.MINOR.PATCH" of the library that is linked.
const char* version() noexcept;

}  // namespace kiln
