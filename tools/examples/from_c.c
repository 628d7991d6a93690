// Uses Kiln from C: a box in arrays is simplified, unwrapped and baked. from_c NORMAL.png BOX.glb
#include <kiln/kiln_c.h>
#include <stdio.h>

static int failed(void) {
  fprintf(stderr, "%s: %s\n", kiln_error_code(), kiln_error_message());
  return 1;
}

int main(int count, char** arguments) {
  const float corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  const uint32_t triangles[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  kiln_mesh *high = NULL, *light = NULL, *low = NULL;
  kiln_source* source = NULL;
  kiln_bake* bake = NULL;
  kiln_mesh_view view;
  kiln_simplify_options to = {.size = sizeof to, .faces = 12};
  kiln_bake_options options;
  kiln_map map;
  kiln_mesh_view_init(&view);
  view.positions = (kiln_span){corners, 8, 0};
  view.indices = triangles;
  view.index_count = 36;
  kiln_bake_options_init(&options);
  options.width = options.height = 256;
  kiln_map_init(&map);
  if (count != 3) return 2;
  if (kiln_mesh_new(&view, &high) || kiln_simplify(high, &to, &light) || kiln_unwrap(light, NULL, &low)) return failed();
  if (kiln_source_new(NULL, high, NULL, NULL, &source) || kiln_bake_new(source, low, &options, &bake)) return failed();
  if (kiln_bake_map(bake, 0, &map) || kiln_map_save(&map, arguments[1])) return failed();
  if (kiln_glb_save(low, bake, arguments[2])) return failed();
  printf("12 triangles, %s of %u x %u with %u channels\n", map.name, map.width, map.height, map.channels);
  kiln_bake_free(bake);
  kiln_source_free(source);
  kiln_mesh_free(low);
  kiln_mesh_free(light);
  kiln_mesh_free(high);
  return 0;
}
