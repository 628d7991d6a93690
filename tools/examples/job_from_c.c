/* What `kiln bake` does, from C. job_from_c HIGH GAME.glb */
#include <kiln/kiln_c.h>
#include <stdio.h>

int main(int count, char** arguments) {
  kiln_job* job = NULL;
  kiln_job_result* result = NULL;
  if (count != 3) return 2;
  kiln_status status = kiln_job_new(&job);
  if (!status) status = kiln_job_set(job, "high", arguments[1]);
  if (!status) status = kiln_job_set(job, "faces", "500");
  if (!status) status = kiln_job_set(job, "out", arguments[2]);
  if (!status) status = kiln_job_run(job, NULL, NULL, NULL, &result);
  if (status) fprintf(stderr, "%s\n", kiln_error_message());
  else printf("wrote a file\n");
  kiln_job_result_free(result);
  kiln_job_free(job);
  return status;
}
