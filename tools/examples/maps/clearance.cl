// Distance to the next surface along the normal; 1 if there is none within one world unit.
float4 kiln_map(const kiln_point* point) {
  const float farthest = 1.0f;
  // A little off the surface, which the ray would meet otherwise.
  const float3 from = point->position + point->face_normal * 1e-4f;
  const kiln_meeting met = kiln_trace(point->scene, from, point->normal, farthest);
  const float share = met.distance < 0.0f ? 1.0f : met.distance / farthest;
  return (float4)(share, share, share, 1.0f);
}
