#include "kiln/error.h"

namespace kiln {

Error::~Error() = default;

}  // namespace kiln
