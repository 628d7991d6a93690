// Lines of equal height, ten a world unit.
float4 kiln_map(const kiln_point* point) {
  const float lines = point->position.y * 10.0f;
  const float away = fabs(lines - rint(lines));  // from the nearest line, 0 to 0.5
  const float shade = away < 0.1f ? 0.0f : 1.0f;
  const float high = clamp(point->position.y * 0.5f + 0.5f, 0.0f, 1.0f);
  return (float4)(shade * high, shade * 0.5f, shade * (1.0f - high), 1.0f);
}
