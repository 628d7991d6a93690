// A command that knows a map and a match by their names: the lint must find both, but not the key of the report.
const char* match() { return "ray"; }
MapKind map() { return MapKind{"ao"}; }
Json json() { return {{"uv", 1}}; }
