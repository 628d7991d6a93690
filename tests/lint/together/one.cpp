namespace {

constexpr int kSides = 3;
double area(double side) { return side * side; }

}  // namespace

double one() { return area(kSides); }
