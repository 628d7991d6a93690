// A header that climbs: the lint must find it.
#include "bake/bake.h"
