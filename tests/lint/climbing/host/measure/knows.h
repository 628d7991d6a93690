// A header that knows a map by its name: the lint must find it.
inline constexpr const char* kMeasured = "slope";
