// A vector without a value: lint/vectors must name it.
Vec3d sum;
