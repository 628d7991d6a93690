namespace {

// A call with a double chooses the function of one.cpp.
float area(float side) { return side / 2; }

}  // namespace

double two() { return area(2.0); }
