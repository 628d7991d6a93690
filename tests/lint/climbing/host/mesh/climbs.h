// A header that climbs: the lint must find it.
#include <unistd.h>

#include "bake/bake.h"
#include "kiln/kiln.h"
